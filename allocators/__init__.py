"""Methods that allocate, behind one contract; `solve` runs and scores any of them."""

from alloc.allocators.contract.base import Allocator, Proposal, RefusedError
from alloc.allocators.contract.method import Kind, Method
from alloc.allocators.contract.search import Budget, Deadline, Improvement, Search, StopReason
from alloc.allocators.registry import describe, load, names
from alloc.allocators.result import Result, Status
from alloc.allocators.solve import solve

__all__ = [
    "Allocator",
    "Budget",
    "Deadline",
    "Improvement",
    "Kind",
    "Method",
    "Proposal",
    "RefusedError",
    "Result",
    "Search",
    "Status",
    "StopReason",
    "describe",
    "load",
    "names",
    "solve",
]
