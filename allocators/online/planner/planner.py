"""A planner for the missions of another program, such as a ground station."""

import math
import threading
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from types import MappingProxyType

from alloc.allocators.online.contract import Policy
from alloc.allocators.online.planner import saved
from alloc.allocators.online.planner.checks import check_hour
from alloc.allocators.online.planner.collection import collected_later
from alloc.allocators.online.planner.estimate import StateEstimate
from alloc.allocators.online.planner.inputs import Input, Report
from alloc.allocators.online.planner.pins import Pins
from alloc.allocators.online.planner.plan import OrderChange, Plan, changes_of
from alloc.allocators.online.planner.policy_runner import Decision, PolicyRunner
from alloc.allocators.online.registry import load_policy
from alloc.problems import InputError, Instance, Mission
from alloc.problems.arguments import checked_seed, of_type, real, text
from alloc.problems.formats.files import PathLike
from alloc.problems.formats.json_text import require_object
from alloc.problems.missions.events import LATEST, Event
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.state import STAY, Order, TaskStatus

RESERVE_MS, RESERVE_SHARE = 5.0, 0.3
"""Reserve of the deadline, beside the time that waking up and giving orders took before, and its largest share."""


class MissionPlanner(AbstractContextManager["MissionPlanner"]):
    """Plans for the agents and tasks of a running mission, and answers before a deadline.

    It knows the state of the mission at hour 0; later events have to be submitted as they happen. In between, agents
    are assumed to follow their orders until they report something else. All methods may be called from any thread;
    plans are made in a separate thread.

    Parameters
    ----------
    mission : Mission or Instance
    policy : str or Policy
        A name, or a policy with its own parameters. Any policy can be used, as the planner has full knowledge.
    deadline_ms : float or None
        Milliseconds within which `plan` returns; None to wait for the policy.
    seed : int
        Seed of the policy.
    **settings
        Single parameters of a policy that is given by name.

    Raises
    ------
    InputError
        If the policy or a parameter is unknown, or an argument is invalid.
    """

    def __init__(
        self,
        mission: Mission | Instance,
        policy: str | Policy = "replan",
        deadline_ms: float | None = 100.0,
        *,
        seed: int = 0,
        **settings: object,
    ) -> None:
        of_type(mission, (Mission, Instance), "mission")
        of_type(policy, (str, Policy), "policy")
        if isinstance(policy, Policy) and settings:
            raise InputError("is an object with its own parameters; set them when you create it", "policy")
        self._deadline_s = None if deadline_ms is None else real(deadline_ms, "deadline_ms", above=True) / 1000
        self._seed = checked_seed(seed)
        self._made_of = (policy if isinstance(policy, str) else None, settings)
        chosen = load_policy(policy, **settings) if isinstance(policy, str) else policy
        self._estimate = StateEstimate(mission if isinstance(mission, Mission) else Mission.from_instance(mission))
        self._lock, self._pins = threading.RLock(), Pins(self._estimate)
        self._plan, self._version, self._planned = Plan(), 0, -1
        self._inputs_this_hour: set[str] = set()
        self._last_s, self._is_closed = 0.0, False
        self._runner = PolicyRunner(chosen, self._seed, self._deadline_s, self._estimate.state, self._look)

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the planner's thread; no further plans can be made."""
        self._is_closed = True
        self._runner.close()

    @property
    def hour(self) -> float:
        """Hour up to which events are known."""
        return self._estimate.state.hour

    def submit(self, event: Event | Report | Mapping[str, object]) -> None:
        """Submit an event of the mission, or a report of an agent.

        Parameters
        ----------
        event : Event, Report or mapping
            An event or a report, or its fields as in a file; the hour defaults to `hour`. ``task-changes`` gives the
            work left of a task, ``agent-reports`` an agent's place and battery.

        Raises
        ------
        InputError
            If a field is invalid, it was submitted before, or it cannot happen in the present state; nothing changes.
        """
        with self._lock:
            given = Input.of(event, self.hour)
            line = repr(given)
            if line in self._inputs_this_hour:
                raise InputError("was submitted before, at the same hour", "event")
            before = self.hour
            self._estimate.apply(given)
            if self.hour > before:
                self._inputs_this_hour.clear()
            self._inputs_this_hour.add(line)
            self._version += 1

    def pin(self, agent: str, task: str | None) -> None:
        """Keep an agent at a task until that is closed, whatever the policy decides; with None, where it is.

        Parameters
        ----------
        agent, task : str
            Ids.

        Raises
        ------
        InputError
            If an id is unknown, or the agent cannot take the task now.
        """
        with self._lock:
            self._pins.add(agent, task)
            self._version += 1

    def unpin(self, agent: str) -> None:
        """Let the policy decide for an agent again.

        Parameters
        ----------
        agent : str
            Its id; `InputError` if it is not pinned.
        """
        with self._lock:
            self._pins.remove(agent)
            self._version += 1

    def plan(self, hour: float | None = None) -> Plan:
        """Return the orders of all agents, new ones if the policy answers in time.

        Parameters
        ----------
        hour : float, optional
            The present hour; by default that of the last event.

        Returns
        -------
        Plan
            Orders that can be followed; the last plan if nothing has happened.

        Raises
        ------
        InputError
            If the hour is in the past, or the planner is closed.
        """
        with nullcontext() if self._deadline_s is None else collected_later:
            return self._plan_until(self._until(), hour)

    def _plan_until(self, until: float, hour: float | None) -> Plan:
        with self._lock:
            if self._is_closed:
                raise InputError("is closed", "planner")
            if hour is not None:
                self._advance(hour)
            if self._planned == self._version:
                return self._plan
            self._follow_late()
            decision = self._runner.request(self._version, until)
        decision.done.wait(None if until == math.inf else max(0.0, until - time.perf_counter()))
        woken = min(until, time.perf_counter())
        with self._lock:
            plan = self._conclude(decision)
            self._last_s = max(time.perf_counter() - woken, 0.95 * self._last_s)
        return plan

    def why_changed(self) -> tuple[OrderChange, ...]:
        """Return the orders of the last plan that differ from the previous one, with their causes."""
        return self._plan.changes

    def save(self, path: PathLike) -> None:
        """Save the planner's knowledge, pins and plan to a file, for `restore`.

        Parameters
        ----------
        path : str or path
            `InputError` if it cannot be written.
        """
        with self._lock:
            name, settings = self._made_of
            document = {
                "policy": name,
                "settings": settings,
                "deadline_ms": None if self._deadline_s is None else self._deadline_s * 1000,
                "seed": self._seed,
                "pins": self._pins.tasks,
                "is_planned": self._planned == self._version,
                "told": sorted(self._inputs_this_hour),
                **saved.document_of(self._estimate, self._plan),
            }
        saved.write(document, path)

    @classmethod
    def restore(cls, path: PathLike, policy: Policy | None = None) -> "MissionPlanner":
        """Return a planner in the saved state, with the same plan.

        The policy's own memory is not part of it.

        Parameters
        ----------
        path : str or path
        policy : Policy, optional
            The policy, if the saved planner was created with an object.

        Raises
        ------
        InputError
            If the file cannot be read, or was not written by `save`.
        """
        document = saved.read(path)
        with saved.reading(path):
            name, settings = document["policy"], document["settings"]
            if name is None and policy is None:
                raise InputError("was an object; give it again", "policy")
            given = {} if policy is not None else require_object(settings, "settings")
            chosen = text(name, "policy") if policy is None else policy
            deadline_ms, seed = document["deadline_ms"], document["seed"]
            planner = cls(saved.mission_of(document), chosen, deadline_ms, seed=seed, **given)  # type: ignore[arg-type]
            planner._plan = saved.restored(document, planner._estimate)
            planner._pins.tasks = dict(document["pins"])  # type: ignore[call-overload]
            planner._inputs_this_hour = set(document["told"])  # type: ignore[call-overload]
            planner._planned = 0 if document["is_planned"] else -1
        return planner

    def _advance(self, hour: float) -> None:
        now = float(real(hour, "hour", 0, LATEST))
        check_hour(self._estimate.state, now)
        known, before = self._estimate.news_count, self.hour
        self._estimate.advance(now)
        if now > before:
            self._inputs_this_hour.clear()
        if self._estimate.news_count > known:
            self._version += 1

    def _look(self, decision: Decision) -> View:
        with self._lock:
            self._pins.lapse()
            decision.version, decision.seen = self._version, self._estimate.news_count
            return self._estimate.view(self._pins.tasks)

    def _until(self) -> float:
        """Return the value of `time.perf_counter` up to which to wait, so that orders are given in time."""
        if self._deadline_s is None:
            return math.inf
        reserve = min(RESERVE_SHARE * self._deadline_s, RESERVE_MS / 1000 + 1.5 * self._last_s)
        return time.perf_counter() + self._deadline_s - reserve

    def _conclude(self, decision: Decision) -> Plan:
        """Make the next plan from a decision and, for agents without a new order, from the last plan."""
        if decision.is_whole and decision.version <= self._planned:
            return self._plan  # another thread has already applied this decision
        self._follow(dict(decision.orders))
        estimate, before = self._estimate, self._plan
        orders = {agent.facts.id: agent.order for agent in estimate.active()}
        changes = changes_of(before.orders, orders, estimate.news)
        self._plan = Plan(self.hour, MappingProxyType(orders), decision.is_whole, decision.problem, changes)
        if decision.is_whole:
            self._planned = decision.version
            estimate.forget(decision.seen)
        return self._plan

    def _follow_late(self) -> None:
        """Give orders of a decision that ended after the deadline of the last plan."""
        late = self._runner.last
        if late is not None and self._planned < late.version < self._version:
            self._follow(late.orders)
            self._runner.last = None

    def _follow(self, orders: Mapping[str, Order]) -> None:
        """Give the orders that can be followed now, with precedence of pins, and end orders for closed tasks."""
        estimate = self._estimate
        self._pins.lapse()
        for agent in estimate.active():
            name = agent.facts.id
            wanted = self._pins.order(name) or orders.get(name)
            if wanted is not None:
                estimate.order(name, wanted)
            if (task := agent.order.task) is not None and estimate.state.task(task).status is not TaskStatus.OPEN:
                estimate.order(name, STAY)
        estimate.schedule()
