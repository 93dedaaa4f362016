"""A policy that decides for agents in turn gives the same orders as separate decisions."""

import numpy as np
import pytest
from drawn_missions import random_mission_of_any_kind

from alloc.allocators import MissionPlanner
from alloc.allocators.learned.missions.situation import OTHER_WAYS
from alloc.allocators.online.policies import gappo, network_turns
from alloc.allocators.online.policies.gappo import NetworkPolicy
from alloc.problems import InputError, Instance
from alloc.problems.missions.mission import Mission

pytestmark = pytest.mark.slow  # loops are compiled first


class OneByOne(NetworkPolicy):
    """The same network with a separate decision for each agent."""

    def begin_turns(self, briefing):
        return None


def crowd(rng: np.random.Generator) -> Mission:
    """Return more agents than one batch, in a square, with allowed tasks, skills, ranges and small batteries."""
    n, m = 40, 12
    some = [sorted(rng.choice(m, 5, replace=False).tolist()) if rng.random() < 0.3 else None for _ in range(n)]
    instance = Instance(
        ability=rng.uniform(1, 5, n),
        workload=rng.uniform(5, 20, m),
        agent_position=rng.random((n, 2)),
        task_position=rng.random((m, 2)),
        speed=rng.uniform(0.3, 1, n),
        battery=rng.uniform(0.3, 3, n),
        energy_per_distance=1.0,
        communication_range=rng.choice([0.4, np.inf], n),
        allowed_tasks=some,
        skills=[["lift"] if one else [] for one in rng.random(n) < 0.7],
        needs=[["lift"] if one else [] for one in rng.random(m) < 0.2],
        returns=rng.random(n) < 0.3,
        metric=str(rng.choice(["euclidean", "manhattan"])),
    )
    return Mission(instance, growth=rng.choice([0.0, 0.5], m), deadline=rng.choice([np.inf, 6.0], m))


def told(planner: MissionPlanner, rng: np.random.Generator, step: int) -> dict[str, object]:
    """Return a random event."""
    agents, tasks = list(planner._estimate.state.all_agents), list(planner._estimate.state.all_tasks)
    agent, task = rng.choice(agents).facts.id, rng.choice(tasks).facts.id
    return [
        {"event": "agent-recalled", "agent": agent},
        {"event": "agent-returns", "agent": agent},
        {"event": "task-cancelled", "task": task},
        {"event": "task-changes", "task": task, "workload": 9.0},
        {"event": "task-appears", "task": {"id": f"new {step}", "workload": 7.0, "position": rng.random(2).tolist()}},
    ][rng.integers(5)]


@pytest.mark.parametrize("seed", range(8))
def test_orders_match_separate_decisions(seed, monkeypatch):
    """In random missions of all kinds, both planners have the same plans, whatever happens.

    In separate decisions, an agent guesses the choices of free neighbours, which is not needed in turns.
    """
    for module in (gappo, network_turns):
        monkeypatch.setattr(module, "metric_code", lambda view: OTHER_WAYS)
    rng = np.random.default_rng(seed)
    mission = crowd(rng) if seed % 2 else random_mission_of_any_kind(rng)
    with MissionPlanner(mission, "gappo", None) as fast, MissionPlanner(mission, OneByOne(), None) as slow:
        orders = 0
        for step in range(12):
            plans = fast.plan(), slow.plan()
            assert (plans[0].problem, plans[1].problem) == (None, None)
            assert dict(plans[0]) == dict(plans[1]), step
            orders += sum(order.task is not None for order in plans[0].values())
            event = {"hour": min(mission.horizon, fast.hour + float(rng.choice([0.0, 0.2, 1.5])))}
            event |= told(fast, rng, step)
            try:
                fast.submit(event)
            except InputError:
                continue
            slow.submit(event)
        assert orders > 100 or seed % 2 == 0  # those of any kind are small, and may leave nothing to do


def test_agents_without_a_turn_have_not_decided() -> None:
    """If turns are broken off, only agents before that have decided; the others decide the next time."""
    considered = []
    for is_broken_off in (False, True):
        with MissionPlanner(crowd(np.random.default_rng(1)), "gappo", None) as planner:
            planner.plan()
            planner.submit({"event": "task-appears", "task": {"id": "new", "workload": 7.0, "position": [0.5, 0.5]}})
            turns, view = planner._runner._turns, planner._estimate.view({})
            assert turns is not None
            if is_broken_off:
                started = turns.turns(view, list(view.agents))
                next(started)
                started.close()
            considered.append(sum(order is not None for _, order in turns.turns(view, list(view.agents))))
    assert considered[0] > 20
    assert considered[1] >= considered[0] - 1
