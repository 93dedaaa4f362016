"""The policy `hedonic`: a coalition-formation game on what was heard (GRAPE)."""

from dataclasses import dataclass
from typing import ClassVar

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.online.contract import AgentDecider, Briefing, Policy, PolicyInfo
from alloc.allocators.online.policies.exploring import Explorer
from alloc.allocators.online.policies.outlook import prospects
from alloc.problems.missions.simulation.reports import Message, View
from alloc.problems.missions.simulation.state import Order, TaskStatus


@dataclass(frozen=True)
class HedonicPolicyParameters(CheckedParameters):
    """Parameters of the game.

    Attributes
    ----------
    stay : float
        Factor on the utility of the coalition that an agent is in.
    crowding : float
        How much each member of a coalition takes away from its utility, so that a stable partition exists.
    memory : float
        Hours after which an agent that was not heard of no longer counts.
    """

    stay: float = bounded(1.5, low=1)
    crowding: float = bounded(0.5, low=0)
    memory: float = bounded(5.0, low=0)


class HedonicCoalitions(Policy):
    """Each agent believes in one partition of the agents into coalitions, and joins the one of highest utility.

    It sends its partition with the number of changes and a random stamp, and adopts the partition with most changes,
    then the highest stamp, among its own and those that it heard.

    References
    ----------
    Jang, Shin and Tsourdos (2018), doi:10.1109/TRO.2018.2858292.
    """

    info = PolicyInfo(
        name="hedonic",
        summary="coalition-formation game on what was heard (GRAPE)",
        citation="Jang, Shin and Tsourdos (2018), doi:10.1109/TRO.2018.2858292",
    )
    parameters_type: ClassVar[type] = HedonicPolicyParameters

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return who joins coalitions."""
        return _Member(briefing, self.parameters)


class _Member(AgentDecider):
    def __init__(self, briefing: Briefing, parameters: HedonicPolicyParameters) -> None:
        self._explorer, self._rng = Explorer(briefing), briefing.generator()
        self._parameters = parameters
        self._changes, self._stamp = 0.0, 0.0
        self._partition: dict[str, str] = {}

    def decide(self, view: View) -> Order | None:
        for message in view.heard:
            self._compare(message)
        own = view.own.facts.id
        over = {name for name, task in view.tasks.items() if task.status is not TaskStatus.OPEN}
        self._partition = {agent: task for agent, task in self._partition.items() if task not in over}
        home, choice, highest = self._partition.get(own), None, 0.0
        for prospect in prospects(view, self._parameters.memory, self._partition):
            name = prospect.task.facts.id
            if prospect.is_useful:
                hours = max(prospect.with_me - view.hour, 1e-12)
                value = (prospect.with_me - prospect.arrival) / hours * (prospect.task.facts.priority + 1e-6)
                value *= self._parameters.stay if name == home else 1.0
                value /= 1 + self._parameters.crowding * prospect.group
                if value > highest:
                    choice, highest = name, value
        if choice != home:
            self._move(own, choice)
        return self._explorer.order(view) if choice is None else Order(choice)

    def _move(self, own: str, choice: str | None) -> None:
        if choice is None:
            self._partition.pop(own, None)
        else:
            self._partition[own] = choice
        self._changes += 1
        self._stamp = float(self._rng.random())

    def _compare(self, message: Message) -> None:
        """Adopt the partition of a message if it takes precedence over the agent's own."""
        notes = message.notes
        if len(notes) < 2:
            return
        changes, stamp = float(notes[0]), float(notes[1])
        if (changes, stamp) > (self._changes, self._stamp):
            self._changes, self._stamp = changes, stamp
            self._partition = dict(zip(map(str, notes[2::2]), map(str, notes[3::2]), strict=True))

    def message(self, view: View) -> Message | None:
        pairs = (value for pair in self._partition.items() for value in pair)
        return view.message((self._changes, self._stamp, *pairs))
