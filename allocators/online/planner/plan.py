"""Plans: the order of each agent, its changes from the previous plan, and their causes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from alloc.allocators.online.planner.estimate import News
from alloc.problems.missions.simulation.state import Order

MAX_CAUSES = 3
"""Number of causes that are listed for a change without a specific cause."""


@dataclass(frozen=True)
class OrderChange:
    """An order that differs from the previous plan.

    Attributes
    ----------
    agent : str
    before, after : Order or None
        None if the agent takes no orders.
    cause : str
        What happened since: to the agent, to one of the two tasks, or otherwise in the mission.
    """

    agent: str
    before: Order | None
    after: Order | None
    cause: str


@dataclass(frozen=True)
class Plan(Mapping[str, Order]):
    """Orders of all agents that take orders, by agent id.

    Attributes
    ----------
    hour : float
    orders : mapping of str to Order
    is_new : bool
        Whether the policy answered in time; otherwise these are the last orders that can still be followed.
    problem : str or None
        Error of the policy, if it failed.
    changes : tuple of OrderChange
    """

    hour: float = 0.0
    orders: Mapping[str, Order] = field(default_factory=lambda: MappingProxyType({}))
    is_new: bool = False
    problem: str | None = None
    changes: tuple[OrderChange, ...] = ()

    def __getitem__(self, agent: str) -> Order:
        return self.orders[agent]

    def __iter__(self) -> Iterator[str]:
        return iter(self.orders)

    def __len__(self) -> int:
        return len(self.orders)


def changes_of(
    before: Mapping[str, Order], after: Mapping[str, Order], news: Sequence[News]
) -> tuple[OrderChange, ...]:
    """Return the orders that differ, each with its cause among the news since the previous plan."""
    names = dict.fromkeys((*before, *after))
    changed = [name for name in names if before.get(name) != after.get(name)]
    if not changed:
        return ()
    about: dict[tuple[str, str], list[News]] = {}
    for one in news:
        for kind, subject in (("agent", one.agent), ("task", one.task)):
            if subject is not None:
                about.setdefault((kind, subject), []).append(one)
    events = _descriptions(news)
    more = f" and {len(events) - MAX_CAUSES} more" if len(events) > MAX_CAUSES else ""
    general = "; ".join(events[:MAX_CAUSES]) + more if events else "a better plan was found"
    return tuple(
        OrderChange(name, before.get(name), after.get(name), _cause(name, before, after, about) or general)
        for name in changed
    )


def _cause(
    name: str, before: Mapping[str, Order], after: Mapping[str, Order], about: Mapping[tuple[str, str], list[News]]
) -> str:
    """Return what happened to an agent and to its previous and new task; empty if nothing did."""
    orders = (before.get(name), after.get(name))
    tasks = [order.task for order in orders if order is not None and order.task is not None]
    return "; ".join(
        _descriptions(
            [*about.get(("agent", name), ()), *(one for task in tasks for one in about.get(("task", task), ()))]
        )
    )


def _descriptions(news: Sequence[News]) -> list[str]:
    """Return news as text; routine reports only if there is nothing else."""
    major = [one for one in news if not one.is_minor]
    return list(dict.fromkeys(map(description, major or news)))


def description(news: News) -> str:
    """Return a piece of news as text."""
    subjects = (("agent", news.agent), ("task", news.task))
    subject = "".join(f"{kind} {name} " for kind, name in subjects if name is not None)
    return f"{subject}{news.text} at {news.hour:g}"
