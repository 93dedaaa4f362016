"""The policy `auction`: agents bid for tasks and agree on the winners through their messages (CBAA)."""

import math
from dataclasses import dataclass
from typing import ClassVar

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.online.contract import AgentDecider, Briefing, Policy, PolicyInfo
from alloc.allocators.online.policies.exploring import Explorer
from alloc.problems.missions.simulation.reports import Message, TaskReport, View
from alloc.problems.missions.simulation.state import ACTIVE, AgentStatus, Order, TaskStatus


@dataclass(frozen=True)
class AuctionPolicyParameters(CheckedParameters):
    """Parameters of the auction.

    Attributes
    ----------
    memory : float
        Hours after which a bid that is not renewed expires.
    stay : float
        Factor on an agent's bid for its present task when compared with bids for others; with ``inf`` it keeps the task
        as long as it has a seat there.
    seats : float
        Factor on the number of seats of a task.
    flight : float
        Weight of an hour of flight relative to an hour of work.
    age : float
        Rate, per hour, at which bids decay with the age of the information on the task.
    """

    memory: float = bounded(1.0, low=0)
    stay: float = bounded(math.inf, low=1, infinite=True)
    seats: float = bounded(1.0, low=0)
    flight: float = bounded(1.0, low=0)
    age: float = bounded(0.0, low=0)


@dataclass(frozen=True)
class _Bid:
    task: str
    amount: float
    hour: float


class ConsensusAuction(Policy):
    """Each agent bids for one task at a time; a task has as many seats as there are agents per open task.

    Every message carries bids, and newer ones replace older ones. An agent that is outbid for all seats of its task
    bids for another one. A bid is the fraction of time that the agent would work rather than fly, times the priority.
    Unlike in the paper, a task has several winners, and agents bid for single tasks rather than bundles.

    References
    ----------
    Choi, Brunet and How (2009), doi:10.1109/TRO.2009.2022423: the consensus-based auction algorithm.
    """

    info = PolicyInfo(
        name="auction",
        summary="agents bid for tasks and agree on the winners by what they hear (CBAA)",
        citation="Choi, Brunet and How (2009), doi:10.1109/TRO.2009.2022423",
    )
    parameters_type: ClassVar[type] = AuctionPolicyParameters

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return the bidder of an agent."""
        return _Bidder(briefing, self.parameters)


class _Bidder(AgentDecider):
    def __init__(self, briefing: Briefing, parameters: AuctionPolicyParameters) -> None:
        self._explorer, self._parameters = Explorer(briefing), parameters
        self._bids: dict[str, _Bid] = {}

    def decide(self, view: View) -> Order | None:
        for message in view.heard:
            self._take_over(message)
        own = view.own
        self._hear_of_orders(view)
        seats, best, highest, bid = self._seats(view), None, 0.0, 0.0
        for task in view.open_tasks(own):
            name, amount = task.facts.id, self._amount(view, task, seats)
            value = amount * (self._parameters.stay if name == own.task and amount > 0 else 1.0)
            if value > highest and not self._is_outbid(view, name, amount, seats):
                best, highest, bid = name, value, amount
        self._bids.pop(own.facts.id, None)
        if best is None:
            return self._explorer.order(view)
        self._bids[own.facts.id] = _Bid(best, bid, view.hour)
        return Order(best)

    def _seats(self, view: View) -> int:
        agents = sum(report.status in ACTIVE for report in view.agents.values())
        tasks = sum(report.status is TaskStatus.OPEN for report in view.tasks.values())
        return max(1, math.ceil(self._parameters.seats * agents / max(1, tasks)))

    def _amount(self, view: View, task: TaskReport, seats: int) -> float:
        own = view.own
        is_there = own.status is AgentStatus.WORKING and own.task == task.facts.id
        flight = 0.0 if is_there else view.hours(own, task)
        work = (task.left + 1e-9) / (own.facts.ability * seats)
        is_late = view.hour + flight >= task.facts.deadline
        if is_late:
            return 0.0
        share = work / (work + self._parameters.flight * flight)
        return (task.facts.priority + 1e-6) * share * math.exp(-self._parameters.age * (view.hour - task.hour))

    def _is_outbid(self, view: View, task: str, amount: float, seats: int) -> bool:
        """Whether other agents hold all seats of a task with higher bids; ids break ties."""
        own = view.own.facts.id
        higher = [
            name
            for name, bid in self._bids.items()
            if name != own
            and bid.task == task
            and view.hour - bid.hour <= self._parameters.memory
            and (bid.amount, name) > (amount, own)
        ]
        return len(higher) >= seats

    def _hear_of_orders(self, view: View) -> None:
        """Drop the bids of agents that have since been seen on their way to another task."""
        for name, report in view.agents.items():
            bid = self._bids.get(name)
            if bid is not None and report.hour > bid.hour and report.task != bid.task:
                del self._bids[name]

    def _take_over(self, message: Message) -> None:
        notes = message.notes
        for name, task, amount, hour in zip(notes[::4], notes[1::4], notes[2::4], notes[3::4], strict=True):
            known = self._bids.get(str(name))
            if known is None or known.hour < float(hour):
                self._bids[str(name)] = _Bid(str(task), float(amount), float(hour))

    def message(self, view: View) -> Message | None:
        bids = ((name, bid.task, bid.amount, bid.hour) for name, bid in self._bids.items())
        return view.message(tuple(value for bid in bids for value in bid))
