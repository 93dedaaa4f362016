"""The contract of an allocator: it gets a `Search`, and returns a `Proposal`."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.method import Method
from alloc.allocators.contract.search import Search
from alloc.problems import Allocation, Instance, Objective, RefusedError

__all__ = ["Allocator", "Proposal", "RefusedError"]


@dataclass(frozen=True)
class Proposal:
    """What an allocator answers; `solve` scores it.

    Attributes
    ----------
    allocation : Allocation or None
        Its answer; None stands for the best that it gave to `Search.submit`, if any.
    makespan_lower_bound : float or None
        Hours that every allocation serving all tasks needs, as far as the method proved it.
    energy_lower_bound : float or None
        Energy that every allocation needs whose makespan is at most that of the answer, as far as proved.
    notes : tuple of str
        What the user should know of the run, in plain words; `Result.notes` tells it.
    """

    allocation: Allocation | None = None
    makespan_lower_bound: float | None = None
    energy_lower_bound: float | None = None
    notes: tuple[str, ...] = ()


class Allocator(ABC):
    """A method, loaded and ready; one object serves many instances and threads at once.

    Subclasses set `method`, and keep no state that `allocate` changes.
    """

    method: ClassVar[Method]

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Return why this method cannot hold `budget` on `instance`, or None if it can; must be quick."""
        return None

    @abstractmethod
    def allocate(self, search: Search) -> Proposal:
        """Look for the best allocation of ``search.instance``.

        Call ``search.submit`` with every improvement and ask ``search.should_stop()`` often, every 0.1 s at the
        least. Count ``search.iteration`` up where the method iterates; the same ``search.seed`` must give the same
        answer when the budget counts iterations.
        """
