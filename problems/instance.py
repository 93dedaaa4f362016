"""What is to be solved: agents with abilities, tasks with workloads, and who can reach what."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from alloc.problems.errors import InputError
from alloc.problems.reach import Reach, build_reach

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

IDLE = -1
"""The task index of an agent without a task."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Instance:
    """A task allocation problem, validated once and read-only from then on.

    Unknown or unlimited values (``null`` in files) are ``inf`` for `battery`, `communication_range` and `speed`,
    NaN rows for positions and -1 for `start_task`. Units are the user's own, but must agree: with distances in km and
    times in hours, speeds are km/h, and an ability is work per hour.

    Parameters
    ----------
    ability : array_like, shape (n,)
        Work per hour of each agent, > 0 (w_i of the paper).
    workload : array_like, shape (m,)
        Work that each task needs, >= 0 (h_j).
    name : str
        Name of the instance.
    agent_ids, task_ids : sequence of str, optional
        Unique names; a1, a2, ... and t1, t2, ... by default.
    agent_position, task_position : array_like, shape (n, 2), (n, 3), (m, 2) or (m, 3), optional
        Cartesian coordinates in units of distance; NaN rows where unknown.
    start_task : array_like of int, shape (n,), optional
        Index of the task where an agent begins, -1 for none; gives its position where `agent_position` is unknown.
    battery : array_like, shape (n,), optional
        Energy that an agent has, >= 0.
    communication_range : array_like, shape (n,), optional
        Farthest task that an agent can take, in units of distance, >= 0.
    speed : array_like, shape (n,), optional
        Distance per hour, > 0; ``inf`` means that travel takes no time, which is (4) of the paper.
    allowed_tasks : sequence of (sequence of int, or None), optional
        Task indices that each agent may do; None for all.
    priority : array_like, shape (m,), optional
        Weight of each task in the game and in missions, >= 0; no part of the objective.
    tau : float
        Base of the reward (3), 0 < tau < 1.
    energy_per_distance : float
        Energy per unit of distance, >= 0 (k of (19)).

    Raises
    ------
    InputError
        If a value breaks one of the rules above.

    References
    ----------
    Fang et al. (2025), equations (1)-(5) and (19), doi:10.20944/preprints202502.0192.v1.
    """

    name: str
    agent_ids: tuple[str, ...]
    task_ids: tuple[str, ...]
    ability: FloatArray
    agent_position: FloatArray
    start_task: IntArray
    battery: FloatArray
    communication_range: FloatArray
    speed: FloatArray
    allowed_tasks: tuple[IntArray | None, ...] | None
    workload: FloatArray
    task_position: FloatArray
    priority: FloatArray
    tau: float
    energy_per_distance: float

    def __init__(
        self,
        *,
        ability: ArrayLike,
        workload: ArrayLike,
        name: str = "instance",
        agent_ids: Iterable[str] | None = None,
        task_ids: Iterable[str] | None = None,
        agent_position: ArrayLike | None = None,
        task_position: ArrayLike | None = None,
        start_task: ArrayLike | None = None,
        battery: ArrayLike | None = None,
        communication_range: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        allowed_tasks: Sequence[Iterable[int] | None] | None = None,
        priority: ArrayLike | None = None,
        tau: float = 0.5,
        energy_per_distance: float = 1.0,
    ) -> None:
        w, h = _vector(ability, "ability"), _vector(workload, "workload")
        n, m = len(w), len(h)
        if n == 0 or m == 0:
            raise InputError("an instance needs at least one agent and one task", "tasks" if n else "agents")
        infinite = np.full(n, np.inf)
        values: dict[str, Any] = {
            "ability": w,
            "workload": h,
            "name": str(name),
            "agent_ids": _ids(agent_ids, n, "a", "agent"),
            "task_ids": _ids(task_ids, m, "t", "task"),
            "agent_position": _positions(agent_position, n, "agent"),
            "task_position": _positions(task_position, m, "task"),
            "start_task": _starts(start_task, n, m),
            "battery": infinite if battery is None else _vector(battery, "battery", n),
            "communication_range": infinite
            if communication_range is None
            else _vector(communication_range, "range", n),
            "speed": infinite if speed is None else _vector(speed, "speed", n),
            "allowed_tasks": _allowed(allowed_tasks, n, m),
            "priority": np.ones(m) if priority is None else _vector(priority, "priority", m),
            "tau": float(tau),
            "energy_per_distance": float(energy_per_distance),
        }
        for key, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, key, value)
        self._check()

    def _check(self) -> None:
        agents, tasks = ("agent", self.agent_ids), ("task", self.task_ids)
        _require(np.isfinite(self.ability) & (self.ability > 0), self.ability, "ability", "a finite number > 0", agents)
        _require(
            np.isfinite(self.workload) & (self.workload >= 0), self.workload, "workload", "a finite number >= 0", tasks
        )
        _require(
            np.isfinite(self.priority) & (self.priority >= 0), self.priority, "priority", "a finite number >= 0", tasks
        )
        _require(self.battery >= 0, self.battery, "battery", "a number >= 0, or null", agents)
        _require(self.communication_range >= 0, self.communication_range, "range", "a number >= 0, or null", agents)
        _require(self.speed > 0, self.speed, "speed", "a number > 0, or null", agents)
        if not 0 < self.tau < 1:
            raise InputError(f"must lie strictly between 0 and 1, got {self.tau:g}", "tau")
        if not (np.isfinite(self.energy_per_distance) and self.energy_per_distance >= 0):
            raise InputError(f"must be a finite number >= 0, got {self.energy_per_distance:g}", "energy_per_distance")
        with np.errstate(over="ignore"):
            if not (np.isfinite(self.ability.sum()) and np.isfinite(self.workload.sum())):
                raise InputError("the sum of all abilities and of all workloads must be finite; use smaller units")

    def __repr__(self) -> str:
        return f"Instance(name={self.name!r}, n={self.n}, m={self.m})"

    @property
    def n(self) -> int:
        """Number of agents."""
        return len(self.ability)

    @property
    def m(self) -> int:
        """Number of tasks."""
        return len(self.workload)

    @cached_property
    def start_position(self) -> FloatArray:
        """Where each agent begins, shape (n, 3): its position, else that of its start task, else NaN."""
        place = self.agent_position.copy()
        unknown = np.isnan(place[:, 0]) & (self.start_task != IDLE)
        place[unknown] = self.task_position[self.start_task[unknown]]
        place.setflags(write=False)
        return place

    @property
    def has_travel_time(self) -> bool:
        """Whether some agent needs time to reach some task, so that (4) alone does not give completion times."""
        return bool(np.isfinite(self.speed).any())

    @cached_property
    def reach(self) -> Reach:
        """Which tasks each agent can take, and how far they are (C(i) and (1) of the paper)."""
        return build_reach(self)

    @cached_property
    def agent_index(self) -> dict[str, int]:
        """Index of each agent id."""
        return {name: index for index, name in enumerate(self.agent_ids)}

    @cached_property
    def task_index(self) -> dict[str, int]:
        """Index of each task id."""
        return {name: index for index, name in enumerate(self.task_ids)}


