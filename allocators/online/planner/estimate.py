"""A planner's estimate of the present state, from its inputs and the assumption that orders are followed."""

import math
from dataclasses import dataclass, replace

from alloc.allocators.online.planner.checks import check_event, check_hour, check_report
from alloc.allocators.online.planner.inputs import Input
from alloc.allocators.online.planner.state import LiveState
from alloc.allocators.online.planner.telemetry import correct
from alloc.problems.errors import InputError
from alloc.problems.missions.events import Event, EventKind
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.agenda import Agenda, Arrival, Changes, Completion, Turn
from alloc.problems.missions.simulation.changes import happen, land, obey
from alloc.problems.missions.simulation.motion import close, completion_hour, refusal, status_at_deadline
from alloc.problems.missions.simulation.reports import AgentReport, View, report_agent, report_task
from alloc.problems.missions.simulation.state import (
    ACTIVE,
    AgentState,
    AgentStatus,
    Order,
    TaskState,
    TaskStatus,
)

WORDS = {
    EventKind.AGENT_JOINS: "joined",
    EventKind.AGENT_FAILS: "failed",
    EventKind.AGENT_RECALLED: "was recalled",
    EventKind.AGENT_RETURNS: "returned",
    EventKind.AGENT_RECHARGES: "was recharged",
    EventKind.TASK_APPEARS: "appeared",
    EventKind.TASK_CANCELLED: "was cancelled",
    EventKind.TASK_CHANGES: "changed",
    EventKind.RADIO_SILENT: "radio fell silent",
}


MAX_ENTRIES = 4
"""Number of agenda entries per agent and task after which the agenda is rebuilt; at most two of them are not void."""


KEPT_NEWS = 1000
"""Number of the latest news since the last plan that are always kept; at most twice as many are."""


@dataclass(frozen=True)
class News:
    """A piece of news that may change a plan.

    Attributes
    ----------
    hour : float
    text : str
    agent, task : str or None
        Ids of the agent and the task concerned.
    is_minor : bool
        Whether it is a routine report of an agent's place or of a task's work left.
    """

    hour: float
    text: str
    agent: str | None = None
    task: str | None = None
    is_minor: bool = False


