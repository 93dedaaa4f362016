"""Methods that allocate, behind one contract; `solve` runs and scores any of them."""

from alloc.allocators.contract.base import Allocator, Proposal, RefusedError
from alloc.allocators.contract.budget import Budget, StopReason
from alloc.allocators.contract.method import Kind, Method
from alloc.allocators.contract.search import Improvement, Search
from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.allocators.registry import describe, load, names
from alloc.allocators.result import Result, Status
from alloc.allocators.solve import solve

__all__ = [
    "Allocator",
    "Budget",
    "Improvement",
    "Kind",
    "MakespanTolerance",
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
