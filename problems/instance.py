"""What is to be solved: agents with abilities, tasks with workloads, and who can reach what."""

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from alloc.problems import eligibility, fields
from alloc.problems.arguments import listed, of_type, real, shown, text
from alloc.problems.distances.build import build_reach, restricted_reach
from alloc.problems.distances.geodesic import METRES
from alloc.problems.distances.given import DistanceTable
from alloc.problems.distances.metric import GEOGRAPHIC, METRICS
from alloc.problems.distances.reach import Reach
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import BoolArray, FloatArray, IntArray
from alloc.problems.tables.reading import read_tables
from alloc.problems.units import Units
from alloc.problems.vocabulary import IDLE

__all__ = ["FloatArray", "Instance", "IntArray"]

AGENT_ARRAYS = (
    "ability",
    "agent_position",
    "start_task",
    "battery",
    "communication_range",
    "speed",
    "agent_energy_per_distance",
    "returns",
)
"""Fields of an instance with one row per agent; ids, allowed tasks and skills are tuples."""


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
    agent_energy_per_distance : array_like, shape (n,), optional
        That of each agent; `energy_per_distance` where it is None or NaN.
    returns : array_like of bool, shape (n,), optional
        Whether the agent's flight back to its start counts for battery, distance and energy.
    skills : sequence of (iterable of str, or None), optional
        What each agent can do.
    needs : sequence of (iterable of str, or None), optional
        Skills that an agent must have, all of them, to do each task.
    metric : {"euclidean", "manhattan", "geographic"}
        Distances as in (1), along the axes, or along the surface of the earth; with the last, positions are longitude
        and latitude in degrees and, if given, altitude in metres, and distances are in km or in `units.distance`.
    distances : DistanceTable or iterable of (str, str, float), optional
        Distances of one's own, by the ids of agents and tasks; see `DistanceTable.of`.
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
    skills: tuple[eligibility.Names, ...] | None
    needs: tuple[eligibility.Names, ...] | None
    metric: str
    distances: DistanceTable | None
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
        skills: Sequence[Iterable[str] | None] | None = None,
        needs: Sequence[Iterable[str] | None] | None = None,
        metric: str = "euclidean",
        distances: DistanceTable | Iterable[tuple[str, str, float]] | None = None,
        units: Units | None = None,
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
            "agent_energy_per_distance": fields.rates(agent_energy_per_distance, energy_per_distance, n),
            "returns": fields.flags(returns, "returns", n),
            "skills": eligibility.name_sets(skills, n, "agent", "skills"),
            "needs": eligibility.name_sets(needs, m, "task", "needs"),
            "metric": _metric(metric),
            "units": Units() if units is None else of_type(units, Units, "units"),
        }
        values["distances"] = _table(distances, values["agent_ids"], values["task_ids"])
        for key, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, key, value)
        self._check()

    @classmethod
    def from_tables(
        cls,
        agents: object,
        tasks: object,
        distances: object | None = None,
        *,
        columns: Mapping[str, str] | None = None,
        units: Units | None = None,
        decimal: str | None = None,
        missing: str | None = None,
        name: str = "instance",
        report: Callable[[str], object] | None = None,
    ) -> "Instance":
        """Return the instance that tables as people keep them describe, by the names of their columns.

        Parameters
        ----------
        agents, tasks : DataFrame, dict of columns, list of dicts, or what `read_grid` gives
        distances : the same, optional
            With columns from, to and distance, or as a matrix.
        columns : dict of str to str, optional
            The column of a field where it cannot be guessed, or a number for all rows, such as ``{"ability": "1"}``;
            ``agents.id`` and ``tasks.id`` where both tables have it.
        units : Units, optional
            Those that the headers do not give.
        decimal : {"point", "comma"}, optional
            The decimal mark, where the numbers do not show it.
        missing : {"metric", "unreachable"}, optional
            What holds for pairs without a distance.
        name : str
        report : function, optional
            Called with a line for each column, on what it was taken for, and for each row that was left out; they are
            logged where it is None.

        Returns
        -------
        Instance

        Raises
        ------
        InputError
            If a table can be read in two ways or in none, in one line with the place and the mend.
        """
        reading = read_tables(agents, tasks, distances, columns=columns, units=units, decimal=decimal, missing=missing)
        tell = logging.getLogger("alloc").info if report is None else report
        for line in reading.lines:
            tell(line)
        try:
            return cls(name=name, **reading.arguments)
        except InputError as error:
            raise reading.located(error) from error

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
        fields.require(
            np.isfinite(self.agent_energy_per_distance) & (self.agent_energy_per_distance >= 0),
            self.agent_energy_per_distance,
            "energy_per_distance",
            "a finite number >= 0",
            agents,
        )
        fields.require_magnitude(self.agent_energy_per_distance, "energy_per_distance", agents)
        if self.metric == GEOGRAPHIC:
            fields.require_geographic(self.agent_position, "agent")
            fields.require_geographic(self.task_position, "task")
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
    def eligible_tasks(self) -> Sequence[IntArray | None] | None:
        """Tasks that each agent may do by its list and its skills, None for all."""
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
        """Return the problem of some agents and tasks alone, in this order; agents stay where they begin.

        Parameters
        ----------
        agents, tasks : ndarray of int
            Indices, none twice.
        """
        number = np.full(self.m + 1, IDLE, dtype=np.intp)
        number[tasks] = np.arange(len(tasks))
        arrays = {name: getattr(self, name)[agents] for name in AGENT_ARRAYS}
        arrays |= {"agent_position": self.start_position[agents], "start_task": number[self.start_task[agents]]}
        lists, table = self.allowed_tasks, self.distances
        part = replace(
            self,
            agent_ids=tuple(self.agent_ids[i] for i in agents.tolist()),
            task_ids=tuple(self.task_ids[j] for j in tasks.tolist()),
            workload=self.workload[tasks],
            task_position=self.task_position[tasks],
            priority=self.priority[tasks],
            allowed_tasks=None if lists is None else tuple(_renamed(lists[i], number) for i in agents.tolist()),
            skills=None if self.skills is None else tuple(self.skills[i] for i in agents.tolist()),
            needs=None if self.needs is None else tuple(self.needs[j] for j in tasks.tolist()),
            distances=None if table is None else table.restricted(agents, tasks),
            **arrays,
        )
        part.__dict__["reach"] = restricted_reach(
            self.reach, agents, tasks
        )  # what a start outside the part gives, stays
        return part

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
        left = np.array([index for index, name in enumerate(self.agent_ids) if name not in dropped], dtype=np.intp)
        lists, skills, table = self.allowed_tasks, self.skills, self.distances
        return replace(
            self,
            agent_ids=tuple(self.agent_ids[index] for index in left),
            allowed_tasks=None if lists is None else tuple(lists[index] for index in left),
            skills=None if skills is None else tuple(skills[index] for index in left),
            distances=None if table is None else table.restricted(left, np.arange(self.m)),
            **{name: getattr(self, name)[left] for name in AGENT_ARRAYS},
        )


def _renamed(tasks: IntArray | None, number: IntArray) -> IntArray | None:
    return None if tasks is None else number[tasks][number[tasks] != IDLE]


def _metric(name: object) -> str:
    if name in METRICS:
        return str(name)
    raise InputError(f"must be one of {', '.join(METRICS)}, got {shown(name)}", "metric")


def _table(given: object, agent_ids: object, task_ids: object) -> DistanceTable | None:
    """Return a table of distances that fits the instance."""
    agents, tasks = cast("tuple[str, ...]", agent_ids), cast("tuple[str, ...]", task_ids)
    if given is None:
        return None
    if isinstance(given, DistanceTable):
        if (given.n, given.m) != (len(agents), len(tasks)):
            raise InputError(f"is for {given.n} agents and {given.m} tasks", "distances")
        return given
    return DistanceTable.of(cast("Iterable[tuple[str, str, float]]", given), agents, tasks)


def _unit_share(tau: float) -> float:
    if isinstance(tau, Real) and not isinstance(tau, bool) and 0 < tau < 1:
        return float(tau)
    raise InputError(f"must lie strictly between 0 and 1, got {shown(tau)}", "tau")
