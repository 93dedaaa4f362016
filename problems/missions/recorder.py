"""Recording of the course of a simulation for plots, beside its log."""

import math

import numpy as np

from alloc.problems.instance import FloatArray
from alloc.problems.missions.course import Awareness, Course, Leg, Level
from alloc.problems.missions.events import EventKind
from alloc.problems.missions.files.log_file import MissionLog
from alloc.problems.missions.replay import replay
from alloc.problems.missions.simulation.log import Log, Record
from alloc.problems.missions.simulation.measures import MissionResult
from alloc.problems.missions.simulation.motion import place_at, work_left
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import AgentState, AgentStatus, MissionState, TaskState, TaskStatus
from alloc.problems.vocabulary import Knowledge

MAX_MOMENTS = 240
"""Number of recorded moments beyond which every other one is dropped."""

MAX_REPORTS = 1_500_000
"""Limit on the number of recorded report hours; with many agents, only the knowledge of some is recorded."""


def course_of(log: MissionLog) -> Course:
    """Return the course of a mission by replaying its log.

    Parameters
    ----------
    log : MissionLog

    Returns
    -------
    Course
        Without agents' knowledge, as a log does not contain the contents of messages.

    Raises
    ------
    InputError
        If the log contradicts the replay of its orders; the error's ``place`` is the line.
    """
    recorder = Recorder()
    result, _ = replay(log, recorder)
    return recorder.course(result)


class Recorder:
    """Records the simulation that it is called with; the course is complete once that has ended.

    Parameters
    ----------
    with_knowledge : bool
        Whether to record agents' knowledge as well, if it is local.
    """

    def __init__(self, *, with_knowledge: bool = False) -> None:
        self._with_knowledge = with_knowledge
        self._simulation: Simulation | None = None

    def __call__(self, simulation: Simulation) -> None:
        """Start recording a simulation."""
        state = simulation.state
        self._simulation = simulation
        simulation.log = _RecordedLog(state, self)
        self._legs: list[list[Leg]] = [[] for _ in state.agents]
        self._levels = [[Level(0.0, 0.0, TaskStatus.TO_COME)] for _ in state.tasks]
        self._workers: list[set[int]] = [set() for _ in state.tasks]
        self._messages: list[tuple[float, int, int]] = []
        self._changed: list[tuple[float, AgentState | TaskState]] = []
        self._knowledge = _Knowledge(simulation) if self._is_knowledge_recorded(simulation) else None
        self._next = 0.0

    def _is_knowledge_recorded(self, simulation: Simulation) -> bool:
        return self._with_knowledge and simulation.knowledge is Knowledge.LOCAL

    @property
    def _state(self) -> MissionState:
        assert self._simulation is not None
        return self._simulation.state

    def note(self, record: Record) -> None:
        """Process a record of the log: an event is about to happen, anything else has just happened."""
        self._catch_up()
        kind, hour = record["record"], self._state.hour
        agent = self._state.agent(str(record["agent"])) if record.get("agent") is not None else None
        task = record.get("task")
        named = self._state.task(str(task)) if task in self._state.mission.instance.task_index else None
        if kind == "message" and agent is not None:
            heard = record["heard"]
            self._messages.append((hour, agent.index, len(heard) if isinstance(heard, list) else 0))
        elif kind == "event":
            self._changed += [(hour, one) for one in (agent, named) if one is not None]
            before = named if agent is None else agent.task
            if before is not None:
                self._add_level(before, Level(hour, work_left(self._state, before), before.status))
            if named is not None:
                self._note_amount(named, record)
        elif kind in ("order", "arrival") and agent is not None:
            self._note_agent(agent, hour)
        elif named is not None and kind in ("completion", "missed"):
            missed = record.get("work", 0.0)
            self._add_level(named, Level(hour, float(missed) if isinstance(missed, int | float) else 0.0, named.status))
            self._note_task(named, hour)

    def _note_amount(self, task: TaskState, record: Record) -> None:
        """Note the work left of a task that appears or changes now, as its next record may come much later."""
        amount = task.workload if record["event"] == EventKind.TASK_APPEARS else record.get("workload")
        is_over = task.status not in (TaskStatus.TO_COME, TaskStatus.OPEN)
        if isinstance(amount, int | float) and not is_over:
            self._add_level(task, Level(self._state.hour, float(amount), TaskStatus.OPEN))

    def before(self) -> None:
        """Record continuous changes before a record is added: agents' knowledge, and work at a random pace."""
        hour = self._state.hour
        if self._knowledge is not None:
            self._knowledge.look(hour)
        if self._state.mission.pace is not None and hour >= self._next:
            self._next = hour + self._state.mission.pace.period / 4
            for task in self._state.tasks:
                if task.workers:
                    self._add_level(task, Level(hour, work_left(self._state, task), task.status))

    def _catch_up(self) -> None:
        """Note the effects of events, which are logged before they happen."""
        changed, self._changed = self._changed, []
        for hour, one in changed:
            if isinstance(one, AgentState):
                self._note_agent(one, hour)
            else:
                self._note_task(one, hour)

    def _note_agent(self, agent: AgentState, hour: float) -> None:
        legs, flight = self._legs[agent.index], agent.flight
        before = legs[-1].task if legs and legs[-1].status is AgentStatus.WORKING else -1
        if flight is not None and flight.departs > hour:
            self._begin(agent, Leg(hour, math.inf, AgentStatus.IDLE, flight.source.position, flight.source.position))
            hour = flight.departs
        place = place_at(self._state, agent).position
        if flight is None:
            task = -1 if agent.task is None else agent.task.index
            self._begin(agent, Leg(hour, math.inf, agent.status, place, place, task))
        else:
            place = flight.source.position if hour == flight.departs else place
            task = -1 if flight.task is None else flight.task.index
            self._begin(agent, Leg(hour, flight.arrives, agent.status, place, flight.goal.position, task))
        after = -1 if agent.task is None else agent.task.index
        for index in {before, after} - {-1}:
            self._note_task(self._state.tasks[index], hour)
        if before >= 0:
            self._workers[before].discard(agent.index)
        if after >= 0:
            self._workers[after].add(agent.index)

    def _begin(self, agent: AgentState, leg: Leg) -> None:
        """End an agent's leg where the agent is now and begin another one, unless the activity is the same."""
        legs = self._legs[agent.index]
        if legs:
            last = legs[-1]
            if (last.status, last.task, last.goal) == (leg.status, leg.task, leg.goal) and last.end >= leg.begin:
                return
            last.goal = leg.source if leg.source is not None else last.position(leg.begin)
            last.end = leg.begin
            if last.end == last.begin:
                legs.pop()
        legs.append(leg)

    def _note_task(self, task: TaskState, hour: float) -> None:
        self._add_level(task, Level(max(hour, min(task.since, self._state.hour)), task.left, task.status))
        if task.status is not TaskStatus.OPEN:
            hour = max(hour, min(task.closed, self._state.hour))
            idle, self._workers[task.index] = self._workers[task.index], set()
            for index in sorted(idle):
                self._note_agent(self._state.agents[index], hour)

    def _add_level(self, task: TaskState, level: Level) -> None:
        levels = self._levels[task.index]
        if level != levels[-1] and level.hour >= levels[-1].hour:
            levels.append(level)

    def course(self, result: MissionResult) -> Course:
        """Return the recorded course.

        Parameters
        ----------
        result : MissionResult
            Result of the simulation.
        """
        self._catch_up()
        state = self._state
        for task in state.tasks:
            self._add_level(task, Level(state.hour, task.left, task.status))
        for legs in self._legs:
            if len(legs) > 1 and legs[-1].begin == state.hour:  # a leg of length 0
                legs.pop()
            for leg in legs[-1:]:
                leg.goal, leg.end = leg.position(state.hour), state.hour
        known = None if self._knowledge is None else self._knowledge.awareness()
        levels = tuple(self._levels)
        return Course(state.mission, result, state.hour, tuple(self._legs), levels, tuple(self._messages), known)


