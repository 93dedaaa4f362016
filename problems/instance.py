"""Instances of the task allocation problem: agents with abilities, tasks with workloads, and reachability."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from alloc.problems import eligibility, fields
from alloc.problems.arguments import of_type, real, text
from alloc.problems.changes import add, move, remove
from alloc.problems.distances.bases import Bases, returning
from alloc.problems.distances.build import build_reach
from alloc.problems.distances.geodesic import METRES
from alloc.problems.distances.given import DistanceTable
from alloc.problems.distances.reach import Reach
from alloc.problems.errors import InputError
from alloc.problems.fields import BoolArray, FloatArray, IntArray
from alloc.problems.tables.reading import TableOptions, read_tables
from alloc.problems.units import Units
from alloc.problems.vocabulary import GEOGRAPHIC

__all__ = ["FloatArray", "Instance", "IntArray"]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Instance(fields.ReadOnly):
    """An immutable instance of the task allocation problem, validated on construction.

    Unknown or unlimited values (``null`` in files) are ``inf`` for `battery`, `communication_range` and `speed`,
    NaN rows for positions and -1 for `start_task`; None and NaN, as in columns of pandas, are accepted as such.
    Units are free but must be consistent: with distances in km and times in hours, speeds are in km/h, and abilities
    are work per hour.

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
        Index of the task where an agent starts, -1 for none; gives its position if `agent_position` is unknown.
    battery : array_like, shape (n,), optional
        Energy that an agent can spend, >= 0.
    communication_range : array_like, shape (n,), optional
        Farthest task that an agent can take, in units of distance, >= 0.
    speed : array_like, shape (n,), optional
        Distance per hour, >= 1e-60; ``inf`` means that travel takes no time, which is (4) of the paper.
    allowed_tasks : sequence of (sequence of int, or None), optional
        Indices of the tasks that each agent may do, not a 0/1 matrix; None for all.
    priority : array_like, shape (m,), optional
        Weight of each task in the game and in missions, >= 0; if not all tasks can be served, higher ones go first.
    tau : float
        Base of the reward (3), 0 < tau < 1.
    energy_per_distance : float
        Energy per unit of distance, 0 or from 1e-60 to 1e60 (k of (19)).
    agent_energy_per_distance : array_like, shape (n,), optional
        Energy per unit of distance of each agent; `energy_per_distance` where None or NaN.
    returns : array_like of bool, shape (n,), optional
        Whether the flight back counts for battery, distance and energy; by default, if the agent has a `return_base`.
    return_base : array_like of int, shape (n,), optional
        Index of the base to which the agent returns, -1 for its start.
    skills : sequence of (iterable of str, or None), optional
        Skills of each agent.
    needs : sequence of (iterable of str, or None), optional
        Skills that each task needs; an agent must have all of them.
    metric : {"euclidean", "manhattan", "geographic"}
        Distances as in (1), along the axes, or along the surface of the earth; for the last, positions are longitude
        and latitude in degrees, optionally with altitude in metres, and distances are in km or in `units.distance`.
    distances : DistanceTable or iterable of (str, str, float), optional
        User-given distances, by the ids of agents, tasks and bases; see `DistanceTable.of`.
    bases : Bases, or mapping from str to 2 or 3 numbers or None, optional
        Ids and positions of the bases to which agents return.
    units : Units, optional
        Labels of the units.

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
    agent_energy_per_distance: FloatArray
    returns: BoolArray
    return_base: IntArray
    skills: tuple[eligibility.Names, ...] | None
    needs: tuple[eligibility.Names, ...] | None
    metric: str
    distances: DistanceTable | None
    bases: Bases
    units: Units

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
        agent_energy_per_distance: ArrayLike | None = None,
        returns: ArrayLike | None = None,
        return_base: ArrayLike | None = None,
        skills: Sequence[Iterable[str] | None] | None = None,
        needs: Sequence[Iterable[str] | None] | None = None,
        metric: str = "euclidean",
        distances: DistanceTable | Iterable[tuple[str, str, float]] | None = None,
        bases: Bases | Mapping[str, Sequence[float] | None] | None = None,
        units: Units | None = None,
    ) -> None:
        w, h = fields.vector(ability, "ability"), fields.vector(workload, "workload")
        n, m = len(w), len(h)
        if n == 0 or m == 0:
            raise InputError("an instance needs at least one agent and one task", "tasks" if n else "agents")
        agents, tasks = fields.ids(agent_ids, n, "a", "agent"), fields.ids(task_ids, m, "t", "task")
        places = Bases.fitting(bases)
        values: dict[str, object] = {
            "ability": w,
            "workload": h,
            "name": text(name, "name"),
            "agent_ids": agents,
            "task_ids": tasks,
            "agent_position": fields.positions(agent_position, n, "agent"),
            "task_position": fields.positions(task_position, m, "task"),
            "start_task": fields.references(start_task, "start_task", n, "task", m),
            "battery": fields.limits(battery, "battery", n),
            "communication_range": fields.limits(communication_range, "communication_range", n),
            "speed": fields.limits(speed, "speed", n),
            "allowed_tasks": fields.allowed(allowed_tasks, n, m),
            "priority": np.ones(m) if priority is None else fields.vector(priority, "priority", m),
            "tau": fields.unit_share(tau),
            "energy_per_distance": float(real(energy_per_distance, "energy_per_distance")),
            "agent_energy_per_distance": fields.rates(agent_energy_per_distance, energy_per_distance, n),
            **returning(returns, return_base, n, places),
            "skills": eligibility.name_sets(skills, n, "agent", "skills"),
            "needs": eligibility.name_sets(needs, m, "task", "needs"),
            "metric": fields.metric(metric),
            "distances": None if distances is None else DistanceTable.fitting(distances, agents, tasks, places.ids),
            "bases": places,
            "units": Units() if units is None else of_type(units, Units, "units"),
        }
        self._set(values)

    @classmethod
    def from_tables(
        cls, agents: object, tasks: object, distances: object | None = None, **options: Unpack[TableOptions]
    ) -> "Instance":
        """Build an instance from data frames, dicts of columns or lists of dicts.

        The options are those of `tables.reading.read_tables`, such as `columns`, `units`, `missing` and `bases`.
        """
        return read_tables(agents, tasks, distances, **options).built(cls)

    def _set(self, values: Mapping[str, object]) -> None:
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
        for values, name, owner in ((self.workload, "workload", tasks), (self.priority, "priority", tasks)):
            fields.require(np.isfinite(values) & (values >= 0), values, name, "a finite number >= 0", owner)
        for values, name in ((self.battery, "battery"), (self.communication_range, "range")):
            fields.require(values >= 0, values, name, "a number >= 0, or null", agents)
        fields.require(self.speed > 0, self.speed, "speed", "a number > 0, or null", agents)
        fields.require_magnitude(self.ability, "ability", agents)
        fields.require_magnitude(self.workload, "workload", tasks)
        fields.require_magnitude(self.speed, "speed", agents, most=np.inf)
        if self.energy_per_distance and not fields.LEAST <= self.energy_per_distance <= fields.MOST:
            rule = f"0 or from {fields.LEAST:g} to {fields.MOST:g}"
            raise InputError(f"must be {rule}, got {self.energy_per_distance:g}", "energy_per_distance")
        rate, name = self.agent_energy_per_distance, "energy_per_distance"
        fields.require(np.isfinite(rate) & (rate >= 0), rate, name, "a finite number >= 0", agents)
        fields.require_magnitude(rate, name, agents)
        if self.metric == GEOGRAPHIC:
            fields.require_geographic(self.agent_position, "agent")
            fields.require_geographic(self.task_position, "task")
            fields.require_geographic(self.bases.position, "base")
            if self.units.distance and self.units.distance not in METRES:
                raise InputError(f"must be one of {', '.join(METRES)} with geographic positions", "units.distance")

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
        """Start of each agent, shape (n, 3): its position, or else that of its start task, or else NaN."""
        place = self.agent_position.copy()
        unknown = np.isnan(place[:, 0]) & (self.start_task >= 0)
        place[unknown] = self.task_position[self.start_task[unknown]]
        place.setflags(write=False)
        return place

    @property
    def has_travel_time(self) -> bool:
        """Whether any agent has a finite speed, so that completion times include travel, unlike (4)."""
        return bool(np.isfinite(self.speed).any())

    @cached_property
    def reach(self) -> Reach:
        """Tasks that each agent can take, and their distances (C(i) and (1) of the paper)."""
        return build_reach(self)

    @cached_property
    def eligible_tasks(self) -> Sequence[IntArray | None] | None:
        """Tasks that each agent may do by its list and its skills; None for all."""
        return eligibility.eligible_tasks(self.allowed_tasks, self.skills, self.needs, self.n)

    @property
    def distance_unit(self) -> str:
        """Unit of geographic distances."""
        return self.units.distance or "km"

    @cached_property
    def agent_index(self) -> dict[str, int]:
        """Index of each agent id."""
        return {name: index for index, name in enumerate(self.agent_ids)}

    @cached_property
    def task_index(self) -> dict[str, int]:
        """Index of each task id."""
        return {name: index for index, name in enumerate(self.task_ids)}

    def restricted(self, agents: IntArray, tasks: IntArray) -> "Instance":
        """Return the subproblem of the given agents and tasks, by their indices."""
        return remove.restricted(self, agents, tasks)

    def without_agents(self, gone: Iterable[str]) -> "Instance":
        """Return the instance without these agents, as after failures; see `remove.without_agents`."""
        return remove.without_agents(self, gone)

    def without_tasks(self, gone: Iterable[str]) -> "Instance":
        """Return the instance without these tasks; see `remove.without_tasks`."""
        return remove.without_tasks(self, gone)

    def with_agents(self, added: Iterable[Mapping[str, object]]) -> "Instance":
        """Return the instance with agents appended; see `add.with_agents`."""
        return add.with_agents(self, added)

    def with_tasks(self, added: Iterable[Mapping[str, object]]) -> "Instance":
        """Return the instance with tasks appended; see `add.with_tasks`."""
        return add.with_tasks(self, added)

    def moved_to(self, places: Mapping[str, str | Sequence[float]]) -> "Instance":
        """Return the instance with agents at new places; see `move.moved_to`."""
        return move.moved_to(self, places)
