"""The policies `idle`, `random` and `nearest`."""

from alloc.allocators.online.contract import AgentDecider, Briefing, Policy, PolicyInfo
from alloc.allocators.online.policies.exploring import Explorer
from alloc.problems.missions.simulation.reports import Message, TaskReport, View
from alloc.problems.missions.simulation.state import STAY, Order, TaskStatus


class Idle(Policy):
    """No agent does anything: the baseline of what happens without any orders."""

    info = PolicyInfo(name="idle", summary="no agent does anything")

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return a decider that stays where it is and sends nothing."""
        return _Idle()


class _Idle(AgentDecider):
    def decide(self, view: View) -> Order | None:
        return STAY

    def message(self, view: View) -> Message | None:
        return None


class RandomTask(Policy):
    """Each agent takes a random task among those that it knows and can take, and stays with it until it is closed."""

    info = PolicyInfo(name="random", summary="a random task that the agent knows and can take, until it is closed")

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return the decider of an agent."""
        return _RandomTask(briefing)


class Nearest(Policy):
    """Each agent takes the nearest task that it knows and can take, and stays with it until it is closed."""

    info = PolicyInfo(name="nearest", summary="the nearest task that the agent knows and can take, until it is closed")

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return the decider of an agent."""
        return _Nearest(briefing)


class _UntilOver(AgentDecider):
    """A decider that stays with its task until it is closed, and then chooses another."""

    def __init__(self, briefing: Briefing) -> None:
        self._explorer, self._rng = Explorer(briefing), briefing.generator()

    def decide(self, view: View) -> Order | None:
        if has_open_task(view):
            return None
        tasks = view.open_tasks(view.own)
        return Order(self._choice(view, tasks).facts.id) if tasks else self._explorer.order(view)

    def _choice(self, view: View, tasks: list[TaskReport]) -> TaskReport:
        raise NotImplementedError


class _RandomTask(_UntilOver):
    def _choice(self, view: View, tasks: list[TaskReport]) -> TaskReport:
        return tasks[int(self._rng.integers(len(tasks)))]


class _Nearest(_UntilOver):
    def _choice(self, view: View, tasks: list[TaskReport]) -> TaskReport:
        return min(tasks, key=lambda task: view.distance(view.own, task))


def has_open_task(view: View) -> bool:
    """Whether the agent has a task that, as far as it knows, is open."""
    task = view.own.task
    return task is not None and task in view.tasks and view.tasks[task].status is TaskStatus.OPEN
