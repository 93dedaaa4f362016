"""The suite as one class."""

from alloc.allocators.conformance.answers import AnswerChecks
from alloc.allocators.conformance.isolation import IsolationChecks
from alloc.allocators.conformance.runs import RunChecks


class AllocatorConformance(AnswerChecks, RunChecks, IsolationChecks):
    """What the contract of `Allocator` asks for, as tests; subclass it as ``class TestMine(AllocatorConformance)``.

    Give the subclass either `name` or a method `allocator`. Instances that the method refuses, as its `Method` or its
    `refusal` says, are checked to be refused.

    Attributes
    ----------
    name : str
        What to load; not needed where `allocator` is overridden.
    options : dict
        Parameters to load it with.
    iterations : int
        Budget where answers must be reproducible; choose it so that a run takes some 50 ms.
    patience_s : float
        Longest time for any run, as all have either few iterations or a short time limit.
    """
