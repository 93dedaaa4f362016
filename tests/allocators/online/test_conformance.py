"""Every policy passes the conformance suite, and the suite detects the defects that it is meant to detect."""

import sys
import time

import pytest

from alloc.allocators import AgentDecider, Policy, PolicyInfo, policy_names
from alloc.allocators.online.conformance import PolicyConformance
from alloc.allocators.online.policies.simple import Nearest
from alloc.cli.options import BUILT_IN_POLICIES
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import Order, TaskStatus

COMPILED = [pytest.mark.slow, pytest.mark.timeout(300)]
"""Marks of policies that are compiled first: half a minute, more under load."""


class TestIdle(PolicyConformance):
    name = "idle"


class TestRandom(PolicyConformance):
    name = "random"


class TestNearest(PolicyConformance):
    name = "nearest"


class TestGreedy(PolicyConformance):
    name = "greedy"


class TestHedonic(PolicyConformance):
    name = "hedonic"


class TestAuction(PolicyConformance):
    name = "auction"


class TestGappo(PolicyConformance):
    name = "gappo"


class TestPpo(PolicyConformance):
    name = "ppo"


class TestReplan(PolicyConformance):
    name = "replan"
    settings = {"method": "greedy", "iterations": 1}  # noqa: RUF012


class TestLocalRoutes(PolicyConformance):
    pytestmark = COMPILED
    name = "local-routes"
    settings = {"iterations": 20, "first_iterations": 20}  # noqa: RUF012


class TestRoutes(PolicyConformance):
    pytestmark = COMPILED
    name = "routes"
    settings = {"iterations": 50, "first_iterations": 50}  # noqa: RUF012


class TestClairvoyant(PolicyConformance):
    pytestmark = COMPILED
    name = "clairvoyant"
    settings = {"iterations": 50, "first_iterations": 50}  # noqa: RUF012


class Defective(Policy):
    """Takes the nearest task, with a defect added by `decider`."""

    info = PolicyInfo(name="defective", summary="does what it must not")
    decider: type[AgentDecider]

    def begin(self, briefing):
        return self.decider(briefing, Nearest().begin(briefing), self)


class Decider(AgentDecider):
    def __init__(self, briefing, nearest, policy):
        self.briefing, self.nearest, self.policy = briefing, nearest, policy

    def decide(self, view):
        return self.nearest.decide(view)


class LooksBehindTheScenes(Decider):
    """Finds the simulation on the call stack, and decides by present and future work."""

    def decide(self, view):
        frame = sys._getframe()
        while not isinstance(found := getattr(frame.f_locals.get("self"), "_simulation", None), Simulation):
            frame = frame.f_back
        tasks = view.open_tasks(view.own)
        total = sum(task.workload for task in found.state.tasks)
        return Order(tasks[int(total * 7) % len(tasks)].facts.id) if tasks else None


class GoesToTheUnknown(Decider):
    """Goes to a task that it does not know."""

    def decide(self, view):
        return Order("t5")


class AnswersLate(Decider):
    def decide(self, view):
        time.sleep(0.02)
        return self.nearest.decide(view)


class FliesWithoutBattery(Decider):
    def decide(self, view):
        tasks = [task for task in view.tasks.values() if task.status is TaskStatus.OPEN]
        return Order(max(tasks, key=lambda task: view.distance(view.own, task)).facts.id) if tasks else None


class TalksInSecret(Decider):
    """Shares its task with other agents through the common policy object."""

    def decide(self, view):
        taken = self.policy.__dict__.setdefault("taken", set())
        tasks = [task for task in view.open_tasks(view.own) if task.facts.id not in taken]
        if not tasks:
            return None
        taken.add(tasks[0].facts.id)
        return Order(tasks[0].facts.id)


class ThrowsDice(Decider):
    """Uses an unseeded random generator."""

    def decide(self, view):
        tasks = view.open_tasks(view.own)
        drawn = time.perf_counter_ns() // 100
        return Order(tasks[drawn % len(tasks)].facts.id) if len(tasks) > 1 else self.nearest.decide(view)


@pytest.mark.parametrize(
    ("kind", "check", "arguments"),
    [
        (LooksBehindTheScenes, "test_it_knows_nothing_of_the_future", ()),
        (LooksBehindTheScenes, "test_an_agent_knows_only_what_it_saw_and_heard", ()),
        (GoesToTheUnknown, "test_its_orders_can_be_followed", ("steady",)),
        (AnswersLate, "test_it_answers_in_time", ()),
        (FliesWithoutBattery, "test_nobody_is_sent_beyond_its_battery", ()),
        (TalksInSecret, "test_agents_share_nothing_but_messages", ()),
        (ThrowsDice, "test_the_same_seed_gives_the_same_orders", ()),
    ],
)
def test_defects_are_caught(kind, check, arguments):
    """A policy that violates the contract fails the corresponding test."""

    class Broken(Defective):
        decider = kind

    class Suite(PolicyConformance):
        deadline_ms = 15.0

        def policy(self):
            return Broken()

    with pytest.raises(AssertionError):
        getattr(Suite(), check)(*arguments)


def test_every_policy_is_tested():
    """Each built-in policy has a test class above, and is known to shell completion."""
    tested = {kind.name for kind in PolicyConformance.__subclasses__() if kind.name}
    assert set(BUILT_IN_POLICIES) == tested
    assert list(BUILT_IN_POLICIES) == policy_names()[: len(BUILT_IN_POLICIES)]
