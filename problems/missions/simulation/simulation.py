"""The event loop of a mission, with requests for messages and orders."""

import math
from collections.abc import Iterator

from alloc.problems.arguments import checked_seed, choice, of_type
from alloc.problems.missions.events import Event, EventKind
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation import conservation
from alloc.problems.missions.simulation.agenda import (
    Agenda,
    Arrival,
    Changes,
    Completion,
    Delivery,
    Request,
    Turn,
    Wanted,
)
from alloc.problems.missions.simulation.awareness import Awareness, FullAwareness, LocalAwareness
from alloc.problems.missions.simulation.changes import happen, land, obey
from alloc.problems.missions.simulation.channel import Channel
from alloc.problems.missions.simulation.log import Log
from alloc.problems.missions.simulation.motion import (
    bring_up_to_date,
    close,
    end_flights,
    status_at_deadline,
)
from alloc.problems.missions.simulation.reports import Message, View
from alloc.problems.missions.simulation.state import (
    ACTIVE,
    STAY,
    AgentState,
    AgentStatus,
    MissionState,
    Order,
    TaskState,
    TaskStatus,
)
from alloc.problems.vocabulary import Knowledge


class Simulation:
    """A running simulation of a mission, which pauses whenever agents may send messages or get orders.

    At equal hours the order is: tasks are completed, deadlines pass, events of the mission happen, flights end,
    messages are received, new ones are sent, and orders are given. With full knowledge, all agents get orders whenever
    something has happened. With local knowledge, an agent senses its surroundings and then decides every
    `Radio.period`, when its own task or flight ends, and when it joins, returns or is recharged.

    Parameters
    ----------
    mission : Mission
    knowledge : {"full", "local"}, optional
        By default that of the mission.
    seed : int
        Seed of message losses, together with that of the mission.
    aware : bool
        Whether to keep track of agents' knowledge, which a replay does not need.

    Attributes
    ----------
    mission : Mission
    state : MissionState
    knowledge : Knowledge
    log : Log
    messages, bytes : list of int
        Number of messages and of bytes that each agent has sent so far.
    """

    def __init__(
        self, mission: Mission, knowledge: Knowledge | str | None = None, seed: int = 0, *, aware: bool = True
    ) -> None:
        of_type(mission, Mission, "mission")
        self.knowledge = mission.knowledge if knowledge is None else choice(Knowledge, knowledge, "knowledge")
        self.mission, self.state = mission, MissionState(mission)
        self.log = Log(self.state)
        self.messages, self.bytes = [0] * mission.instance.n, [0] * mission.instance.n
        self._channel = Channel(self.state, checked_seed(seed))
        self._is_local = self.knowledge is Knowledge.LOCAL
        self._awareness: Awareness | None = None
        if aware:
            self._awareness = LocalAwareness(self.state) if self._is_local else FullAwareness(self.state)
        self._agenda = Agenda()
        self._tick = 0
        self._changes = Changes(self.state, self._agenda)
        self._deciding: dict[int, AgentState] = {}
        self._looked: set[int] = set()
        self._is_news = False
        for event in mission.timeline:
            self._agenda.push(event.hour, Turn.EVENT, event)
        for task in self.state.tasks:
            if task.facts.deadline < math.inf:
                self._agenda.push(task.facts.deadline, Turn.DEADLINE, task)
        if self._is_local:
            self._agenda.push(0.0, Turn.RADIO, None)
        self._requests = self._run()

    def advance(self) -> Request | None:
        """Run up to the next request for messages or orders, and return it; None at the end of the mission."""
        return next(self._requests, None)

    def view(self, agent: str | None, *, is_glance: bool = False) -> View:
        """Return the present view of an agent, or of a central policy.

        Parameters
        ----------
        agent : str or None
            Id of the agent; None for a central policy.
        is_glance : bool
            Whether to hand over the received messages once more in the next view.
        """
        assert self._awareness is not None
        return self._awareness.view(None if agent is None else self.state.agent(agent), is_glance=is_glance)

    def send(self, agent: str, message: Message | int) -> None:
        """Send a message of an agent, at a request for messages.

        Parameters
        ----------
        agent : str
            Its id.
        message : Message or int
            The message; in a replay only its size in bytes.
        """
        sender, size = self.state.agent(agent), message if isinstance(message, int) else message.size
        hearers = self._channel.hearers(sender, self._tick)
        self.messages[sender.index] += 1
        self.bytes[sender.index] += size
        self.log.message(sender, size, [hearer.facts.id for hearer in hearers])
        if isinstance(message, Message) and hearers:
            self._agenda.push(self.state.hour + self.mission.radio.delay, Turn.DELIVERY, Delivery(message, hearers))

    def order(self, agent: str, order: Order, *, trusted: bool = False) -> str | None:
        """Give an agent an order, at a request for orders; return why it is refused, None if it is followed.

        Parameters
        ----------
        agent : str
            Its id.
        order : Order
            The new order; no order is needed to continue the present one.
        trusted : bool
            Whether to skip the check that the agent knows the task.
        """
        receiver = self.state.agent(agent)
        if order == receiver.order:
            return None
        problem = None
        if order.task is not None and not trusted and self._awareness is not None:
            problem = self._awareness.objection(receiver, order.task)
        if problem is None:
            left = receiver.task
            problem = obey(self.state, receiver, order)
            if problem is None:
                self._changes.note_agent(receiver, left)
        self.log.order(receiver, order, problem)
        if problem is None and receiver.flight is None and order != STAY:  # arrived at once
            self.log.arrival(receiver, receiver.task)
        if problem is None and self._awareness is not None and not self._is_local:
            self._awareness.look_around([receiver])
        return problem

    def refuse(self, agent: str, order: Order, reason: str) -> None:
        """Record a refused order, in a replay.

        Parameters
        ----------
        agent : str
            Its id.
        order : Order
        reason : str
        """
        self.log.order(self.state.agent(agent), order, reason)

    def _run(self) -> Iterator[Request]:
        state = self.state
        while not self._is_over() and self._agenda.hour <= self.mission.end:
            state.hour, self._is_news = self._agenda.hour, False
            self._looked.clear()
            while self._agenda.hour == state.hour:
                turn, item = self._agenda.pop()
                if turn is Turn.RADIO:
                    yield from self._talk()
                else:
                    self._take(turn, item)
                self._changes.balance()
            agents = self._who_decides()
            if agents and not self._is_over():
                self._look(agents)
                if self._awareness is not None:
                    self._awareness.refresh()
                yield Request(Wanted.ORDERS, state.hour, tuple(agent.facts.id for agent in agents))
                self._changes.balance()
        self._finish()

    def _take(self, turn: Turn, item: object) -> None:
        """Process an entry of the agenda, unless it is void by now."""
        if isinstance(item, Event):
            self._happen(item)
        elif isinstance(item, Arrival):
            if item.agent.flight is item.flight:
                self._arrive(item)
        elif isinstance(item, Delivery):
            for agent in item.hearers:
                if agent.status in ACTIVE and not self._channel.is_silent(agent) and self._awareness is not None:
                    self._awareness.hear(agent, item.message)
        elif isinstance(item, Completion):
            if item.task.status is TaskStatus.OPEN and item.task.version == item.version:
                self._close(item.task, TaskStatus.DONE)
        elif isinstance(item, TaskState) and item.status is TaskStatus.OPEN:
            self._close(item, status_at_deadline(self.state, item))

    def _happen(self, event: Event) -> None:
        self.log.event(event)
        if event.kind is EventKind.RADIO_SILENT:
            self._channel.silence(event)
        elif event.agent is not None:
            agent = self.state.agent(event.agent)
            left = agent.task
            happen(self.state, event)
            self._changes.note_agent(agent, left)
            self._deciding[agent.index] = agent
        else:
            task = self.state.task(event.task)
            workers = tuple(task.workers.values())
            was_open = task.status in (TaskStatus.OPEN, TaskStatus.TO_COME)
            happen(self.state, event)
            self._ended(task, workers)
            if was_open and task.status is TaskStatus.DONE:
                self.log.closed(task)
        self._is_news = True

    def _close(self, task: TaskState, status: TaskStatus) -> None:
        workers = tuple(task.workers.values())
        close(self.state, task, status)
        self._ended(task, workers)
        self.log.closed(task)
        self._is_news = True

    def _ended(self, task: TaskState, workers: tuple[AgentState, ...]) -> None:
        """Note a changed task; agents that no longer work there have to decide."""
        self._changes.note_task(task)
        for agent in workers:
            self._changes.note_agent(agent)
            if agent.task is None:
                self._deciding[agent.index] = agent

    def _arrive(self, arrival: Arrival) -> None:
        agent, task = arrival.agent, arrival.flight.task
        land(self.state, agent)
        self._changes.note_agent(agent, task)
        self.log.arrival(agent, task)
        if agent.status is AgentStatus.IDLE:
            self._deciding[agent.index] = agent
            self._is_news = True

    def _talk(self) -> Iterator[Request]:
        """Let all agents in the mission sense and send messages, and schedule their decisions."""
        active = [agent for agent in self.state.agents if agent.status in ACTIVE]
        self._look(active)
        self._channel.open()
        self._deciding.update((agent.index, agent) for agent in active)
        senders = tuple(agent.facts.id for agent in active if not self._channel.is_silent(agent))
        if senders:
            yield Request(Wanted.MESSAGES, self.state.hour, senders)
        self._tick += 1
        self._agenda.push(self._tick * self.mission.radio.period, Turn.RADIO, None)

    def _look(self, agents: list[AgentState]) -> None:
        """Let those agents sense that have not done so at this hour."""
        if self._is_local and self._awareness is not None:
            self._awareness.look_around([agent for agent in agents if agent.index not in self._looked])
            self._looked.update(agent.index for agent in agents)

    def _who_decides(self) -> list[AgentState]:
        """Return the agents that get orders now, in the order of the mission."""
        deciding, self._deciding = self._deciding, {}
        if self._is_local:
            return [deciding[index] for index in sorted(deciding) if deciding[index].status in ACTIVE]
        return [agent for agent in self.state.agents if agent.status in ACTIVE] if self._is_news else []

    def _is_over(self) -> bool:
        """Whether no task is open or still to come, or no agent is left, now or later."""
        left = any(task.status in (TaskStatus.OPEN, TaskStatus.TO_COME) for task in self.state.tasks)
        return not left or all(agent.status is AgentStatus.FAILED for agent in self.state.agents)

    def _finish(self) -> None:
        """End the mission: flights end, agents that return fly home, and all ledgers are checked."""
        if not self._is_over() and self.mission.end < self._agenda.hour < math.inf:
            self.state.hour = self.mission.end
        for task in self.state.tasks:
            bring_up_to_date(self.state, task)
        end_flights(self.state)
        conservation.check(self.state)
