"""The policy `greedy`: each agent goes where the largest fraction of its time would be work."""

from typing import ClassVar

from alloc.allocators.online.contract import AgentDecider, Briefing, Policy, PolicyInfo
from alloc.allocators.online.policies.exploring import Explorer
from alloc.allocators.online.policies.outlook import UtilityParameters, prospects, utility
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.state import Order


class GreedyUtility(Policy):
    """At each decision, an agent takes the task of highest utility by what it knows.

    The utility of a task is its priority times the fraction of the time until its completion that the agent would work
    there rather than fly; this favours tasks that are near, large and not yet well served.
    """

    info = PolicyInfo(name="greedy", summary="the task where the largest share of the agent's time is work")
    parameters_type: ClassVar[type] = UtilityParameters

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return the decider of an agent."""
        return _Greedy(briefing, self.parameters)


class _Greedy(AgentDecider):
    def __init__(self, briefing: Briefing, parameters: UtilityParameters) -> None:
        self._explorer, self._parameters = Explorer(briefing), parameters

    def decide(self, view: View) -> Order | None:
        best, highest = None, 0.0
        for prospect in prospects(view, self._parameters.memory):
            name = prospect.task.facts.id
            value = utility(view.hour, prospect, self._parameters, is_own=view.own.task == name)
            if value > highest:
                best, highest = name, value
        return self._explorer.order(view) if best is None else Order(best)
