"""Conservation laws hold for any sequence of inputs, and a planner restored in between has the same state."""

import json

import numpy as np
from drawn_missions import random_mission_of_any_kind

from alloc.allocators import MissionPlanner
from alloc.problems import InputError, Instance, Mission
from alloc.problems.missions.simulation import conservation


def inputs(rng, step, agent, task):
    """Return all kinds of inputs about an agent and a task, consistent or not."""
    place, some = rng.random(2).tolist(), float(rng.random())
    whole_agent = {
        "id": f"new {step}",
        "ability": 1.5,
        "position": place,
        "speed": 1.0,
        "battery": 3.0,
        "tasks": [task],
    }
    whole_task = {"id": f"more {step}", "workload": 2.0, "position": place, "growth": 0.3}
    return [
        *({"event": f"agent-{kind}", "agent": agent} for kind in ("fails", "recalled", "returns", "joins")),
        {"event": "agent-recharges", "agent": agent, "amount": some},
        {"event": "agent-reports", "agent": agent, "position": place},
        {"event": "agent-reports", "agent": agent, "position": place, "battery": some},
        {"event": "agent-reports", "agent": agent, "task": task, "battery": some},
        {"event": "agent-reports", "agent": agent, "battery": float(rng.choice([0, 0.1, 1, 10]))},
        {"event": "agent-joins", "agent": whole_agent},
        {"event": "agent-joins", "agent": {"id": f"new {step}", "ability": 1.5, "start_task": task, "speed": 1.0}},
        {"event": "task-appears", "task": task},
        {"event": "task-appears", "task": whole_task},
        {"event": "task-cancelled", "task": task},
        {"event": "task-changes", "task": task, "workload": float(rng.choice([0, 1e-12, 1, 5]))},
    ]


def test_conservation_laws_hold_and_plans_are_restored(tmp_path):
    """Laws hold at all events of 20 random missions, no policy fails, and restored planners behave as the originals."""
    accepted = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        mission = random_mission_of_any_kind(rng)
        with MissionPlanner(mission, ("nearest", "greedy", "hedonic", "auction")[seed % 4], None) as planner:
            for step in range(20):
                planner.save(tmp_path / "planner.json")
                saved = json.loads((tmp_path / "planner.json").read_text())
                agent, task = (str(rng.choice([one["id"] for one in saved[kind]])) for kind in ("agents", "tasks"))
                some = inputs(rng, step, agent, task)
                hour = min(mission.horizon, planner.hour + float(rng.choice([0, 0.1, 0.5])))
                try:
                    planner.submit({"hour": hour, **some[rng.integers(len(some))]})
                    accepted += 1
                except InputError:
                    continue
                plan = planner.plan()
                assert plan.problem is None
                conservation.check(planner._estimate.state)
            planner.save(tmp_path / "planner.json")
            with MissionPlanner.restore(tmp_path / "planner.json") as again:
                assert again.plan(mission.horizon) == planner.plan(mission.horizon)
    assert accepted > 100


def test_small_growing_work_is_accounted_for():
    """Work that has grown is not mistaken for a rounding error, however little it is."""
    instance = Instance(ability=[1], workload=[1], agent_position=[[0, 0]], task_position=[[9, 9]], speed=[1])
    with MissionPlanner(Mission(instance, growth=[0.7]), "idle", None) as planner:
        planner.submit({"event": "task-changes", "task": instance.task_ids[0], "workload": 1e-12})
        planner.plan(7.8)
        conservation.check(planner._estimate.state)
