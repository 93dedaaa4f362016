"""Decisions of the network for all agents in turn, under full knowledge: one compiled loop instead of a view each."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.network_arrays import MissionWeights
from alloc.allocators.learned.missions.options import WAIT
from alloc.allocators.learned.missions.turns import (
    NOT_DUE,
    JointDecisions,
    decide_in_turn,
    fill_shared_parts,
    new_joint_decisions,
)
from alloc.allocators.missions.layout import NOBODY
from alloc.allocators.online.contract import Briefing, TurnsDecider
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.fields import BoolArray, FloatArray
from alloc.problems.missions.simulation.reports import AgentReport, TaskReport, View
from alloc.problems.missions.simulation.state import STAY, AgentStatus, Order, TaskStatus
from alloc.problems.vocabulary import GEOGRAPHIC, MANHATTAN

AT_ONCE = 32
"""Number of agents for which the loop decides before the caller may stop it."""

NOWHERE = (math.nan, math.nan, math.nan)


class NetworkTurns(TurnsDecider):
    """Network decider for all agents in turn.

    Parameters
    ----------
    briefing : Briefing
    weights : MissionWeights
    """

    def __init__(self, briefing: Briefing, weights: MissionWeights) -> None:
        self._weights, self._period, self._span = weights, briefing.radio.period, math.dist(*briefing.area)
        self._names: list[str] = []
        self._joint = new_joint_decisions(0, 1)
        _compile_loops(weights)

    def turns(self, view: View, names: Sequence[str]) -> Iterator[tuple[str, Order | None]]:
        """Yield the order of each agent."""
        if not names:
            return
        tasks = [task for task in view.tasks.values() if task.status is TaskStatus.OPEN]
        orders = {**{j: Order(task.facts.id) for j, task in enumerate(tasks)}, WAIT: STAY, NOT_DUE: None}
        joint = self._with_shared_parts(view, tasks)
        row = {name: i for i, name in enumerate(self._names)}
        remembered = joint.buffers.decided, joint.buffers.tasks
        for first in range(0, len(names), AT_ONCE):
            some = names[first : first + AT_ONCE]
            rows = np.array([row[name] for name in some])
            choices, before = rows.copy(), [part[rows] for part in remembered]
            decide_in_turn(joint, self._weights, choices, self._period, len(tasks))
            for place, (name, choice) in enumerate(zip(some, choices.tolist(), strict=True), 1):
                try:
                    yield name, orders[choice]
                except GeneratorExit:  # the caller stopped: undo the decisions that it did not take
                    for part, then in zip(remembered, before, strict=True):
                        part[rows[place:]] = then[place:]
                    raise

    def _with_shared_parts(self, view: View, tasks: list[TaskReport]) -> JointDecisions:
        """Fill in and return what all agents know, with the hour of each one's last decision."""
        agents = list(view.agents.values())
        self._resize(list(view.agents), len(tasks) + 1)
        joint, places = self._joint, [agent.place for agent in agents]
        index = {task.facts.id: j for j, task in enumerate(tasks)}
        joint.own[:] = [_own(view, agent, self._span, index) for agent in agents]
        if tasks:
            ways = view.distances(places, tasks)
            joint.distances[:, :-1] = ways
            joint.can[:, :-1] = _reach(view, agents, tasks, ways)
            joint.buffers.situation.task[: known.DISTANCE, :-1] = np.array([_facts(task) for task in tasks]).T
        rows, target = np.arange(len(agents)), joint.own[:, known.TARGET].astype(np.intp)
        has_open = (target >= 0) & (target < len(tasks))
        joint.can[rows[has_open], target[has_open]] = True
        fill_shared_parts(joint)
        return joint

    def _resize(self, names: list[str], m: int) -> None:
        """Allocate arrays for these agents and `m` tasks; keep what agents remember."""
        before, rows = self._joint, {name: i for i, name in enumerate(self._names)}
        if names == self._names and m == before.can.shape[1]:
            return
        self._names, self._joint = names, new_joint_decisions(len(names), m)
        kept = [(i, rows[name]) for i, name in enumerate(names) if name in rows]
        if kept:
            now, then = np.array(kept).T
            self._joint.buffers.decided[now] = before.buffers.decided[then]
            self._joint.buffers.tasks[now] = before.buffers.tasks[then]


def _compile_loops(weights: MissionWeights) -> None:
    """Compile all loops, so that the first decision also meets its deadline."""
    joint = new_joint_decisions(1, 2)
    joint.own[:] = 1.0
    fill_shared_parts(joint)
    decide_in_turn(joint, weights, np.zeros(1, np.intp), 1.0, 0)


def metric_code(view: View) -> int:
    """Return the code of the metric; see `alloc.allocators.learned.missions.situation`."""
    if view.has_table or view.metric == GEOGRAPHIC:
        return known.OTHER_WAYS
    return known.MANHATTAN_WAYS if view.metric == MANHATTAN else known.EUCLIDEAN_WAYS


def _own(view: View, agent: AgentReport, span: float, index: dict[str, int]) -> tuple[float, ...]:
    """Return what an agent knows of itself; closed tasks share one index after all open ones."""
    facts = agent.facts
    return (
        view.hour,
        *(agent.place.position or NOWHERE),
        facts.ability,
        facts.speed,
        agent.battery,
        facts.energy_per_distance,
        span,
        NOBODY if agent.task is None else index.get(agent.task, len(index)),
        agent.status is AgentStatus.WORKING,
        agent.status is AgentStatus.FLYING,
        metric_code(view),
    )


def _facts(task: TaskReport) -> tuple[float, ...]:
    facts = task.facts
    return (*(facts.place.position or NOWHERE), task.left, task.hour, facts.priority, facts.deadline, facts.growth)


def _reach(view: View, agents: list[AgentReport], tasks: list[TaskReport], ways: FloatArray) -> BoolArray:
    """Return which tasks each agent can take, shape (agents, tasks); the same as `View.refusal` for each pair."""
    is_home_far = view.has_table or any(task.facts.place.position is None for task in tasks)
    if is_home_far and any(agent.facts.returns for agent in agents):
        return np.array([[view.refusal(agent, task) is None for task in tasks] for agent in agents])
    back = np.zeros_like(ways)
    returning = [i for i, agent in enumerate(agents) if agent.facts.returns]
    if returning:
        back[returning] = view.distances([agents[i].facts.home for i in returning], tasks)
    reach, battery, rate = np.array(
        [(agent.facts.range, agent.battery, agent.facts.energy_per_distance) for agent in agents]
    ).T[:, :, None]
    near = (ways <= reach + TOLERANCE) & (ways < math.inf)
    can: BoolArray = near & (rate * (ways + back) <= battery + TOLERANCE) & _allowed(agents, tasks)
    return can


def _allowed(agents: list[AgentReport], tasks: list[TaskReport]) -> BoolArray:
    allowed = np.ones((len(agents), len(tasks)), np.bool_)
    is_skilled = any(task.facts.needs for task in tasks)
    for i, agent in enumerate(agents):
        names, skills = agent.facts.tasks, agent.facts.skills
        if names is not None or is_skilled:
            allowed[i] = [(names is None or task.facts.id in names) and task.facts.needs <= skills for task in tasks]
    return allowed