def _vector(values: ArrayLike, field_name: str, length: int | None = None) -> FloatArray:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError("must be a list of numbers", field_name) from error
    if array.ndim != 1 or (length is not None and len(array) != length):
        expected = "a list" if length is None else f"a list of {length} numbers"
        raise InputError(f"must be {expected}, got shape {array.shape}", field_name)
    return array


def _ids(names: Iterable[str] | None, count: int, prefix: str, kind: str) -> tuple[str, ...]:
    if names is None:
        return tuple(f"{prefix}{index}" for index in range(1, count + 1))
    ids = tuple(names)
    if len(ids) != count:
        raise InputError(f"needs {count} ids, got {len(ids)}", f"{kind}_ids")
    seen: set[str] = set()
    for index, name in enumerate(ids):
        if not isinstance(name, str) or not name:
            raise InputError(f"must be a non-empty string, got {name!r}", f"{kind}s[{index}].id")
        if name in seen:
            raise InputError(f"the id {name!r} is used twice; ids must be unique", f"{kind}s[{index}].id")
        seen.add(name)
    return ids


def _positions(values: ArrayLike | None, count: int, kind: str) -> FloatArray:
    if values is None:
        return np.full((count, 3), np.nan)
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError("must hold 2 or 3 numbers per row", f"{kind}_position") from error
    if array.ndim != 2 or array.shape[0] != count or array.shape[1] not in (2, 3):
        raise InputError(f"must have shape ({count}, 2) or ({count}, 3), got {array.shape}", f"{kind}_position")
    if array.shape[1] == 2:
        array = np.column_stack([array, np.where(np.isnan(array[:, 0]), np.nan, 0.0)])
    blank = np.isnan(array).all(axis=1)
    wrong = ~blank & ~np.isfinite(array).all(axis=1)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(f"must be finite numbers, got {array[row].tolist()}", f"{kind}s[{row}].position")
    return array


def _starts(values: ArrayLike | None, n: int, m: int) -> IntArray:
    if values is None:
        return np.full(n, IDLE, dtype=np.intp)
    array = np.array(values)
    if array.shape != (n,) or not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"must be a list of {n} task indices, -1 for none", "start_task")
    wrong = (array < IDLE) | (array >= m)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(f"is {array[row]}, but tasks run from 0 to {m - 1}", f"agents[{row}].start_task")
    return array.astype(np.intp)


def _allowed(lists: Sequence[Iterable[int] | None] | None, n: int, m: int) -> tuple[IntArray | None, ...] | None:
    if lists is None or all(entry is None for entry in lists):
        return None
    if len(lists) != n:
        raise InputError(f"needs {n} entries, got {len(lists)}", "allowed_tasks")
    result: list[IntArray | None] = []
    for row, entry in enumerate(lists):
        if entry is None:
            result.append(None)
            continue
        indices = np.unique(np.array(list(entry), dtype=np.intp))
        if len(indices) and (indices[0] < 0 or indices[-1] >= m):
            raise InputError(f"names a task outside 0 to {m - 1}", f"agents[{row}].tasks")
        indices.setflags(write=False)
        result.append(indices)
    return tuple(result)


def _require(
    good: NDArray[np.bool_], values: FloatArray, field_name: str, rule: str, owner: tuple[str, tuple[str, ...]]
) -> None:
    if not good.all():
        row = int(np.argmin(good))
        kind, ids = owner
        raise InputError(f"must be {rule}, got {values[row]:g} ({kind} {ids[row]!r})", f"{kind}s[{row}].{field_name}")
