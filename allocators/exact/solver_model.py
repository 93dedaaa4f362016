"""The model that a stage passes to a solver, the answer, and the protocol of back ends."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from alloc.allocators.contract.search import Search
from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.monitor import SolverMonitor
from alloc.problems.instance import FloatArray, IntArray


class Verdict(Enum):
    """Whether there is a plan for a makespan or a model."""

    FEASIBLE = "feasible"
    """A plan was found."""

    INFEASIBLE = "infeasible"
    """It is proven that there is no plan."""

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
        Whether effort is limited by work counts instead of time, so that the same seed gives the same answer.
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
    """The integer programme at a fixed T, see `exact.model`: constraints and, optionally, an objective.

    Attributes
    ----------
    demand : Demand
        The constraints.
    cost : ndarray, shape (p,), or None
        Cost >= 0 of one agent of each pair, to be minimised; None for a feasibility problem.
    hint : ndarray of int, shape (p,), or None
        Agents per pair of a plan, as a warm start.
    limits : SolverLimits
    """

    demand: Demand
    cost: FloatArray | None
    hint: IntArray | None
    limits: SolverLimits


@dataclass(frozen=True, eq=False)
class Answer:
    """Answer of a solver.

    Attributes
    ----------
    verdict : Verdict
    counts : ndarray of int, shape (p,), or None
        Agents per pair of the best plan if the verdict is FEASIBLE; subject to confirmation by the evaluator.
    bound : float
        Lower bound on the cost of all plans.
    """

    verdict: Verdict = Verdict.UNKNOWN
    counts: IntArray | None = None
    bound: float = 0.0


class Solver(Protocol):
    """A solver for integer programmes.

    Attributes
    ----------
    max_pairs : int
        Largest number of pairs of agent class and task for which a model is built.
    pairs_per_second : int
        Speed of model building in pairs per second.
    """

    max_pairs: int
    pairs_per_second: int

    def solve_model(self, model: SolverModel, monitor: SolverMonitor) -> Answer:
        """Solve `model` in its own thread, and report all plans found to `monitor`."""
        ...


def is_repeatable(search: Search) -> bool:
    """Whether the run is limited by iterations alone, so that effort must be counted rather than timed."""
    return search.budget.time_limit_s is None and search.budget.iterations is not None
