"""What is to be solved: agents with abilities, tasks with workloads, and who can reach what."""

from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from alloc.problems import fields
from alloc.problems.arguments import listed, real, shown, text
from alloc.problems.distances.reach import Reach, build_reach
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import FloatArray, IntArray
from alloc.problems.vocabulary import IDLE

__all__ = ["FloatArray", "Instance", "IntArray"]

AGENT_ARRAYS = ("ability", "agent_position", "start_task", "battery", "communication_range", "speed")
"""Fields of an instance with one row per agent; ids and allowed tasks are tuples."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Instance(fields.ReadOnly):
    """A task allocation problem, validated once and read-only from then on.

    Unknown or unlimited values (``null`` in files) are ``inf`` for `battery`, `communication_range` and `speed`,
    NaN rows for positions and -1 for `start_task`; None and NaN, as in columns of pandas, are taken for them.
    Units are the user's own, but must agree: with distances in km and times in hours, speeds are km/h, and an ability
    is work per hour.

    Parameters
    ----------
    ability : array_like, shape (n,)
        Work per hour of each agent, > 0, from 1e-60 to 1e60 (w_i of the paper).
    workload : array_like, shape (m,)
        Work that each task needs, 0 or from 1e-60 to 1e60 (h_j).
    name : str
        Name of the instance.
    agent_ids, task_ids : sequence of str, optional
        Unique names; a1, a2, ... and t1, t2, ... by default.
    agent_position, task_position : array_like, shape (n, 2), (n, 3), (m, 2) or (m, 3), optional
        Cartesian coordinates in units of distance, from -1e60 to 1e60; NaN rows where unknown.
    start_task : array_like of int, shape (n,), optional
        Index of the task where an agent begins, -1 for none; gives its position where `agent_position` is unknown.
    battery : array_like, shape (n,), optional
        Energy that an agent has, >= 0.
    communication_range : array_like, shape (n,), optional
        Farthest task that an agent can take, in units of distance, >= 0.
    speed : array_like, shape (n,), optional
        Distance per hour, >= 1e-60; ``inf`` means that travel takes no time, which is (4) of the paper.
    allowed_tasks : sequence of (sequence of int, or None), optional
        Task indices that each agent may do; None for all. No matrix of who may do what.
    priority : array_like, shape (m,), optional
        Weight of each task in the game and in missions, >= 0; no part of the objective.
    tau : float
        Base of the reward (3), 0 < tau < 1.
    energy_per_distance : float
        Energy per unit of distance, 0 or from 1e-60 to 1e60 (k of (19)).

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
        w, h = fields.vector(ability, "ability"), fields.vector(workload, "workload")
        n, m = len(w), len(h)
        if n == 0 or m == 0:
            raise InputError("an instance needs at least one agent and one task", "tasks" if n else "agents")
        values: dict[str, object] = {
            "ability": w,
            "workload": h,
            "name": text(name, "name"),
            "agent_ids": fields.ids(agent_ids, n, "a", "agent"),
            "task_ids": fields.ids(task_ids, m, "t", "task"),
            "agent_position": fields.positions(agent_position, n, "agent"),
            "task_position": fields.positions(task_position, m, "task"),
            "start_task": fields.starts(start_task, n, m),
            "battery": fields.limits(battery, "battery", n),
            "communication_range": fields.limits(communication_range, "communication_range", n),
            "speed": fields.limits(speed, "speed", n),
            "allowed_tasks": fields.allowed(allowed_tasks, n, m),
            "priority": np.ones(m) if priority is None else fields.vector(priority, "priority", m),
            "tau": _unit_share(tau),
            "energy_per_distance": float(real(energy_per_distance, "energy_per_distance")),
        }
        for key, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, key, value)
        self._check()

    def _check(self) -> None:
        agents, tasks = ("agent", self.agent_ids), ("task", self.task_ids)
        fields.require(
            np.isfinite(self.ability) & (self.ability > 0), self.ability, "ability", "a finite number > 0", agents
        )
        fields.require(
            np.isfinite(self.workload) & (self.workload >= 0), self.workload, "workload", "a finite number >= 0", tasks
        )
        fields.require(
            np.isfinite(self.priority) & (self.priority >= 0), self.priority, "priority", "a finite number >= 0", tasks
        )
        fields.require(self.battery >= 0, self.battery, "battery", "a number >= 0, or null", agents)
        fields.require(
            self.communication_range >= 0, self.communication_range, "range", "a number >= 0, or null", agents
        )
        fields.require(self.speed > 0, self.speed, "speed", "a number > 0, or null", agents)
        fields.require_magnitude(self.ability, "ability", agents)
        fields.require_magnitude(self.workload, "workload", tasks)
        fields.require_magnitude(self.speed, "speed", agents, most=np.inf)
        if self.energy_per_distance and not fields.LEAST <= self.energy_per_distance <= fields.MOST:
            rule = f"0 or from {fields.LEAST:g} to {fields.MOST:g}"
            raise InputError(f"must be {rule}, got {self.energy_per_distance:g}", "energy_per_distance")

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
        return build_reach(
            self.start_position,
            self.task_position,
            self.communication_range,
            self.battery,
            self.energy_per_distance,
            self.allowed_tasks,
        )

    @cached_property
    def agent_index(self) -> dict[str, int]:
        """Index of each agent id."""
        return {name: index for index, name in enumerate(self.agent_ids)}

    @cached_property
    def task_index(self) -> dict[str, int]:
        """Index of each task id."""
        return {name: index for index, name in enumerate(self.task_ids)}

    def without_agents(self, gone: Iterable[str]) -> "Instance":
        """Return the same problem without these agents, as when they drop out.

        Parameters
        ----------
        gone : iterable of str
            Their ids.

        Raises
        ------
        InputError
            If an id is unknown, or no agent is left.
        """
        ids = gone if isinstance(gone, Set) else listed(gone, "gone", "ids of agents")
        for name in ids:
            if not isinstance(name, str):
                raise InputError(f"must be ids of agents, got {shown(name)}", "gone")
            if name not in self.agent_index:
                raise InputError(f"no agent {name!r} in instance {self.name!r}{nearest(name, self.agent_ids)}", "gone")
        dropped = set(ids)
        left = [index for index, name in enumerate(self.agent_ids) if name not in dropped]
        lists = self.allowed_tasks
        return replace(
            self,
            agent_ids=tuple(self.agent_ids[index] for index in left),
            allowed_tasks=None if lists is None else tuple(lists[index] for index in left),
            **{name: getattr(self, name)[left] for name in AGENT_ARRAYS},
        )


def _unit_share(tau: float) -> float:
    if isinstance(tau, Real) and not isinstance(tau, bool) and 0 < tau < 1:
        return float(tau)
    raise InputError(f"must lie strictly between 0 and 1, got {shown(tau)}", "tau")
