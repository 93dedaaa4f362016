"""The conformance suite as one class."""

from alloc.allocators.conformance.answers import AnswerChecks
from alloc.allocators.conformance.isolation import IsolationChecks
from alloc.allocators.conformance.runs import RunChecks


class AllocatorConformance(AnswerChecks, RunChecks, IsolationChecks):
    """Tests of the contract of `Allocator`; subclass it as ``class TestMine(AllocatorConformance)``.

    The subclass must define either `name` or a method `allocator`. For instances that the method does not support
    according to its `Method` or `refusal`, the tests check that `solve` refuses them.

    Attributes
    ----------
    name : str
        Name of the method to load; not needed if `allocator` is overridden.
    options : dict
        Parameters for loading it.
    iterations : int
        Budget of reproducible runs; choose it so that a run takes about 50 ms.
    patience_s : float
        Maximum time of any run; all have either few iterations or a short time limit.
    """
