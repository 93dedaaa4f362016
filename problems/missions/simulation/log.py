"""Records of what happens in a simulation (alloc-mission-log/1)."""

from alloc.problems.missions.events import Event
from alloc.problems.missions.simulation.state import AgentState, MissionState, Order, TaskState, TaskStatus

Record = dict[str, object]


class Log:
    """Records of a simulation in chronological order.

    Each has an hour and a kind: ``event`` of the mission; ``order`` to an agent; ``refused``, an order that was not
    followed; ``arrival`` of an agent at a task or a place; ``completion`` of a task; ``missed``, for a task whose
    deadline passed; ``message`` sent by an agent.

    Parameters
    ----------
    state : MissionState
        State of the simulation, which provides the hour of each record.

    Attributes
    ----------
    records : list of dict
    """

    def __init__(self, state: MissionState) -> None:
        self._state = state
        self.records: list[Record] = []

    def event(self, event: Event) -> None:
        """Record an event of the mission."""
        self._add("event", **{name: value for name, value in event.to_dict().items() if name != "hour"})

    def order(self, agent: AgentState, order: Order, refusal: str | None) -> None:
        """Record an order, with the reason if it is refused."""
        target: Record = {"agent": agent.facts.id, "task": order.task}
        if order.position is not None:
            target["position"] = list(order.position)
        if refusal is None:
            self._add("order", **target)
        else:
            self._add("refused", **target, reason=refusal)

    def arrival(self, agent: AgentState, task: TaskState | None) -> None:
        """Record that a flight ended at its goal."""
        name = None if task is None else task.facts.id
        self._add("arrival", agent=agent.facts.id, task=name, distance=agent.distance, energy=agent.energy)

    def closed(self, task: TaskState) -> None:
        """Record that a task is done or missed; cancellations are recorded as events."""
        if task.status is TaskStatus.DONE:
            self._add("completion", task=task.facts.id)
        elif task.status is TaskStatus.MISSED:
            self._add("missed", task=task.facts.id, work=task.missed)

    def message(self, agent: AgentState, size: int, heard: list[str]) -> None:
        """Record a message, its size in bytes, and its receivers."""
        self._add("message", agent=agent.facts.id, bytes=size, heard=heard)

    def _add(self, record: str, **fields: object) -> None:
        self.records.append({"hour": self._state.hour, "record": record, **fields})
