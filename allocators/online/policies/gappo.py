"""The policies `gappo` and `ppo`: a network scores each agent's options from what it knows of tasks and neighbours."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.learned.missions.exploring import centre, record_seen
from alloc.allocators.learned.missions.messages import should_send
from alloc.allocators.learned.missions.network import compiled_weights
from alloc.allocators.learned.missions.network_arrays import MissionWeights
from alloc.allocators.learned.missions.options import WAIT
from alloc.allocators.learned.missions.play import Buffers, is_due, new_buffers, record_change, score_options_compiled
from alloc.allocators.learned.missions.policy_file import SHIPPED, SHIPPED_PPO, load_network
from alloc.allocators.learned.missions.situation import MEMORY, OTHER_WAYS, Situation
from alloc.allocators.missions.layout import NOBODY
from alloc.allocators.missions.motion import distance_between
from alloc.allocators.online.contract import AgentDecider, Briefing, Policy, PolicyInfo, TurnsDecider
from alloc.allocators.online.policies.network_turns import NetworkTurns, metric_code
from alloc.problems.missions.simulation.reports import AgentReport, Message, TaskReport, View
from alloc.problems.missions.simulation.state import ACTIVE, STAY, AgentStatus, Order, TaskStatus
from alloc.problems.vocabulary import MANHATTAN, Knowledge

REMEMBERED = ("seen", "goal", "decided", "tasks", "periods", "saved", "counted", "news")
"""Fields of `Buffers` that persist between decisions; the others are scratch."""

NOWHERE = (math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class NetworkParameters(CheckedParameters):
    """Parameters of a network policy.

    Attributes
    ----------
    periods : int
        Radio periods per message of an agent: a token bucket, which keeps one message in reserve for a changed order.
    """

    periods: int = bounded(12, low=1)


class NetworkPolicy(Policy):
    """Each agent takes the option that the network scores highest: a task, exploring, or staying.

    Parameters
    ----------
    parameters : NetworkParameters, optional
    policy : Path or str, optional
        Policy file from ``alloc train gappo --missions``; by default the one that ships with the package.
    **settings
        Single parameters by name.
    """

    info = PolicyInfo(
        name="gappo",
        summary="a network, trained in missions, scores what each agent knows",
        requires=("torch", "safetensors"),
        options=("policy",),
        citation="Fang et al. (2025), doi:10.20944/preprints202502.0192.v1",
    )

    parameters_type: ClassVar[type] = NetworkParameters
    shipped: ClassVar[Path] = SHIPPED

    def __init__(
        self, parameters: NetworkParameters | None = None, *, policy: Path | str | None = None, **settings: object
    ) -> None:
        super().__init__(parameters, **settings)
        self.network = load_network(self.shipped if policy is None else policy)
        self._weights = compiled_weights(self.network)
        _compile_loops(self._weights)

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return the network decider of an agent."""
        return _NetworkDecider(briefing, self._weights, self.parameters.periods)

    def begin_turns(self, briefing: Briefing) -> TurnsDecider:
        """Return the network decider for all agents in turn."""
        return NetworkTurns(briefing, self._weights)


class PpoPolicy(NetworkPolicy):
    """The same network, trained by PPO alone: the baseline for `gappo`.

    Parameters
    ----------
    parameters : NetworkParameters, optional
    policy : Path or str, optional
        Policy file from ``alloc train ppo --missions``; by default the one that ships with the package.
    **settings
        Single parameters by name.
    """

    info = replace(
        NetworkPolicy.info,
        name="ppo",
        summary="the network of gappo, trained by PPO alone",
        citation="Schulman et al. (2017), arXiv:1707.06347",
    )
    shipped: ClassVar[Path] = SHIPPED_PPO


