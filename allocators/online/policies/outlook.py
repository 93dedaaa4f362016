"""What an agent expects of tasks: who else will work there, and when they will be done."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from alloc.problems.missions.simulation.reports import TaskReport, View
from alloc.problems.missions.simulation.state import ACTIVE, AgentStatus

Group = list[tuple[float, float]]
"""Hour of arrival and ability of each."""


@dataclass(frozen=True)
class Prospect:
    """A task, as an agent expects it to go on.

    Attributes
    ----------
    task : TaskReport
    arrival : float
        Hour at which the agent would be there.
    without, with_me : float
        Hour at which the task is done without the agent, and with it.
    group : int
        Others that are there, or on their way.
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
    """Return what an agent expects of the tasks that it knows and can take.

    Parameters
    ----------
    view : View
    memory : float
        Hours after which what was heard of others no longer counts.
    task_of : mapping of str to str, optional
        Task of each other agent, where that is agreed; where they were going by the last that was heard by default.
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


def _groups(view: View, memory: float, task_of: Mapping[str, str] | None) -> dict[str, Group]:
    """Return who else is at each task, or on its way there, as far as is known."""
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
    """Return the hour at which work is done that is left since an hour, by those who arrive; ``inf`` if nobody does."""
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
