"""Decisions of a policy in a worker thread, so that callers can stop waiting at their deadline."""

import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from queue import SimpleQueue
from types import MappingProxyType

from alloc.allocators.online.contract import AgentDecider, Briefing, FleetDecider, Policy, PolicyError
from alloc.allocators.online.planner.register import KEPT_CLOSED
from alloc.allocators.online.planner.state import LiveState
from alloc.problems.missions.simulation.reports import AgentReport, View
from alloc.problems.missions.simulation.state import STAY, AgentStatus, Order
from alloc.problems.vocabulary import Knowledge

DECISION_SHARE = 0.6
"""Share of the deadline that is given to the policy; the rest is for the view and the orders."""


class Decision:
    """One decision of a policy.

    Parameters
    ----------
    until : float

    Attributes
    ----------
    until : float
        Value of `time.perf_counter` after which no caller waits for it.
    version, seen : int
        Version of the state, and number of news, when it began; -1 before.
    orders : dict of str to Order
        Orders so far; they come one by one if the policy decides for each agent.
    done : threading.Event
    is_whole : bool
        Whether the policy has decided for all agents.
    problem : str or None
        Error of the policy, if it failed.
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
        """Whether no caller waits for it any more."""
        return time.perf_counter() > self.until

    def is_stale(self, version: int) -> bool:
        """Return whether a new decision is needed for a caller at this version of the state."""
        is_over = self.is_whole or self.problem is not None
        return self.version not in (-1, version) or (self.is_overdue and not is_over)


class PolicyRunner:
    """Runs the decisions of a policy in a worker thread, one at a time.

    Parameters
    ----------
    policy : Policy
    seed : int
    deadline_s : float or None
    state : LiveState
    look : callable
        Returns the present view, and records its version in the decision.

    Attributes
    ----------
    last : Decision or None
        The last decision that is complete.
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
        """Queue a decision and return it; it will be based on the state at the time when it begins.

        Parameters
        ----------
        version : int
            Version of the state; a queued decision, or one about this version, is shared instead of a new one.
        until : float
            Value of `time.perf_counter` after which the decision is of no use.
        """
        decision = self._wanted_last
        if decision is None or decision.is_stale(version):
            decision = self._wanted_last = Decision(until)
            self._wanted.put(decision)
        decision.until = max(decision.until, until)
        return decision

    def close(self) -> None:
        """End the thread after the decision in progress."""
        self._wanted.put(None)

    def _work(self) -> None:
        while (decision := self._wanted.get()) is not None:
            try:
                if not decision.is_overdue:
                    self._decide(self._look(decision), decision)
            except Exception as error:  # whatever a policy does, the last plan stays in force
                decision.problem = f"{type(error).__name__}: {error}"
            decision.done.set()
            del decision

    def _decide(self, view: View, decision: Decision) -> None:
        if self._fleet is not None:
            orders = self._fleet.decide(view)
            if not isinstance(orders, Mapping):
                raise PolicyError(f"it returned {type(orders).__name__}, not a mapping of orders")
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
                self._broken_off = names[number]  # the next decision begins there, so that all agents get their turn
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
        """Drop the deciders of forgotten agents once there are far more deciders than agents."""
        if len(self._agents) > 2 * (count + KEPT_CLOSED):
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
    """Return the report of an agent after it has got an order."""
    if order.task == report.task:
        return report
    status = AgentStatus.IDLE if order == STAY else AgentStatus.FLYING
    return replace(report, task=order.task, status=status)


def _order(order: object) -> Order:
    if not isinstance(order, Order):
        raise PolicyError(f"it returned {order!r}, which is not an Order")
    if order.position is not None and not all(math.isfinite(axis) for axis in order.position):
        raise PolicyError(f"it returned {order!r}, whose position is not finite")
    return order
