"""The answer of `solve`: an allocation with its scores, how good it is proven to be, and why the run stopped."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from alloc.allocators.contract.budget import StopReason
from alloc.allocators.contract.search import Improvement
from alloc.allocators.contract.tolerance import EXACT, PROVEN, MakespanTolerance, relative_gap
from alloc.problems import Allocation, Evaluation, Instance, Objective
from alloc.problems.evaluation import RELATIVE_TOLERANCE

RESULT_FORMAT = "alloc-result/1"


class Status(StrEnum):
    """How good the answer is proven to be."""

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    NO_SOLUTION = "no_solution"


@dataclass(frozen=True, eq=False)
class Result:
    """What came out of one run.

    Attributes
    ----------
    instance : Instance
    method : str
        Name of the method that ran; the one picked, where `auto` was asked for.
    objective : Objective
    seed : int
    allocation : Allocation or None
        None with status `no_solution` alone.
    evaluation : Evaluation or None
        Scores of `allocation`.
    lower_bound, energy_lower_bound : float or None
        Best proven bounds on the makespan in hours, and on the energy of any allocation with this makespan, or within
        `makespan_limit`; None while a task is unserved, and for the energy also where it is no objective or no bound
        is at hand.
    status : Status
    makespan_limit : float or None
        Hours up to which the energy alone counted, where a slack or a limit was given for the makespan.
    stop_reason : StopReason
    runtime_s : float
        Seconds from the instance in memory to the allocation in memory.
    trace : tuple of Improvement
        Every improvement, in order.
    notes : tuple of str
        What the user should know, in plain words: what `auto` picked and why, what the method tells of its run, which
        tasks too few agents can reach.
    tolerance : MakespanTolerance
        The slack and the limit that were given for the makespan.
    """

    instance: Instance
    method: str
    objective: Objective
    seed: int
    allocation: Allocation | None
    evaluation: Evaluation | None
    lower_bound: float | None
    energy_lower_bound: float | None
    stop_reason: StopReason
    runtime_s: float
    trace: tuple[Improvement, ...]
    notes: tuple[str, ...] = ()
    makespan_limit: float | None = None
    tolerance: MakespanTolerance = EXACT

    @property
    def makespan(self) -> float | None:
        """Hours until the last task is done; None while a task is unserved."""
        return None if self.evaluation is None else self.evaluation.makespan

    @property
    def energy(self) -> float | None:
        """Energy of the allocation."""
        return None if self.evaluation is None else self.evaluation.energy

    @property
    def gap(self) -> float | None:
        """Relative gap (T - bound) / T."""
        if self.makespan is None or self.lower_bound is None:
            return None
        return relative_gap(self.makespan, self.lower_bound)

    @property
    def energy_gap(self) -> float | None:
        """Relative gap (E - bound) / E of the energy at this makespan."""
        if self.energy is None or self.energy_lower_bound is None:
            return None
        return relative_gap(self.energy, self.energy_lower_bound)

    @property
    def status(self) -> Status:
        """Derived from the scores and the bounds alone."""
        if self.evaluation is None:
            return Status.NO_SOLUTION
        if self.evaluation.unserved_tasks:
            return Status.INFEASIBLE
        cheap = self.energy_gap is not None and self.energy_gap <= PROVEN
        proven = self._is_fast_enough and (cheap or self.objective is Objective.MAKESPAN)
        return Status.OPTIMAL if proven else Status.FEASIBLE

    @property
    def _is_fast_enough(self) -> bool:
        """Whether the makespan is proven to be the least, up to the slack or the limit that was given."""
        if self.makespan is None or self.lower_bound is None:
            return False
        excess = relative_gap(self.makespan, self.tolerance.hours(self.lower_bound))
        return excess <= PROVEN + RELATIVE_TOLERANCE

    def to_dict(self) -> dict[str, Any]:
        """Return the fields of the format `alloc-result/1`."""
        ids, score = self.instance, self.evaluation
        limit = {} if self.makespan_limit is None else {"makespan_limit": self.makespan_limit}
        return {
            "format": RESULT_FORMAT,
            "method": self.method,
            "objective": str(self.objective),
            "instance": ids.name,
            "seed": self.seed,
            "status": str(self.status),
            "stop_reason": str(self.stop_reason),
            "makespan": self.makespan,
            "served_makespan": None if score is None else score.served_makespan,
            "lower_bound": self.lower_bound,
            "gap": self.gap,
            **limit,
            "energy": self.energy,
            "energy_lower_bound": self.energy_lower_bound,
            "energy_gap": self.energy_gap,
            "distance": None if score is None else score.distance,
            "battery_remaining_percent": None if score is None else score.battery_remaining_percent,
            "reward": None if score is None else score.reward,
            "unserved_tasks": [] if score is None else [ids.task_ids[j] for j in score.unserved_tasks],
            "violations": []
            if score is None
            else [
                {"agent": ids.agent_ids[v.agent], "task": ids.task_ids[v.task], "reason": v.reason}
                for v in score.violations
            ],
            "runtime_s": self.runtime_s,
            "assignment": {} if self.allocation is None else self.allocation.to_ids(ids),
            "trace": [
                {"time_s": step.time_s, "makespan": step.evaluation.makespan, "energy": step.evaluation.energy}
                for step in self.trace
            ],
        }
