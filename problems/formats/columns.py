"""Columnar intermediate representation of instances in files, with task ids, and NaN or None for null."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from alloc.problems.distances.bases import Bases
from alloc.problems.distances.given import DistanceTable
from alloc.problems.errors import InputError, nearest
from alloc.problems.formats.messages import described, quoted
from alloc.problems.instance import FloatArray, Instance, IntArray
from alloc.problems.units import Units, speed_factor
from alloc.problems.vocabulary import EUCLIDEAN, IDLE

INSTANCE_FORMAT = "alloc-instance/1"

AGENT_FIELDS = (
    "id",
    "ability",
    "position",
    "start_task",
    "battery",
    "range",
    "speed",
    "tasks",
    "energy_per_distance",
    "returns",
    "skills",
)
BASE_FIELDS = ("id", "position")
TASK_FIELDS = ("id", "workload", "position", "priority", "needs")
UNIT_FIELDS = ("time", "distance", "energy", "work", "speed")
DISTANCE_FIELDS = ("missing", "rows")

DEFAULT_NAME = "instance"
DEFAULT_TAU = 0.5
DEFAULT_ENERGY_PER_DISTANCE = 1.0
DEFAULT_MISSING = "metric"


@dataclass(frozen=True, kw_only=True)
class DistanceColumns:
    """A table of distances.

    Attributes
    ----------
    source, target : sequence of str, length k
        Ids of agents, tasks and bases.
    distance : ndarray, shape (k,)
    missing : str
        Treatment of other pairs.
    """

    source: Sequence[str]
    target: Sequence[str]
    distance: FloatArray
    missing: str = DEFAULT_MISSING


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Data collected by a reader; `build` checks references and makes the instance.

    Attributes
    ----------
    agent_ids, task_ids : sequence of str
    ability, battery, communication_range, speed : ndarray, shape (n,)
    workload, priority : ndarray, shape (m,)
        NaN for null.
    agent_position, task_position : ndarray, shape (n, 3) and (m, 3), or None
        NaN rows for null; two columns are 2-D positions.
    start_task : sequence of (str or None), or None
        Id of the start task of each agent.
    tasks : sequence of (sequence of str, or None), or None
        Task ids that each agent may do.
    metric : str
    units : Units
    speed_unit : str
        Unit of `speed`, if it differs from `units`.
    agent_energy_per_distance : ndarray, shape (n,), or None
    returns : sequence of (bool or str), or None
        The id of a base, or whether the agent returns to its start.
    skills, needs : sequence of (sequence of str, or None), or None
    distances : DistanceColumns or None
    base_ids : sequence of str
    base_position : ndarray, shape (bases, 3), or None
    """

    agent_ids: Sequence[str]
    task_ids: Sequence[str]
    ability: FloatArray
    workload: FloatArray
    name: str
    tau: float = DEFAULT_TAU
    energy_per_distance: float = DEFAULT_ENERGY_PER_DISTANCE
    agent_position: FloatArray | None = None
    task_position: FloatArray | None = None
    start_task: Sequence[str | None] | None = None
    battery: FloatArray | None = None
    communication_range: FloatArray | None = None
    speed: FloatArray | None = None
    tasks: Sequence[Sequence[str] | None] | None = None
    priority: FloatArray | None = None
    metric: str = EUCLIDEAN
    units: Units = field(default_factory=Units)
    speed_unit: str = ""
    agent_energy_per_distance: FloatArray | None = None
    returns: Sequence[bool | str] | None = None
    skills: Sequence[Sequence[str] | None] | None = None
    needs: Sequence[Sequence[str] | None] | None = None
    distances: DistanceColumns | None = None
    base_ids: Sequence[str] = ()
    base_position: FloatArray | None = None

    def build(self) -> Instance:
        """Return the instance.

        Raises
        ------
        InputError
            If a value or reference is invalid; `place` is in terms of the JSON format.
        """
        check_names(self)
        _require_all(self.ability, "agents[{}].ability", "> 0")
        _require_all(self.workload, "tasks[{}].workload", ">= 0")
        index = {name: number for number, name in enumerate(self.task_ids)}
        return Instance(
            name=self.name,
            agent_ids=self.agent_ids,
            task_ids=self.task_ids,
            ability=self.ability,
            workload=self.workload,
            agent_position=self.agent_position,
            task_position=self.task_position,
            start_task=_starts(self.start_task, index),
            battery=_unlimited(self.battery, "battery"),
            communication_range=_unlimited(self.communication_range, "range"),
            speed=self._converted_speed(),
            allowed_tasks=_allowed(self.tasks, index),
            priority=None if self.priority is None else np.where(np.isnan(self.priority), 1.0, self.priority),
            tau=self.tau,
            energy_per_distance=self.energy_per_distance,
            agent_energy_per_distance=self.agent_energy_per_distance,
            returns=None if self.returns is None else [given is not False for given in self.returns],
            return_base=_return_bases(self.returns, self.base_ids),
            skills=self.skills,
            needs=self.needs,
            metric=self.metric,
            distances=self._distance_table(),
            bases=Bases.of(self.base_ids, self.base_position),
            units=self.units,
        )

    def _converted_speed(self) -> FloatArray | None:
        """Return speeds as distance per time in the instance's units."""
        factor = speed_factor(self.speed_unit, self.units) if self.speed_unit else 1.0
        speed = _unlimited(self.speed, "speed")
        return speed if speed is None or factor == 1 else speed * factor

    def _distance_table(self) -> DistanceTable | None:
        given = self.distances
        if given is None:
            return None
        return DistanceTable.from_columns(
            given.source,
            given.target,
            given.distance,
            self.agent_ids,
            self.task_ids,
            missing=given.missing,
            base_ids=self.base_ids,
        )


