"""The policies of SPACE in its own simulator, and those of `alloc` in missions of the same draws.

In an environment that has what SPACE needs (pygame, py-trees, pyyaml, imageio, pandas, matplotlib<3.9)::

    python tests/benchmarks/space_peer.py run space-simulator CBBA --radius 500 --seed 1 --output runs

draws tasks and agents by the seed, whatever the policy, and notes them with the mission time. Then, with `alloc`::

    python tests/benchmarks/space_peer.py compare runs
"""

import argparse
import contextlib
import io
import json
import math
import os
import random
import re
import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

if TYPE_CHECKING:
    from alloc.problems import Mission

PLUGINS: dict[str, dict[str, Any]] = {
    "CBBA": {
        "plugin": "plugins.cbba.cbba.CBBA",
        "CBBA": {
            "max_tasks_per_agent": 5,
            "task_reward_discount_factor": 0.999,
            "winning_bid_cancel": True,
            "acceptable_empty_bundle_duration": 500,
        },
    },
    "greedy": {
        "plugin": "plugins.greedy.greedy.FirstClaimGreedy",
        "FirstClaimGreedy": {"mode": "MinDist", "weight_factor_cost": 10000.0},
    },
    "GRAPE": {
        "plugin": "plugins.grape.grape.GRAPE",
        "GRAPE": {
            "cost_weight_factor": 1.0,
            "social_inhibition_factor": 100,
            "initialize_partition": "Distance",
            "reinitialize_partition_on_completion": "Distance",
        },
    },
}
"""Parameters of ``config.yaml`` there."""

POLICIES: dict[str, dict[str, float]] = {
    "gappo": {},
    "gappo[periods=1]": {"periods": 1},
    "hedonic[memory=490,flight=0.000125,age=0.00066]": {"memory": 490.0, "flight": 0.000125, "age": 0.00066},
    "greedy[memory=500,flight=0.0019,age=0.0002]": {"memory": 500.0, "flight": 0.0019, "age": 0.0002},
    "auction[memory=100]": {"memory": 100.0},
    "nearest": {},
}

SIMULATED: dict[str, dict[str, Any]] = {
    "local-routes": {"policy": "local-routes"},
    "routes[iterations=100], full knowledge": {"policy": "routes", "knowledge": "full", "iterations": 100},
}
"""Policies without compiled loops."""

Drawn = tuple[Any, list[float], float | None]
"""A task or an agent, with its place and amount as they were drawn; an agent has no amount."""


def run(given: argparse.Namespace) -> None:
    """Run SPACE as it is, but for tasks and agents: the seed draws the same whatever the policy."""
    path = configured(given)
    os.environ["SDL_VIDEODRIVER"] = os.environ["SDL_AUDIODRIVER"] = "dummy"
    os.chdir(given.space)
    sys.path.insert(0, str(Path.cwd()))
    import pygame
    from modules import utils

    pygame.init()
    utils.set_config(str(path))
    from modules import agent, task

    first = given.seed * 1_000_003
    tasks: list[Drawn] = []
    agents: list[Drawn] = []
    task.generate_tasks = seeded(task.generate_tasks, first, tasks)
    agent.generate_agents = seeded(agent.generate_agents, first + 500_000, agents)
    sys.argv = ["main.py", "--config", str(path)]
    random.seed(first + 999)
    with contextlib.redirect_stdout(io.StringIO()) as said:
        runpy.run_path("main.py", run_name="__main__")
    end = re.search(r"\[([\d.]+)\] MISSION COMPLETED", said.getvalue())
    result = {
        "mission_time": float(end[1]) if end else None,
        "distance": sum(one.distance_moved for one, _, _ in agents),
        "agents": [place for _, place, _ in agents],
        "tasks": [{"position": place, "workload": amount} for _, place, amount in tasks],
    }
    path.with_suffix(".json").write_text(json.dumps(result), encoding="utf-8")


def configured(given: argparse.Namespace) -> Path:
    """Write the configuration of a run, and return where it is."""
    import yaml

    output = Path(given.output).resolve()
    output.mkdir(parents=True, exist_ok=True)
    config = yaml.safe_load((Path(given.space) / "config.yaml").read_text(encoding="utf-8"))
    config["decision_making"] = PLUGINS[given.policy]
    config["agents"]["communication_radius"] = config["agents"]["situation_awareness_radius"] = given.radius
    config["simulation"].update(rendering_mode="None", max_simulation_time=40000)
    kinds = ("gif", "timewise_result_csv", "agentwise_result_csv", "config_yaml")
    config["simulation"]["saving_options"].update({f"save_{kind}": False for kind in kinds}, output_folder=str(output))
    path = output / f"{given.policy}-{given.radius}-{given.seed}.yaml"
    path.write_text(yaml.safe_dump(config), encoding="utf-8")
    return path