class StateEstimate:
    """The estimated present state of agents and tasks.

    Agents are assumed to follow their orders, and work to proceed as in the simulation of missions, until an event or a
    report says otherwise. A task is assumed to be done when its work should be; if work is reported afterwards, it is
    open again.

    Parameters
    ----------
    mission : Mission
        Only its state at hour 0 is used; later events have to be submitted when they happen.

    Attributes
    ----------
    state : LiveState
    news : list of News
        News in chronological order, until they are forgotten.
    news_count : int
        Total number of news so far, including forgotten ones.
    """

    def __init__(self, mission: Mission) -> None:
        self.state = LiveState(mission)
        self.agenda = Agenda()
        self.news: list[News] = []
        self.news_count = 0
        self._changes = Changes(self.state, self.agenda)
        for event in mission.timeline:
            if event.hour <= 0 and event.kind is not EventKind.RADIO_SILENT:
                self._apply_event(event)
        self._changes.balance()
        self._note("the mission began")

    def advance(self, hour: float) -> None:
        """Advance to an hour: flights end, work gets done, deadlines pass."""
        state = self.state
        while self.agenda.hour <= hour:
            state.hour = max(state.hour, self.agenda.hour)
            self._process(self.agenda.pop()[1])
            self._changes.balance()
        state.hour = hour

    def apply(self, given: Input) -> None:
        """Apply an input at its hour; an inconsistent one is an error and changes nothing."""
        said = given.said
        check_hour(self.state, said.hour)
        if given.whole is not None:
            assert isinstance(said, Event)
            self.state.admit(given.to_dict())
            if said.task is not None:
                self._note_deadline(self.state.task(said.task))
        elif isinstance(said, Event):
            check_event(self.state, said)
        else:
            check_report(self.state, said)
        self.advance(said.hour)
        if isinstance(said, Event):
            self._apply_event(said)
            is_minor = said.kind is EventKind.TASK_CHANGES
            self.add_news(News(said.hour, WORDS[said.kind], said.agent, said.task, is_minor))
        else:
            agent = self.state.agent(said.agent)
            left = agent.task
            problem = correct(self.state, agent, said)
            self._changes.note_agent(agent, left)
            text = "reported" if problem is None else f"cannot go on: {problem}"
            self.add_news(News(said.hour, text, said.agent, is_minor=problem is None))
        self._changes.balance()

    def order(self, name: str, order: Order) -> str | None:
        """Give an agent an order; return why it is refused, None if it is not. Call `schedule` after the last one."""
        agent = self.state.agent(name)
        if order == agent.order:
            return None
        if order.task is not None:
            try:
                status = self.state.task(order.task).status
            except InputError as error:
                return error.message
            if status is not TaskStatus.OPEN:
                return f"the task is {status}"
        left = agent.task
        problem = obey(self.state, agent, order)
        if problem is None:
            self._changes.note_agent(agent, left)
        return problem

    def schedule(self) -> None:
        """Schedule arrivals and completions after new orders."""
        self._changes.balance()
        if len(self.agenda) > MAX_ENTRIES * (len(self.state.agents) + len(self.state.tasks)):
            self.agenda = Agenda()  # drops void entries of diverted agents
            self._changes = Changes(self.state, self.agenda)
            self.restore_agenda()

    def active(self) -> list[AgentState]:
        """Return the agents that take orders."""
        return [agent for agent in self.state.agents if agent.status in ACTIVE]

    def view(self, pins: dict[str, str | None]) -> View:
        """Return the present view: agents in the mission, open tasks, and tasks to which an agent is under way.

        Parameters
        ----------
        pins : dict
            Agents that may do only one task, or none.
        """
        agents: dict[str, AgentReport] = {}
        for agent in self.active():
            report = report_agent(self.state, agent)
            if agent.facts.id in pins:
                task = pins[agent.facts.id]
                only = frozenset(() if task is None else (task,))
                report = replace(report, facts=replace(report.facts, tasks=only))
            agents[agent.facts.id] = report
        shown = {task.facts.id: task for task in self.state.tasks if task.status is TaskStatus.OPEN}
        over = {report.task for report in agents.values() if report.task is not None} - shown.keys()
        if over:
            wanted = [*shown.values(), *map(self.state.task, over)]
            shown = {task.facts.id: task for task in sorted(wanted, key=lambda task: task.index)}
        tasks = {name: report_task(self.state, task) for name, task in shown.items()}
        return View(self.state.hour, None, agents, tasks, self.state.distances)

    def refusal(self, name: str, task: str) -> str | None:
        """Return why an agent cannot take a task now; None if it can."""
        agent, goal = self.state.agent(name), self.state.task(task)
        if agent.status not in ACTIVE:
            return f"the agent is {agent.status}"
        if goal.status is not TaskStatus.OPEN:
            return f"the task is {goal.status}"
        report = report_agent(self.state, agent)
        if report.task == task:
            return None
        return refusal(self.state.distances, report.facts, report.place, report.battery, goal.facts.place, goal.facts)

    def restore_agenda(self) -> None:
        """Fill an empty agenda with the arrivals, completions and deadlines of the present state."""
        for agent in self.state.agents:
            if agent.flight is not None:
                self.agenda.push(agent.flight.arrives, Turn.ARRIVAL, Arrival(agent, agent.flight))
        for task in self.state.tasks:
            self._note_deadline(task)
            if task.workers:
                hour = completion_hour(self.state, task)
                if hour < math.inf:
                    self.agenda.push(max(hour, self.state.hour), Turn.COMPLETION, Completion(task, task.version))

    def add_news(self, news: News) -> None:
        """Add a piece of news."""
        self.news.append(news)
        self.news_count += 1
        if len(self.news) > 2 * KEPT_NEWS:
            del self.news[:-KEPT_NEWS]  # no plan was made for long, or the policy fails

    def forget(self, count: int) -> None:
        """Forget the first `count` of all news so far."""
        del self.news[: max(0, len(self.news) - (self.news_count - count))]

    def _note(self, text: str, agent: str | None = None, task: str | None = None) -> None:
        self.add_news(News(self.state.hour, text, agent, task))

    def _apply_event(self, event: Event) -> None:
        state = self.state
        if event.kind is EventKind.RADIO_SILENT:
            return
        if event.agent is not None:
            agent = state.agent(event.agent)
            left = agent.task
            happen(state, event)
            self._changes.note_agent(agent, left)
            state.file_agent(agent)
            return
        task = state.task(event.task)
        if event.kind is EventKind.TASK_APPEARS:
            task.facts = replace(task.facts, appears=event.hour)
            self._note_deadline(task)
        elif event.kind is EventKind.TASK_CHANGES and task.status is TaskStatus.DONE and event.workload:
            task.status, task.since, task.closed = TaskStatus.OPEN, state.hour, math.inf
            self._note_deadline(task)
        workers = tuple(task.workers.values())
        happen(state, event)
        state.file_task(task)
        self._changes.note_task(task)
        for agent in workers:
            self._changes.note_agent(agent)
        if task.status is TaskStatus.OPEN and task.facts.deadline <= state.hour:
            self._close(task, status_at_deadline(state, task))  # the work was not done in time

    def _note_deadline(self, task: TaskState) -> None:
        if task.status in (TaskStatus.TO_COME, TaskStatus.OPEN) and task.facts.deadline < math.inf:
            self.agenda.push(task.facts.deadline, Turn.DEADLINE, task)

    def _process(self, item: object) -> None:
        """Process an entry of the agenda, unless it is void by now."""
        if isinstance(item, Arrival):
            if item.agent.flight is item.flight:
                land(self.state, item.agent)
                self._changes.note_agent(item.agent, item.flight.task)
                if item.agent.status is AgentStatus.IDLE:
                    self._note("arrived", agent=item.agent.facts.id)
        elif isinstance(item, Completion):
            if item.task.status is TaskStatus.OPEN and item.task.version == item.version:
                self._close(item.task, TaskStatus.DONE)
        elif isinstance(item, TaskState) and item.status is TaskStatus.OPEN:
            self._close(item, status_at_deadline(self.state, item))

    def _close(self, task: TaskState, status: TaskStatus) -> None:
        workers = tuple(task.workers.values())
        close(self.state, task, status)
        self.state.file_task(task)
        self._changes.note_task(task)
        for agent in workers:
            self._changes.note_agent(agent)
        self._note(f"was {status}", task=task.facts.id)
