"""The answer of `solve`: an allocation with its scores and proven bounds, and why the run stopped."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING

from alloc.allocators.contract.budget import StopReason
from alloc.allocators.contract.improvement import TracePoint
from alloc.allocators.contract.parameters import labelled_method, plain_values
from alloc.allocators.contract.status import Status
from alloc.allocators.contract.tolerance import EXACT, PROVEN, MakespanTolerance, relative_gap
from alloc.allocators.plan.table import AgentRow, agent_rows
from alloc.allocators.replanning.moves import Moves
from alloc.allocators.result_document import moves_document, result_fields
from alloc.allocators.summary import summary
from alloc.problems import Allocation, Evaluation, InputError, Instance, MissingPackageError, Objective
from alloc.problems.diagnosis.unserved import Unserved, why_unserved
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.formats.allocation_file import RESULT_FORMAT, parse_result
from alloc.problems.formats.files import PathLike, named, read_text
from alloc.problems.formats.messages import told

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False)
class Result:
    """The outcome of one run; ``print(result)`` prints a summary.

    Attributes
    ----------
    instance : Instance
    method : str
        Name of the method that ran; with ``auto``, the method that it picked.
    objective : Objective
    seed : int
    allocation : Allocation or None
        None only with the status `no_solution`.
    evaluation : Evaluation or None
        Scores of `allocation`.
    lower_bound, energy_lower_bound : float or None
        Best proven lower bounds on the makespan in hours, and on the energy of any allocation with this makespan or
        within `makespan_limit`. None if a task is unserved; for the energy also if it is not part of the objective, or
        no bound was found.
    status : Status
    makespan_limit : float or None
        Makespan in hours up to which only the energy counted; None without a makespan slack or limit.
    stop_reason : StopReason
    runtime_s : float
        Seconds from the instance in memory to the allocation in memory.
    trace : tuple of TracePoint
        Figures of every improvement, in order.
    notes : tuple of str
        Messages for the user: the choice of ``auto`` and the reason, notes of the method on its run, and the tasks that
        too few agents can reach.
    moves : Moves or None
        How the allocation differs from the plan in force; None without such a plan.
    pins : mapping
        Task id of each pinned agent by agent id, None for idle; bounds and status hold under these pins only.
    tolerance : MakespanTolerance
        The makespan slack and limit that were given.
    parameters : mapping
        Parameters of the method that differ from their defaults, by name.
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
    trace: tuple[TracePoint, ...]
    notes: tuple[str, ...] = ()
    makespan_limit: float | None = None
    tolerance: MakespanTolerance = EXACT
    moves: Moves | None = None
    pins: Mapping[str, str | None] = field(default_factory=dict)
    parameters: Mapping[str, object] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Name of the method with the parameters that were set, such as ``ga[population=200]``."""
        return labelled_method(self.method, self.parameters)

    @property
    def makespan(self) -> float | None:
        """Completion time of the last task in hours; None if a task is unserved."""
        return None if self.evaluation is None else self.evaluation.makespan

    @property
    def unserved(self) -> tuple[Unserved, ...]:
        """The ten most urgent unserved tasks, with the reasons."""
        if self.allocation is None or self.evaluation is None or not self.evaluation.unserved_tasks:
            return ()
        pinned = {self.instance.agent_index[name] for name in self.pins}
        return why_unserved(self.instance, self.allocation, pinned=pinned)

    @property
    def served_makespan(self) -> float | None:
        """Completion time of the last served task in hours; None without an allocation."""
        if self.makespan is not None or self.evaluation is None:
            return self.makespan
        return self.evaluation.served_makespan

    @property
    def unserved_count(self) -> int:
        """Number of unserved tasks; 0 without an allocation."""
        return 0 if self.evaluation is None else len(self.evaluation.unserved_tasks)

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
        """Status, derived from the scores and the bounds alone."""
        if self.evaluation is None:
            return Status.NO_SOLUTION
        if self.evaluation.unserved_tasks:
            return Status.INFEASIBLE
        gap = self.energy_gap if self.moves is None or self.moves.cost is None else self.moves.gap
        cheap = gap is not None and gap <= PROVEN
        proven = self._is_fast_enough and (cheap or self.objective is Objective.MAKESPAN)
        return Status.OPTIMAL if proven else Status.FEASIBLE

    @property
    def _is_fast_enough(self) -> bool:
        """Whether the makespan is proven to be minimal, up to the given slack or limit."""
        if self.makespan is None or self.lower_bound is None:
            return False
        excess = relative_gap(self.makespan, self.tolerance.hours(self.lower_bound))
        return excess <= PROVEN + RELATIVE_TOLERANCE

    def __str__(self) -> str:
        """Return a summary of several lines: status, figures and bottleneck."""
        return summary(self)

    def to_dict(self) -> dict[str, object]:
        """Return the fields of the format `alloc-result/1`, ready for JSON.

        Returns
        -------
        dict
        """
        ids, score = self.instance, self.evaluation
        limit = {} if self.makespan_limit is None else {"makespan_limit": self.makespan_limit}
        units = {name: label for name, label in asdict(ids.units).items() if label}
        return {
            "format": RESULT_FORMAT,
            "method": self.method,
            **({"parameters": plain_values(self.parameters)} if self.parameters else {}),
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
            **self._reasons(),
            "violations": []
            if score is None
            else [
                {"agent": ids.agent_ids[v.agent], "task": ids.task_ids[v.task], "reason": v.reason}
                for v in score.violations
            ],
            **({} if self.moves is None else {"moves": moves_document(self.moves, ids)}),
            **({"pins": dict(self.pins)} if self.pins else {}),
            "runtime_s": self.runtime_s,
            **({"units": units} if units else {}),
            "assignment": {} if self.allocation is None else self.allocation.to_ids(ids),
            "trace": [
                {"time_s": point.time_s, "makespan": point.makespan, "energy": point.energy} for point in self.trace
            ],
        }

    def _reasons(self) -> dict[str, object]:
        """Return the field `unserved_reasons`; an empty dict if all tasks are served."""
        agents, found = self.instance.agent_ids, self.unserved
        fields = [
            {
                "task": self.instance.task_ids[one.task],
                "priority": one.priority,
                "able": one.able,
                "able_agents": [agents[i] for i in one.able_agents],
                "nearest_agent": None if one.nearest is None else agents[one.nearest],
                "reason": one.reason,
            }
            for one in found
        ]
        return {"unserved_reasons": fields} if fields else {}

    @classmethod
    def from_dict(cls, document: Mapping[str, object], instance: Instance) -> "Result":
        """Return the result whose `to_dict` gave `document`.

        The document does not contain notes, the lower bounds in the trace, and the makespan slack.

        Parameters
        ----------
        document : mapping
        instance : Instance
            The instance that was solved.

        Returns
        -------
        Result

        Raises
        ------
        InputError
            If a field is missing or wrong, an id is unknown, or the scores do not match `instance`; its `place` is the
            field.
        """
        fields = result_fields(document, instance)
        result = cls(instance=instance, **fields)
        if result.status != document["status"]:
            raise InputError(f"is {document['status']}, but by its scores and bounds it is {result.status}", "status")
        return result

    def to_frame(self) -> "pandas.DataFrame":
        """Return a table with a row for each agent.

        Returns
        -------
        pandas.DataFrame
            With the columns `agent`, `task` (None for idle agents), `ability`, `arrival` (at the task),
            `completion_time` (of the task), `distance` (including the return flight, if any), `energy`, `battery`,
            `battery_left` and `violation` (why the agent cannot take its task). Unknown figures are NaN. Empty if there
            is no allocation.

        Raises
        ------
        MissingPackageError
            If pandas is not installed.
        """
        try:
            import pandas
        except ImportError as error:
            raise MissingPackageError("to_frame needs pandas; install with: pip install pandas") from error
        columns = [field.name for field in fields(AgentRow)]
        return pandas.DataFrame(map(vars, agent_rows(self)), columns=columns)


def read_result(path: PathLike, instance: Instance) -> Result:
    """Read a result that ``alloc solve --output`` wrote, or the JSON of `Result.to_dict`.

    Parameters
    ----------
    path : str or path
        A JSON file with any suffix, or ``-`` for standard input.
    instance : Instance
        The instance that was solved.

    Returns
    -------
    Result

    Raises
    ------
    InputError
        If the file cannot be read, or as `Result.from_dict` does.
    """
    try:
        return Result.from_dict(parse_result(read_text(path)), instance)
    except InputError as error:
        raise told(error, named(path)) from error.__cause__