def seeded(draw: Callable[..., list[Any]], seed: int, notes: list[Drawn]) -> Callable[..., list[Any]]:
    """Return a function that draws by a seed of its own, notes what, and leaves all other chance as it was."""

    def drawn(*arguments: object, **named: int) -> list[Any]:
        state = random.getstate()
        random.seed(seed + named.get("task_id_start", 0))
        found = draw(*arguments, **named)
        random.setstate(state)
        notes.extend((one, list(one.position), getattr(one, "amount", None)) for one in found)
        return found

    return drawn


def compare(given: argparse.Namespace) -> None:
    """Print the mission times of all policies, in all draws for which SPACE was run with its three."""
    from alloc.allocators import load_policy, simulate
    from alloc.allocators.online.compiled.run import run_compiled

    runs = Path(given.runs)
    policies = {name: load_policy(name.split("[")[0], **settings) for name, settings in POLICIES.items()}
    for radius in given.radii:
        times: dict[str, list[float]] = {name: [] for name in (*PLUGINS, *POLICIES, *SIMULATED)}
        for path in sorted(runs.glob(f"CBBA-{radius}-*.json")):
            seed = int(path.stem.split("-")[2])
            others = [runs / f"{name}-{radius}-{seed}.json" for name in PLUGINS]
            if not all(other.exists() for other in others):
                continue
            for name, other in zip(PLUGINS, others, strict=True):
                times[name].append(json.loads(other.read_text(encoding="utf-8"))["mission_time"] or math.inf)
            mission = mission_of(path, seed)
            for name, policy in policies.items():
                times[name].append(run_compiled(mission, policy, seed).mission_time or math.inf)
            for name, settings in SIMULATED.items():
                times[name].append(simulate(mission, seed=seed, **settings).result.mission_time or math.inf)
        show(radius, times)


def mission_of(path: Path, seed: int) -> "Mission":
    """Return a mission of the configuration of a run, with the places and amounts that were drawn there."""
    from alloc.problems import import_mission
    from alloc.problems.changes.remove import replaced

    drawn = json.loads(path.read_text(encoding="utf-8"))
    mission = import_mission("space", str(path.with_suffix(".yaml")), seed=seed)
    instance = replaced(
        mission.instance,
        agent_position=drawn["agents"],
        task_position=[task["position"] for task in drawn["tasks"]],
        workload=[task["workload"] for task in drawn["tasks"]],
    )
    kept = {name: getattr(mission, name) for name in ("appears", "knowledge", "sensing", "radio", "seed")}
    return type(mission)(instance, **kept)


def show(radius: int, times: dict[str, list[float]]) -> None:
    """Print means with 95 % intervals where all was done, and ratios to the best of SPACE in the same draw."""
    best = np.min([times[name] for name in PLUGINS], axis=0)
    print(f"radius {radius}, {len(best)} draws")
    for name, values in times.items():
        found = np.array(values)
        is_done = np.isfinite(found)
        parts = [interval(found[is_done]), interval(found[is_done] / best[is_done], 2)]
        print(f"{name:50} {parts[0]:>16} {parts[1]:>14}  unfinished {np.count_nonzero(~is_done)}")


def interval(values: NDArray[np.float64], digits: int = 0) -> str:
    """Return a mean with its 95 % interval."""
    half = stats.t.ppf(0.975, len(values) - 1) * stats.sem(values) if len(values) > 1 else math.nan
    return f"{values.mean():.{digits}f} ± {half:.{digits}f}"


def main() -> None:
    """Run, or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("run")
    one.add_argument("space", help="A copy of inmo-jang/space-simulator.")
    one.add_argument("policy", choices=PLUGINS)
    one.add_argument("--radius", type=int, default=500)
    one.add_argument("--seed", type=int, default=1)
    one.add_argument("--output", default="runs")
    one.set_defaults(command=run)
    all_ = commands.add_parser("compare")
    all_.add_argument("runs", help="Folder of the runs.")
    all_.add_argument("--radii", type=int, nargs="+", default=[300, 500])
    all_.set_defaults(command=compare)
    given = parser.parse_args()
    given.command(given)


if __name__ == "__main__":
    main()
