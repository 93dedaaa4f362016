"""Observations and action masks of agents in a mission, as arrays of fixed length."""

import math

import numpy as np
from numpy.typing import NDArray

from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.reports import AgentReport, TaskReport, View
from alloc.problems.missions.simulation.state import ACTIVE, AgentStatus, Order, TaskStatus

OWN_FIGURES, TASK_FIGURES, AGENT_FIGURES = 8, 15, 8

LIMIT = 10.0
"""Observations are clipped to [-LIMIT, LIMIT]."""

Floats = NDArray[np.float32]
Mask = NDArray[np.int8]


class Lens:
    """Encoder of observations and actions of agents in a mission.

    An observation is the concatenation of `OWN_FIGURES` of the agent itself, `TASK_FIGURES` of each task, and
    `AGENT_FIGURES` of each agent, in their order in the mission. Tasks and agents that the agent does not know are all
    zeros. Positions are in units of the longest side of the mission's area, which all agents know; hours and other
    amounts x are log(1 + x). Actions are integers: the tasks, then places on a grid over the area, and last to continue
    with the last order.

    Parameters
    ----------
    mission : Mission
    grid : int
        Places on each side of the grid; 0 for none.
    """

    def __init__(self, mission: Mission, grid: int) -> None:
        self._end, self._side = mission.end, max(mission.longest_flight, 1e-12)
        self._tasks = {name: number for number, name in enumerate(mission.instance.task_ids)}
        self._agents = {name: number for number, name in enumerate(mission.instance.agent_ids)}
        low, high = mission.area
        self._low = low
        self._span = max(max(b - a for a, b in zip(low, high, strict=True)), 1e-12)
        shares = [(step + 0.5) / grid for step in range(grid)]
        self._places = [
            Place((low[0] + x * (high[0] - low[0]), low[1] + y * (high[1] - low[1]), (low[2] + high[2]) / 2))
            for y in shares
            for x in shares
        ]

    def order(self, action: int) -> Order | None:
        """Return the order of an action; None to continue with the last one."""
        if action < len(self._tasks):
            return Order(list(self._tasks)[action])
        place = action - len(self._tasks)
        return Order(position=self._places[place].position) if place < len(self._places) else None

    def mask(self, view: View) -> Mask:
        """Return which actions an agent can take, as far as it knows, shape (m + grid^2 + 1,)."""
        can = np.zeros(len(self._tasks) + len(self._places) + 1, np.int8)
        for task in view.open_tasks(view.own):
            can[self._tasks[task.facts.id]] = 1
        for number, place in enumerate(self._places, len(self._tasks)):
            is_elsewhere = view.distance_to_place(view.own, place) > 0
            can[number] = is_elsewhere and view.refusal_of_place(view.own, place) is None
        can[-1] = 1
        return can

    def observe(self, view: View) -> Floats:
        """Return the observation of an agent, shape (OWN_FIGURES + m TASK_FIGURES + n AGENT_FIGURES,)."""
        tasks = np.zeros((len(self._tasks), TASK_FIGURES))
        groups = self._groups(view)
        for name, task in view.tasks.items():
            tasks[self._tasks[name]] = self._task(view, task, groups.get(name, []))
        agents = np.zeros((len(self._agents), AGENT_FIGURES))
        for name, agent in view.agents.items():
            if name != view.id:
                agents[self._agents[name]] = self._agent(view, agent)
        flat = np.concatenate([self._own(view), tasks.ravel(), agents.ravel()])
        bounded: Floats = np.clip(np.nan_to_num(flat, posinf=LIMIT, neginf=-LIMIT), -LIMIT, LIMIT).astype(np.float32)
        return bounded

    def _own(self, view: View) -> list[float]:
        own = view.own
        whole = own.facts.energy_per_distance * self._side
        flights = own.battery / whole if whole > 0 else math.inf
        statuses = (AgentStatus.IDLE, AgentStatus.FLYING, AgentStatus.WORKING)
        return [
            *self._position(own.place),
            flights,
            *(float(own.status is status) for status in statuses),
            view.hour / self._end,
        ]

    def _task(self, view: View, task: TaskReport, group: list[AgentReport]) -> list[float]:
        own, facts = view.own, task.facts
        ability = own.facts.ability or 1.0
        return [
            1.0,
            float(task.status is TaskStatus.OPEN),
            float(view.refusal(own, task) is None),
            float(own.task == facts.id),
            *self._away(own.place, facts.place),
            _log(view.hours(own, task)),
            _log(task.left / ability),
            _log(facts.growth / ability),
            _log(facts.priority),
            _log(facts.deadline - view.hour),
            _log(view.hour - task.hour),
            _log(len(group)),
            _log(sum(other.facts.ability for other in group) / ability),
        ]

    def _agent(self, view: View, agent: AgentReport) -> list[float]:
        return [
            1.0,
            *self._away(view.own.place, agent.place),
            _log(agent.facts.ability / (view.own.facts.ability or 1.0)),
            float(agent.status is AgentStatus.FLYING),
            float(agent.status is AgentStatus.WORKING),
            _log(view.hour - agent.hour),
        ]

    def _groups(self, view: View) -> dict[str, list[AgentReport]]:
        """Return the other agents at or on their way to each task, by the latest reports."""
        groups: dict[str, list[AgentReport]] = {}
        for name, agent in view.agents.items():
            if name != view.id and agent.task is not None and agent.status in ACTIVE:
                groups.setdefault(agent.task, []).append(agent)
        return groups

    def _position(self, place: Place) -> list[float]:
        if place.position is None:
            return [0.0, 0.0, 0.0]
        return [(x - low) / self._span for x, low in zip(place.position, self._low, strict=True)]

    def _away(self, source: Place, goal: Place) -> list[float]:
        if source.position is None or goal.position is None:
            return [0.0, 0.0, 0.0]
        return [(b - a) / self._span for a, b in zip(source.position, goal.position, strict=True)]


def length(n: int, m: int) -> int:
    """Return the length of an observation."""
    return OWN_FIGURES + m * TASK_FIGURES + n * AGENT_FIGURES


def _log(value: float) -> float:
    """Return sign(x) log(1 + |x|)."""
    return math.copysign(math.log1p(abs(value)), value)
