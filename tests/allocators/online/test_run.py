"""Runs of policies: deadlines, invalid orders, plugins, parameters; and differences between policies."""

import time

import numpy as np
import pytest

from alloc.allocators import (
    AgentDecider,
    FleetDecider,
    InputError,
    Policy,
    PolicyError,
    PolicyInfo,
    RefusedError,
    describe_policy,
    load_policy,
    policy_names,
    simulate,
    solve,
)
from alloc.allocators.contract import plugins
from alloc.problems import Event, Instance, Mission, MissionParameters, evaluate, random_mission
from alloc.problems.missions.simulation.state import STAY, Order

PLACES = {"agent_position": [[0, 0], [4, 0]], "task_position": [[1, 0], [3, 0]], "speed": [1, 1]}
TWO = Mission(Instance(ability=[1, 1], workload=[2, 2], **PLACES))


class Answers(Policy):
    """A policy in which every agent returns the value of `answer`."""

    info = PolicyInfo(name="answers", summary="whatever it is told to")

    def __init__(self, answer):
        self.answer = answer

    def begin(self, briefing):
        answer = self.answer

        class Decider(AgentDecider):
            def decide(self, view):
                return answer(view)

        return Decider()


class Fleet(Answers):
    info = PolicyInfo(name="fleet", summary="whatever it is told to, for all", central=True)

    def begin(self, briefing):
        answer = self.answer

        class Decider(FleetDecider):
            def decide(self, view):
                return answer(view)

        return Decider()


def test_late_orders_are_ignored():
    """Orders after the deadline are dropped and counted; the last order stays in force."""

    def slowly(view):
        if view.hour > 0:
            time.sleep(0.03)
        return Order("t1") if view.hour == 0 else Order("t2")

    mission = Mission(TWO.instance, events=[Event(0.5, "task-changes", task="t2", workload=2)], horizon=30)
    in_time = simulate(mission, Answers(slowly)).result
    late = simulate(mission, Answers(slowly), deadline_ms=20).result
    assert (in_time.decisions_late, in_time.switches) == (0, 2)
    assert late.decisions_late == late.decisions - 2
    assert (late.switches, late.tasks_done, late.tasks_left) == (0, 1, 1)


@pytest.mark.parametrize(
    ("policy", "told"),
    [
        (Answers(lambda view: "t1"), "returned 't1', which is not an Order"),
        (Fleet(lambda view: [STAY]), "returned list, not a mapping of orders"),
        (Fleet(lambda view: {"a9": STAY}), "gave an order to 'a9', which cannot take orders now"),
    ],
)
def test_invalid_orders_are_errors(policy, told):
    """The error says what the policy returned."""
    with pytest.raises(PolicyError, match=told):
        simulate(TWO, policy)


def test_infeasible_orders_are_logged():
    """An order to an unknown task is refused with the reason, and counted."""
    run = simulate(TWO, Answers(lambda view: Order("t7") if view.id == "a1" else None))
    assert run.result.orders_refused == 1
    assert [record["reason"] for record in run.log.records if record["record"] == "refused"] == [
        "the agent does not know the task"
    ]


def test_no_compilation_within_a_mission():
    """Loading `gappo` compiles its loops for the argument types of missions, so the first decision is in time."""
    from alloc.allocators.learned.missions import exploring, messages, play

    policy = load_policy("gappo")
    loops = (
        play.score_options_compiled, play.is_due, play.record_change,
        exploring.record_seen, exploring.centre, messages.should_send,
    )  # fmt: skip
    before = [list(loop.signatures) for loop in loops]
    result = simulate(random_mission(MissionParameters(agents=3, tasks=4), seed=1), policy).result
    assert result.decisions > 0
    assert all(before)
    assert [list(loop.signatures) for loop in loops] == before


def test_central_policies_need_full_knowledge():
    """A central policy is refused with local knowledge."""
    with pytest.raises(RefusedError, match="needs full knowledge"):
        simulate(TWO, "replan", knowledge="local", method="greedy")


def test_policies_are_found_by_name(monkeypatch):
    """Built-in policies and plugins are found; a wrong name, an invalid plugin and a wrong parameter are errors."""

    class EntryPoint:
        def __init__(self, name, target):
            self.name, self.target, self.value = name, target, f"package:{name}"

        def load(self):
            return self.target

    points = [EntryPoint("mine", Answers), EntryPoint("broken", int), EntryPoint("nearest", int)]
    monkeypatch.setattr(plugins, "entry_points", lambda group: points if group == "alloc.policies" else [])
    assert policy_names()[-2:] == ["mine", "broken"]
    assert describe_policy("mine") is Answers.info
    assert describe_policy("nearest").name == "nearest"
    for name, settings, told in (
        ("neares", {}, "did you mean 'nearest'"),
        ("broken", {}, "is not a Policy"),
        ("greedy", {"stya": 1}, "takes no option 'stya'"),
        ("greedy", {"stay": -1}, "stay: must be"),
        ("idle", {"stay": 1}, "takes no option 'stay'"),
        ("replan", {"method": "gredy"}, "there is no method 'gredy'"),
    ):
        with pytest.raises(InputError, match=told):
            load_policy(name, **settings)


def test_replan_keeps_its_plan_without_events():
    """On an instance, `replan` is no worse than its method's plan, as agents can take further tasks afterwards."""
    rng = np.random.default_rng(1)
    instance = Instance(
        ability=rng.integers(1, 9, 8), workload=rng.uniform(5, 20, 4), agent_position=rng.random((8, 2)),
        task_position=rng.random((4, 2)), speed=np.full(8, 2.0),
    )  # fmt: skip
    plan = solve(instance, "greedy", iterations=1, time_limit_s=None)
    result = simulate(Mission(instance), "replan", method="greedy", iterations=1).result
    assert result.mission_time <= evaluate(instance, plan.allocation).makespan * (1 + 1e-9)


def test_move_price_reduces_switches():
    """With a high move price, agents stay with their tasks while new ones appear."""
    mission = random_mission(MissionParameters(agents=4, tasks=6, knowledge="full"), 3)
    free = simulate(mission, "replan", method="greedy", iterations=1).result
    dear = simulate(mission, "replan", method="greedy", iterations=1, move_price=1000).result
    assert dear.switches < free.switches


def test_greedy_is_faster_than_nearest():
    """Over a few missions, `greedy` finishes earlier than `nearest` with the same knowledge."""
    missions = [random_mission(MissionParameters(agents=6, tasks=10), seed) for seed in range(6)]

    def mean(policy):
        return np.mean([simulate(mission, policy).result.mission_time or mission.end for mission in missions])

    assert mean("greedy") < mean("nearest")