class _NetworkDecider(AgentDecider):
    def __init__(self, briefing: Briefing, weights: MissionWeights, periods: int) -> None:
        self._weights, self._area = weights, np.array(briefing.area)
        self._span, self._period = math.dist(*briefing.area), briefing.radio.period
        is_blind = briefing.knowledge is Knowledge.LOCAL
        self._sensing = briefing.sensing if is_blind else math.inf
        self._seed, self._number = briefing.seed[0], briefing.seed[1] - 1
        self._buffers = new_buffers(1, 0, periods)

    def decide(self, view: View) -> Order | None:
        buffers, own = self._buffers, view.own
        tasks = [task for task in view.tasks.values() if task.status is TaskStatus.OPEN]
        names = [task.facts.id for task in tasks]
        is_flying = own.status is AgentStatus.FLYING
        is_busy = own.task in names if own.task is not None else is_flying
        is_considered = is_due(buffers, 0, view.hour, self._period, len(tasks), is_busy)
        if (is_considered or is_flying) and self._sensing < math.inf:
            x, y, _ = own.place.position or NOWHERE
            record_seen(self._area, self._sensing, x, y, view.hour, buffers.seen[0])
        if not is_considered:
            return None
        buffers.decided[0], buffers.tasks[0] = view.hour, len(tasks)
        buffers = self._resized(len(view.agents), len(tasks) + 1)
        _fill(view, buffers.situation, tasks, self._span, MEMORY * self._period)
        count = score_options_compiled(buffers, self._area, self._sensing, self._seed, self._number, 0, self._weights)
        choice = int(buffers.choice[np.argmax(buffers.scores[:count])])
        record_change(buffers, 0, choice)
        if choice >= 0:
            return Order(names[choice])
        if choice == WAIT:
            return STAY
        if is_flying and own.task is None:
            return None
        x, y, z = centre(self._area, int(buffers.goal[0]))
        return Order(position=(float(x), float(y), float(z)))

    def message(self, view: View) -> Message | None:
        buffers, tick = self._buffers, round(view.hour / self._period)
        return (
            view.message()
            if should_send(buffers.periods, buffers.saved, buffers.counted, buffers.news, 0, tick)
            else None
        )

    def _resized(self, n: int, m: int) -> Buffers:
        """Return arrays for `n` agents and `m` tasks, with what the agent remembers copied over."""
        fresh = new_buffers(n, m)
        kept = {name: getattr(self._buffers, name) for name in REMEMBERED}
        self._buffers = fresh._replace(**kept)
        return self._buffers


def _compile_loops(weights: MissionWeights) -> None:
    """Compile all loops that a decision needs, so that the first one also meets its deadline."""
    buffers, area = new_buffers(1, 2), np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    buffers.situation.own[:] = 1.0
    is_due(buffers, 0, 0.0, 1.0, 1, False)
    record_seen(area, 1.0, 0.0, 0.0, 0.0, buffers.seen[0])
    score_options_compiled(buffers, area, 1.0, 0, 0, 0, weights)
    record_change(buffers, 0, WAIT)
    should_send(buffers.periods, buffers.saved, buffers.counted, buffers.news, 0, 1)
    distance_between(False, centre(area, 0), NOWHERE)


def _fill(view: View, situation: Situation, tasks: list[TaskReport], span: float, memory: float) -> None:
    """Fill in what an agent knows; `tasks` are the open ones, and one column after them stands for all closed ones."""
    own = view.own
    index = {task.facts.id: j for j, task in enumerate(tasks)}
    place = own.place.position or NOWHERE
    is_at_work, is_flying = own.status is AgentStatus.WORKING, own.status is AgentStatus.FLYING
    facts = own.facts
    situation.own[:] = (
        view.hour,
        *place,
        facts.ability,
        facts.speed,
        own.battery,
        facts.energy_per_distance,
        span,
        NOBODY if own.task is None else index.get(own.task, len(tasks)),
        is_at_work,
        is_flying,
        metric_code(view),
    )
    for j, task in enumerate(tasks):
        known = task.facts
        situation.can[j] = view.refusal(own, task) is None
        numbers = (task.left, task.hour, known.priority, known.deadline, known.growth, _distance(view, task))
        situation.task[:, j] = (*(known.place.position or NOWHERE), *numbers)
    for i, (name, report) in enumerate(view.agents.items()):
        is_recent = name != view.id and view.hour - report.hour <= memory and report.status in ACTIVE
        situation.counts[i] = is_recent
        if is_recent:
            situation.target[i] = _target(view, report, index)
            place, facts = report.place.position or NOWHERE, report.facts
            costs = facts.speed, report.battery, facts.energy_per_distance
            is_free = report.status is AgentStatus.IDLE
            situation.other[:, i] = (_arrival(view, report), facts.ability, *place, *costs, report.hour, is_free)


def _distance(view: View, task: TaskReport) -> float:
    """Return the distance to a task, rounded as in the compiled simulation so that ties are the same."""
    here, there = view.own.place.position, task.facts.place.position
    if here is None or there is None or metric_code(view) == OTHER_WAYS:
        return view.distance(view.own, task)
    return distance_between(view.metric == MANHATTAN, here, there)


def _target(view: View, report: AgentReport, index: dict[str, int]) -> int:
    """Return the index of another agent's task; closed tasks share one index after all open ones."""
    if report.task is None or report.task not in view.tasks:
        return NOBODY
    return index.get(report.task, len(index))


def _arrival(view: View, report: AgentReport) -> float:
    task = view.tasks.get(report.task or "")
    if task is None:
        return 0.0
    return -math.inf if report.status is AgentStatus.WORKING else report.hour + view.hours(report, task)
