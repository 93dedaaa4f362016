"""The policy `greedy`: each agent goes where most of its time is work."""

import math
from dataclasses import dataclass
from typing import ClassVar

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.online.contract import AgentDecider, Briefing, Policy, PolicyInfo
from alloc.allocators.online.policies.exploring import Explorer
from alloc.allocators.online.policies.outlook import Prospect, prospects
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.state import Order


@dataclass(frozen=True)
class GreedyParameters(CheckedParameters):
    """Parameters of the utility; the defaults are tuned on missions as `gappo` is evolved on.

    Attributes
    ----------
    stay : float
        Factor on the utility of the task that an agent has already.
    memory : float
        Hours after which what was heard of others no longer counts.
    missed : float
        Factor on the utility of a task that will miss its deadline even with the agent.
    crowding : float
        How much each other agent that is at a task, or on its way there, takes away from its utility.
    flight : float
        How fast utility falls with the hours of the flight.
    """

    stay: float = bounded(2.3, low=0)
    memory: float = bounded(1.8, low=0)
    missed: float = bounded(0.025, low=0)
    crowding: float = bounded(0.05, low=0)
    flight: float = bounded(0.07, low=0)


class GreedyUtility(Policy):
    """Each agent takes the task of highest utility by what it knows, whenever it decides.

    The utility of a task is its priority times the share of the time until it is done that the agent would work there,
    rather than fly: so it prefers what is near, large, and not yet well served.
    """

    info = PolicyInfo(name="greedy", summary="where most of the agent's time is work, by what it knows")
    parameters_type: ClassVar[type] = GreedyParameters

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return who takes the task of highest utility."""
        return _Greedy(briefing, self.parameters)


class _Greedy(AgentDecider):
    def __init__(self, briefing: Briefing, parameters: GreedyParameters) -> None:
        self._explorer, self._parameters = Explorer(briefing), parameters

    def decide(self, view: View) -> Order | None:
        best, highest = None, 0.0
        for prospect in prospects(view, self._parameters.memory):
            value = self._utility(view, prospect)
            if value > highest:
                best, highest = prospect, value
        return self._explorer.order(view) if best is None else Order(best.task.facts.id)

    def _utility(self, view: View, prospect: Prospect) -> float:
        if not prospect.is_useful:
            return 0.0
        facts, parameters = prospect.task.facts, self._parameters
        hours = prospect.with_me - view.hour
        share = 1.0 if hours <= 0 else (prospect.with_me - prospect.arrival) / hours
        value = share * (facts.priority + 1e-6) / (1 + parameters.crowding * prospect.group)
        value *= math.exp(-parameters.flight * (prospect.arrival - view.hour))
        if prospect.with_me > facts.deadline:
            value *= parameters.missed
        return value * (parameters.stay if view.own.task == facts.id else 1.0)
