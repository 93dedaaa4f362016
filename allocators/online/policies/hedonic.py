"""The policy `hedonic`: a coalition-formation game on received messages (GRAPE)."""

from dataclasses import dataclass
from typing import ClassVar

from alloc.allocators.contract.parameters import bounded
from alloc.allocators.online.contract import AgentDecider, Briefing, Policy, PolicyInfo
from alloc.allocators.online.policies.exploring import Explorer
from alloc.allocators.online.policies.outlook import UtilityParameters, prospects, utility
from alloc.problems.missions.chance import uniform
from alloc.problems.missions.simulation.reports import Message, View
from alloc.problems.missions.simulation.state import Order, TaskStatus

STAMP = 13
"""First part of the key of random stamps; see `alloc.problems.missions.chance`."""


@dataclass(frozen=True)
class HedonicPolicyParameters(UtilityParameters):
    """Parameters of a coalition's utility; the defaults are tuned.

    A stable partition exists if each further member lowers the utility (`crowding`). `stay` applies to the coalition
    that an agent is in, and `memory` to agents that were not heard of.
    """

    stay: float = bounded(7.5, low=1)
    memory: float = bounded(4.9, low=0)
    missed: float = bounded(0.61, low=0)
    crowding: float = bounded(0.086, low=0)
    flight: float = bounded(0.0125, low=0)
    age: float = bounded(0.066, low=0)


class HedonicCoalitions(Policy):
    """Each agent holds one partition of the agents into coalitions, and joins the coalition of highest utility.

    It sends its partition with the number of changes and a random stamp. Among its own and the received partitions, it
    adopts the one with the most changes, then the highest stamp.

    References
    ----------
    Jang, Shin and Tsourdos (2018), doi:10.1109/TRO.2018.2858292.
    """

    info = PolicyInfo(
        name="hedonic",
        summary="coalition-formation game on received messages (GRAPE)",
        citation="Jang, Shin and Tsourdos (2018), doi:10.1109/TRO.2018.2858292",
    )
    parameters_type: ClassVar[type] = HedonicPolicyParameters

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return the decider of an agent."""
        return _Member(briefing, self.parameters)


class _Member(AgentDecider):
    def __init__(self, briefing: Briefing, parameters: HedonicPolicyParameters) -> None:
        self._explorer, self._seed = Explorer(briefing), briefing.seed
        self._parameters = parameters
        self._changes, self._stamp, self._moves = 0.0, 0.0, 0
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
            value = utility(view.hour, prospect, self._parameters, is_own=name == home)
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
        self._moves += 1
        self._stamp = uniform(STAMP, *self._seed, self._moves)

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
