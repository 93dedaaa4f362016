"""Forecasts of tasks by an agent: who else will work there, and when they will be done."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.problems.missions.simulation.reports import TaskReport, View
from alloc.problems.missions.simulation.state import ACTIVE, AgentStatus


@dataclass(frozen=True)
class UtilityParameters(CheckedParameters):
    """Parameters of the utility of a task; the defaults are those of `greedy`, tuned.

    Attributes
    ----------
    stay : float
        Factor on the utility of an agent's present task.
    memory : float
        Hours after which reports of other agents no longer count.
    missed : float
        Factor on the utility of a task that will miss its deadline even with the agent's help.
    crowding : float
        Strength of the decrease in utility with the number of other agents at the task or on their way there.
    flight : float
        Rate, per hour of flight, at which utility decays.
    age : float
        Rate, per hour, at which utility decays with the age of the information on the task.
    """

    stay: float = bounded(4.8, low=0)
    memory: float = bounded(5.0, low=0)
    missed: float = bounded(0.016, low=0)
    crowding: float = bounded(0.14, low=0)
    flight: float = bounded(0.19, low=0)
    age: float = bounded(0.02, low=0)


Group = list[tuple[float, float]]
"""Hour of arrival and ability of each member."""


@dataclass(frozen=True)
class Prospect:
    """An agent's forecast of a task.

    Attributes
    ----------
    task : TaskReport
    arrival : float
        Hour at which the agent would arrive.
    without, with_me : float
        Expected hour of completion without the agent, and with it.
    group : int
        Number of other agents that are there or on their way.
    """

    task: TaskReport
    arrival: float
    without: float
    with_me: float
    group: int

    @property
    def is_useful(self) -> bool:
        """Whether the task is done earlier with the agent."""
        return self.with_me < self.without


def prospects(view: View, memory: float, task_of: Mapping[str, str] | None = None) -> list[Prospect]:
    """Return an agent's forecasts of the tasks that it knows and can take.

    Parameters
    ----------
    view : View
    memory : float
        Hours after which reports of other agents no longer count.
    task_of : mapping of str to str, optional
        Agreed task of each other agent; by default the task in the last report of it.
    """
    own = view.own
    groups = _groups(view, memory, task_of)
    found = []
    for task in view.open_tasks(own):
        is_there = own.status is AgentStatus.WORKING and own.task == task.facts.id
        arrival = view.hour + (0.0 if is_there else view.hours(own, task))
        group = groups.get(task.facts.id, [])
        left = task.left if group or is_there else task.left + task.facts.growth * (arrival - task.hour)
        without = done_at(left, task.hour, group)
        with_me = done_at(left, task.hour, [*group, (arrival, own.facts.ability)])
        found.append(Prospect(task, arrival, without, with_me, len(group)))
    return found


def utility(hour: float, prospect: Prospect, parameters: UtilityParameters, *, is_own: bool) -> float:
    """Return the utility of a task: its priority times the share of the time until completion that would be work.

    Parameters
    ----------
    hour : float
    prospect : Prospect
    parameters : UtilityParameters
    is_own : bool
        Whether it is the agent's present task.
    """
    if not prospect.is_useful:
        return 0.0
    facts, hours = prospect.task.facts, prospect.with_me - hour
    share = 1.0 if hours <= 0 else (prospect.with_me - prospect.arrival) / hours
    value = share * (facts.priority + 1e-6) / (1 + parameters.crowding * prospect.group)
    value *= math.exp(-parameters.flight * (prospect.arrival - hour) - parameters.age * (hour - prospect.task.hour))
    if prospect.with_me > facts.deadline:
        value *= parameters.missed
    return value * (parameters.stay if is_own else 1.0)


def _groups(view: View, memory: float, task_of: Mapping[str, str] | None) -> dict[str, Group]:
    """Return the other agents that are known to be at each task or on their way there."""
    groups: dict[str, Group] = {}
    for name, report in view.agents.items():
        goal = report.task if task_of is None else task_of.get(name)
        task = view.tasks.get(goal or "")
        if name == view.id or task is None or report.status not in ACTIVE or view.hour - report.hour > memory:
            continue
        is_there = report.status is AgentStatus.WORKING and report.task == goal
        arrival = -math.inf if is_there else report.hour + view.hours(report, task)
        groups.setdefault(task.facts.id, []).append((arrival, report.facts.ability))
    return groups


def done_at(left: float, since: float, group: Group) -> float:
    """Return the hour at which a group completes the work left at hour `since`; ``inf`` for an empty group."""
    rate = work = 0.0
    hour = math.inf
    for arrival, ability in sorted(group):
        begin = max(arrival, since)
        if begin >= hour:
            break
        rate += ability
        work += ability * begin
        hour = (left + work) / rate
    return hour
