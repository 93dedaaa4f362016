"""The model that a stage gives to a solver, the answer, and the protocol that back ends implement."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from alloc.allocators.contract.search import Search
from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.monitor import SolverMonitor
from alloc.problems.instance import FloatArray, IntArray


class Verdict(Enum):
    """Whether a makespan, or a model, has a plan."""

    FEASIBLE = "feasible"
    """A plan is at hand."""

    INFEASIBLE = "infeasible"
    """It is proven that there is none."""

    UNKNOWN = "unknown"
    """Neither a plan nor a proof was found within the limits."""


@dataclass(frozen=True)
class SolverLimits:
    """The effort that a solver may spend.

    Attributes
    ----------
    seconds : float
        Time limit, possibly ``inf``.
    threads : int
    seed : int
    repeatable : bool
        Whether effort is limited by counting work, so that the same seed gives the same answer.
    """

    seconds: float
    threads: int
    seed: int
    repeatable: bool

    @classmethod
    def of(cls, search: Search, seconds: float, threads: int) -> "SolverLimits":
        """Return the limits of one call within a run."""
        return cls(seconds, threads, search.seed, is_repeatable(search))


@dataclass(frozen=True, eq=False)
class SolverModel:
    """The integer programme at a fixed T, see `exact.model`: constraints, and an objective if there is one.

    Attributes
    ----------
    demand : Demand
        The constraints.
    cost : ndarray, shape (p,), or None
        Cost >= 0 of one agent of each pair, to be minimised; None if any plan will do.
    hint : ndarray of int, shape (p,), or None
        Agents per pair of a plan to begin with.
    limits : SolverLimits
    """

    demand: Demand
    cost: FloatArray | None
    hint: IntArray | None
    limits: SolverLimits


@dataclass(frozen=True, eq=False)
class Answer:
    """What a solver found out.

    Attributes
    ----------
    verdict : Verdict
    counts : ndarray of int, shape (p,), or None
        Agents per pair of the best plan where the verdict is FEASIBLE; the evaluator decides whether it holds.
    bound : float
        No plan costs less.
    """

    verdict: Verdict = Verdict.UNKNOWN
    counts: IntArray | None = None
    bound: float = 0.0


class Solver(Protocol):
    """A solver for integer programmes.

    Attributes
    ----------
    max_pairs : int
        Pairs of agent class and task above which no model is built.
    pairs_per_second : int
        Pairs of which a model is built in a second.
    """

    max_pairs: int
    pairs_per_second: int

    def solve_model(self, model: SolverModel, monitor: SolverMonitor) -> Answer:
        """Solve `model` in a thread of its own, reporting the plans on the way to `monitor`."""
        ...


def is_repeatable(search: Search) -> bool:
    """Whether the run is limited by iterations alone, so that effort must be counted and not timed."""
    return search.budget.time_limit_s is None and search.budget.iterations is not None