def check_names(named: "Columns | Instance", name_field: str = "name") -> None:
    """Raise `InputError` if the name or an id contains NUL or a lone surrogate, which not all formats can store."""
    _check_texts([named.name], name_field)
    _check_texts(named.agent_ids, "agents[{}].id")
    _check_texts(named.task_ids, "tasks[{}].id")
    _check_texts(named.base_ids if isinstance(named, Columns) else named.bases.ids, "bases[{}].id")
    for lists, place in ((named.skills, "agents[{}].skills"), (named.needs, "tasks[{}].needs")):
        if lists is not None:
            _check_texts(["".join(names or ()) for names in lists], place)


def _check_texts(texts: Sequence[str], place: str) -> None:
    if _is_plain("".join(texts)):
        return
    row = next(row for row, text in enumerate(texts) if not _is_plain(text))
    raise InputError(f"must be valid Unicode without NUL characters, got {quoted(texts[row])}", place.format(row))


def require_format(found: object, expected: Sequence[str] = (INSTANCE_FORMAT,)) -> None:
    """Raise `InputError` unless `found` is one of the format names in `expected`."""
    if found is None:
        raise InputError(f'is missing; add "format": "{expected[0]}"', "format")
    if found not in expected:
        hint = "; `alloc simulate` and `alloc compare --policies` take missions" if found == "alloc-mission/1" else ""
        raise InputError(f"must be {' or '.join(map(repr, expected))}, got {described(found)}{hint}", "format")


def unknown_field(name: str, known: Sequence[str], kind: str = "field") -> str:
    """Return the error message for an unknown field."""
    return f"unknown {kind} {quoted(name)}{nearest(name, known)}"


def plain_numbers(values: FloatArray) -> list[float | int | None]:
    """Return numbers as written to text: integers without a fraction, None for NaN and inf."""
    numbers: list[float | int | None] = values.tolist()
    whole = (values == np.floor(values)) & (np.abs(values) < 2**53) & ~((values == 0) & np.signbit(values))
    for row in np.flatnonzero(whole | ~np.isfinite(values)).tolist():
        numbers[row] = int(values[row]) if whole[row] else None
    return numbers


def _is_plain(text: str) -> bool:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return "\0" not in text


def _require_all(values: FloatArray, place: str, rule: str) -> None:
    missing = np.isnan(values)
    if missing.any():
        raise InputError(f"is missing; it must be a number {rule}", place.format(int(np.argmax(missing))))


def _unlimited(values: FloatArray | None, field: str) -> FloatArray | None:
    """Replace null by ``inf``, which means no limit in an instance."""
    if values is None:
        return None
    wrong = np.isinf(values)
    if wrong.any():
        row = int(np.argmax(wrong))
        message = f"must be a finite number, or null for no limit, got {described(float(values[row]))}"
        raise InputError(message, f"agents[{row}].{field}")
    return np.where(np.isnan(values), np.inf, values)


def _starts(names: Sequence[str | None] | None, index: dict[str, int]) -> IntArray | None:
    if names is None:
        return None
    starts = [IDLE if name is None else index.get(name, IDLE - 1) for name in names]
    if IDLE - 1 in starts:
        row = starts.index(IDLE - 1)
        raise _unknown_task(str(names[row]), index, f"agents[{row}].start_task")
    return np.array(starts, dtype=np.intp)


def _return_bases(returns: Sequence[bool | str] | None, ids: Sequence[str]) -> list[int] | None:
    """Return the index of the base to which each agent returns, -1 for none."""
    if returns is None or not any(isinstance(given, str) for given in returns):
        return None
    index = {name: number for number, name in enumerate(ids)}
    for row, given in enumerate(returns):
        if isinstance(given, str) and given not in index:
            known = nearest(given, ids) if ids else ""
            mend = f"{known}; say true, false or the id of one of the 'bases'"
            raise InputError(f"there is no base {quoted(given)}{mend}", f"agents[{row}].returns")
    return [index[given] if isinstance(given, str) else IDLE for given in returns]


def _allowed(lists: Sequence[Sequence[str] | None] | None, index: dict[str, int]) -> list[list[int] | None] | None:
    if lists is None:
        return None
    allowed: list[list[int] | None] = []
    for row, names in enumerate(lists):
        try:
            tasks = None if names is None else [index[name] for name in names]
            # remove duplicates, as a list with repetitions could be mistaken for a row of a matrix
            allowed.append(sorted(set(tasks)) if tasks is not None and len(tasks) == len(index) else tasks)
        except KeyError as error:
            raise _unknown_task(error.args[0], index, f"agents[{row}].tasks") from error
    return allowed


def _unknown_task(name: str, index: dict[str, int], place: str) -> InputError:
    return InputError(f"there is no task {quoted(name)}{nearest(name, tuple(index))}", place)
