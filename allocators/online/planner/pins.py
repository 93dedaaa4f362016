"""Agents that the user has pinned to a task: no policy sends them elsewhere."""

from alloc.allocators.online.planner.estimate import News, StateEstimate
from alloc.problems.arguments import shown, text
from alloc.problems.errors import InputError
from alloc.problems.missions.simulation.state import ACTIVE, STAY, Order, TaskStatus


class Pins:
    """The task of each pinned agent.

    Parameters
    ----------
    estimate : StateEstimate
        The estimated state; changes of pins are added to its news.

    Attributes
    ----------
    tasks : dict of str to str or None
        Task ids by agent id; None to stay.
    """

    def __init__(self, estimate: StateEstimate) -> None:
        self._estimate = estimate
        self.tasks: dict[str, str | None] = {}

    def add(self, agent: str, task: str | None) -> None:
        """Pin an agent; raise `InputError` if it cannot take the task now."""
        status = self._estimate.state.agent(text(agent, "agent")).status
        if task is not None:
            problem = self._estimate.refusal(agent, text(task, "task"))
        else:
            problem = None if status in ACTIVE else f"the agent is {status}"
        if problem is not None:
            raise InputError(f"cannot be pinned: {problem}", "agent")
        self.tasks[agent] = task
        self._estimate.add_news(News(self._estimate.state.hour, "was pinned", agent))

    def remove(self, agent: str) -> None:
        """Unpin an agent; raise `InputError` if it is not pinned."""
        if text(agent, "agent") not in self.tasks:
            raise InputError(f"{shown(agent)} is not pinned", "agent")
        del self.tasks[agent]
        self._estimate.add_news(News(self._estimate.state.hour, "was unpinned", agent))

    def lapse(self) -> None:
        """Remove the pins of closed tasks and of failed agents."""
        if not self.tasks:
            return
        state = self._estimate.state
        there = {agent.facts.id for agent in state.agents}
        tasks = {None, *(task.facts.id for task in state.tasks if task.status is TaskStatus.OPEN)}
        self.tasks = {agent: task for agent, task in self.tasks.items() if agent in there and task in tasks}

    def order(self, agent: str) -> Order | None:
        """Return the order of a pinned agent; None if it is not pinned."""
        if agent not in self.tasks:
            return None
        task = self.tasks[agent]
        return STAY if task is None else Order(task)
