"""File formats of instances and allocations, and their readers and writers."""

from alloc.problems.formats.allocation_file import (
    allocation_from_document,
    allocation_to_document,
    read_allocation,
    read_allocations,
    read_plan,
    write_allocation,
)
from alloc.problems.formats.document import from_document, to_document
from alloc.problems.formats.files import (
    check_writable,
    is_standard_output,
    read_bytes,
    read_text,
    write_bytes_atomically,
    write_text_atomically,
)
from alloc.problems.formats.instance_file import read_instance, write_instance
from alloc.problems.formats.model_file import write_model

__all__ = [
    "allocation_from_document",
    "allocation_to_document",
    "check_writable",
    "from_document",
    "is_standard_output",
    "read_allocation",
    "read_allocations",
    "read_bytes",
    "read_instance",
    "read_plan",
    "read_text",
    "to_document",
    "write_allocation",
    "write_bytes_atomically",
    "write_instance",
    "write_model",
    "write_text_atomically",
]
