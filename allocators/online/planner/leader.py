"""A policy that decides in a thread of its own, so that whoever waits for it need not wait longer than it wants."""

import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from queue import SimpleQueue
from types import MappingProxyType

from alloc.allocators.online.contract import AgentDecider, Briefing, FleetDecider, Policy, PolicyError
from alloc.allocators.online.planner.register import MOST_OVER
from alloc.allocators.online.planner.state import LiveState
from alloc.problems.missions.simulation.reports import AgentReport, View
from alloc.problems.missions.simulation.state import STAY, AgentStatus, Order
from alloc.problems.vocabulary import Knowledge

DECISION_SHARE = 0.6
"""Part of the deadline that a policy is told it has: the rest is for the view before, and the orders after."""


class Decision:
    """One decision of a policy.

    Parameters
    ----------
    until : float

    Attributes
    ----------
    until : float
        When nobody waits for it any more, as `time.perf_counter` says.
    version, seen : int
        Of what was known when it began, and how much had been told; -1 before.
    orders : dict of str to Order
        Given so far; one agent after the other where the policy decides for each.
    done : threading.Event
    is_whole : bool
        Whether the policy answered for all.
    problem : str or None
        Why it failed.
    """

    def __init__(self, until: float) -> None:
        self.version = self.seen = -1
        self.orders: dict[str, Order] = {}
        self.done = threading.Event()
        self.is_whole = False
        self.problem: str | None = None
        self.until = until

    @property
    def is_overdue(self) -> bool:
        """Whether nobody waits for it any more."""
        return time.perf_counter() > self.until

    def is_stale(self, version: int) -> bool:
        """Return whether it is of no use for who asks now, when this is the version of what is known."""
        is_over = self.is_whole or self.problem is not None
        return self.version not in (-1, version) or (self.is_overdue and not is_over)


class Leader:
    """Lets a policy decide, one decision at a time.

    Parameters
    ----------
    policy : Policy
    seed : int
    deadline_s : float or None
    state : LiveState
    look : callable
        Returns the view of what is known, and notes its version in a decision.

    Attributes
    ----------
    last : Decision or None
        The last one for which the policy answered for all.
    """

    def __init__(
        self,
        policy: Policy,
        seed: int,
        deadline_s: float | None,
        state: LiveState,
        look: Callable[[Decision], View],
    ) -> None:
        share = None if deadline_s is None else DECISION_SHARE * deadline_s
        self._policy, self._state, self._look = policy, state, look
        self._briefing = Briefing.of(state.mission, Knowledge.FULL, seed, share, None)
        begun = policy.begin(self._briefing) if policy.info.central else None
        if policy.info.central and not isinstance(begun, FleetDecider):
            raise PolicyError(f"policy {policy.info.name!r} is central, but began with a {type(begun).__name__}")
        self._fleet = begun if isinstance(begun, FleetDecider) else None
        self._turns = None if policy.info.central else policy.begin_turns(self._briefing)
        self._agents: dict[str, AgentDecider] = {}
        self._broken_off = ""
        self.last: Decision | None = None
        self._wanted: SimpleQueue[Decision | None] = SimpleQueue()
        self._wanted_last: Decision | None = None
        self._thread = threading.Thread(target=self._work, name="alloc-planner", daemon=True)
        self._thread.start()

    def request(self, version: int, until: float) -> Decision:
        """Return a decision to be made as soon as those before it are; what it is about is looked at then.

        Parameters
        ----------
        version : int
            Of what is known now; a decision about this, or one that has not begun, is requested only once.
        until : float
            When it is of no use any more, as `time.perf_counter` says.
        """
        decision = self._wanted_last
        if decision is None or decision.is_stale(version):
            decision = self._wanted_last = Decision(until)
            self._wanted.put(decision)
        decision.until = max(decision.until, until)
        return decision

    def close(self) -> None:
        """End the thread once the decision in hand is made."""
        self._wanted.put(None)

    def _work(self) -> None:
        while (decision := self._wanted.get()) is not None:
            try:
                if not decision.is_overdue:
                    self._decide(self._look(decision), decision)
            except Exception as error:  # whatever a policy does, the last plan stands
                decision.problem = f"{type(error).__name__}: {error}"
            decision.done.set()
            del decision

    def _decide(self, view: View, decision: Decision) -> None:
        if self._fleet is not None:
            orders = self._fleet.decide(view)
            if not isinstance(orders, Mapping):
                raise PolicyError(f"it answered {type(orders).__name__}, not orders by agent")
            decision.orders.update({name: _order(order) for name, order in orders.items()})
            self._finish(decision)
            return
        names = list(view.agents)
        first, self._broken_off = self._broken_off, ""
        if first in view.agents:
            names = [*names[names.index(first) :], *names[: names.index(first)]]
        turns = self._turns.turns(view, names) if self._turns is not None else self._one_by_one(view, names)
        for number, (name, order) in enumerate(turns, 1):
            if order is not None:
                decision.orders[name] = _order(order)
            if decision.is_overdue and number < len(names):
                self._broken_off = names[number]  # the next one begins there, so that everybody's turn comes
                return
        self._finish(decision)

    def _finish(self, decision: Decision) -> None:
        decision.is_whole, self.last = True, decision

    def _one_by_one(self, view: View, names: list[str]) -> Iterator[tuple[str, Order | None]]:
        self._forget_deciders(len(names))
        agents = dict(view.agents)
        distances, known = self._state.distances, MappingProxyType(agents)
        for name in names:
            order = self._decider(name).decide(View(view.hour, name, known, view.tasks, distances))
            if order is not None:
                agents[name] = _ordered(agents[name], _order(order))
            yield name, order

    def _forget_deciders(self, count: int) -> None:
        """Keep those of agents that are known, where far more have been than there are agents."""
        if len(self._agents) > 2 * (count + MOST_OVER):
            known = self._state.all_agents
            self._agents = {name: decider for name, decider in self._agents.items() if name in known}

    def _decider(self, name: str) -> AgentDecider:
        if name not in self._agents:
            seed = (self._briefing.seed[0], self._state.agent(name).index + 1)
            begun = self._policy.begin(replace(self._briefing, agent=name, seed=seed))
            if not isinstance(begun, AgentDecider):
                raise PolicyError(f"it is not central, but began with a {type(begun).__name__}")
            self._agents[name] = begun
        return self._agents[name]


def _ordered(report: AgentReport, order: Order) -> AgentReport:
    """Return an agent as others know it once it has an order."""
    if order.task == report.task:
        return report
    status = AgentStatus.IDLE if order == STAY else AgentStatus.FLYING
    return replace(report, task=order.task, status=status)


def _order(order: object) -> Order:
    if not isinstance(order, Order):
        raise PolicyError(f"it answered {order!r}, which is no Order")
    if order.position is not None and not all(math.isfinite(axis) for axis in order.position):
        raise PolicyError(f"it answered {order!r}, which leads nowhere")
    return order
