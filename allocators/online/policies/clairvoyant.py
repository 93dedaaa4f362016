"""The policy `clairvoyant`: routes planned with knowledge of the future, as a reference for other policies."""

from typing import ClassVar

from alloc.allocators.online.contract import Briefing, FleetDecider, PolicyInfo
from alloc.allocators.online.policies.routes import RoutePlanner, Routes, RoutesParameters
from alloc.allocators.online.routes.describe import Foresight
from alloc.allocators.online.routes.situation import CANCELLED, CHANGED, CHARGED, IN, OPENS, OUT
from alloc.problems.missions.events import Event, EventKind
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.reports import TaskReport, View, report_agent
from alloc.problems.missions.simulation.state import MissionState, TaskStatus

KINDS = {
    EventKind.AGENT_JOINS: IN,
    EventKind.AGENT_RETURNS: IN,
    EventKind.AGENT_FAILS: OUT,
    EventKind.AGENT_RECALLED: OUT,
    EventKind.AGENT_RECHARGES: CHARGED,
    EventKind.TASK_APPEARS: OPENS,
    EventKind.TASK_CHANGES: CHANGED,
    EventKind.TASK_CANCELLED: CANCELLED,
}
"""Kind of each event in the schedule of a plan."""


class Clairvoyant(Routes):
    """Routes planned with knowledge of the whole mission: what could have been achieved, not a policy for use.

    It knows all of the future but the pace. Its mission time is not a proven bound, as the search may miss better
    plans; `mission_time_lower_bound` is one.
    """

    info = PolicyInfo(name="clairvoyant", summary="routes, planned knowing the future", central=True, clairvoyant=True)
    parameters_type: ClassVar[type] = RoutesParameters

    def begin(self, briefing: Briefing) -> FleetDecider:
        """Return the planner of all routes."""
        assert briefing.mission is not None
        return _Clairvoyant(self.parameters, briefing, briefing.mission)


class _Clairvoyant(RoutePlanner):
    def __init__(self, parameters: RoutesParameters, briefing: Briefing, mission: Mission) -> None:
        super().__init__(parameters, briefing)
        state = MissionState(mission)
        self._events = [event for event in mission.timeline if event.kind in KINDS]
        self._agents = {agent.facts.id: report_agent(state, agent) for agent in state.agents}
        self._tasks = {
            task.facts.id: TaskReport(task.facts, 0.0, TaskStatus.TO_COME, task.workload) for task in state.tasks
        }

    def foresight(self, view: View) -> Foresight:
        """Return everything that happens after the hour of a view."""
        events = [event for event in self._events if event.hour > view.hour]
        kinds = {event.task for event in events if event.kind is EventKind.TASK_APPEARS}
        joining = {event.agent for event in events if event.kind is EventKind.AGENT_JOINS}
        return Foresight(
            {name: task for name, task in self._tasks.items() if name in kinds},
            {name: agent for name, agent in self._agents.items() if name in joining},
            [self._line(event) for event in events],
        )

    @staticmethod
    def _line(event: Event) -> tuple[float, int, str, float]:
        amount = event.amount if event.kind is EventKind.AGENT_RECHARGES else event.workload
        name = event.task if event.agent is None else event.agent
        return event.hour, KINDS[event.kind], str(name), 0.0 if amount is None else amount