class _RecordedLog(Log):
    """A log that notifies a recorder of each record."""

    def __init__(self, state: MissionState, recorder: Recorder) -> None:
        super().__init__(state)
        self._recorder = recorder

    def _add(self, record: str, **fields: object) -> None:
        self._recorder.before()
        super()._add(record, **fields)
        self._recorder.note(self.records[-1])


class _Knowledge:
    """Knowledge of some agents over time; the longer the mission, the larger the intervals between moments."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        instance = simulation.mission.instance
        self._ids = instance.agent_ids, instance.task_ids
        count = max(1, min(instance.n, MAX_REPORTS // (MAX_MOMENTS * (instance.n + instance.m))))
        self._agents = np.unique(np.linspace(0, instance.n - 1, count).astype(np.intp)).tolist()
        self._interval = simulation.mission.radio.period
        self._hours: list[float] = []
        self._reports: list[FloatArray] = []

    def look(self, hour: float) -> None:
        """Record the agents' knowledge at an hour, unless it was recorded shortly before."""
        if self._hours and hour < self._hours[-1] + 0.999 * self._interval:
            return
        self._hours.append(hour)
        self._reports.append(np.array([self._row(agent) for agent in self._agents]))
        if len(self._hours) > MAX_MOMENTS:
            self._interval *= 2
            self._hours, self._reports = self._hours[::2], self._reports[::2]

    def _row(self, agent: int) -> list[float]:
        agents, tasks = self._ids
        if self._simulation.state.agents[agent].status in (AgentStatus.ABSENT, AgentStatus.FAILED):
            return [math.nan] * (len(agents) + len(tasks))
        view = self._simulation.view(agents[agent], is_glance=True)
        row = [report.hour if (report := view.agents.get(name)) is not None else math.nan for name in agents]
        return row + [news.hour if (news := view.tasks.get(name)) is not None else math.nan for name in tasks]

    def awareness(self) -> Awareness:
        """Return the recorded knowledge."""
        return Awareness(tuple(self._agents), np.array(self._hours), np.array(self._reports).transpose(1, 0, 2))
