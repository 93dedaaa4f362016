"""Policies on families of missions: means, and paired differences from the first policy with 95 % intervals.

    python tests/benchmarks/missions.py --family cfstp --agents 10 --policies routes --missions 100 --deadline-ms 10
    python tests/benchmarks/missions.py --family failures --policies 'replan[method=cpsat] routes' --missions 100

Missions have seeds from 2000 on by default, on which nothing was tuned; the price on switches of `routes` was chosen on
seeds 1000 to 1015. What is compared is the mission time of missions that both
policies finish, the share of tasks done, switches and distance; of each figure the policy's mean, and in brackets the
mean difference from the first policy and the half width of its interval.
"""

import argparse
import re

import numpy as np
from scipy import stats

from alloc.allocators import load_policy, simulate
from alloc.problems import Mission, MissionParameters, MissionResult, random_cfstp, random_mission

FIRST_SEED = 2000
FIGURES = ("mission_time", "tasks_done_share", "switches", "distance", "decision_ms_mean", "decision_ms_p99")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--family", default="failures")
    parser.add_argument("--agents", type=int)
    parser.add_argument("--tasks", type=int)
    parser.add_argument("--policies", default="replan[method=cpsat] routes clairvoyant")
    parser.add_argument("--missions", type=int, default=100)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--deadline-ms", type=float)
    options = parser.parse_args()
    names = options.policies.split()
    table = {name: [] for name in names}
    policies = {name: named(name) for name in names}
    for seed in range(options.first_seed, options.first_seed + options.missions):
        mission = drawn(options.family, options.agents, options.tasks, seed)
        for name, policy in policies.items():
            table[name].append(figures(simulate(mission, policy, deadline_ms=options.deadline_ms).result))
    print(f"| {options.family}, {options.missions} missions | " + " | ".join(FIGURES) + " |")
    print("|---|" + "--:|" * len(FIGURES))
    first = np.array(table[names[0]])
    for name in names:
        rows = np.array(table[name])
        cells = [cell(rows[:, k], None if name == names[0] else first[:, k]) for k in range(len(FIGURES))]
        print(f"| `{name}` | " + " | ".join(cells) + " |")


def drawn(family: str, agents: int | None, tasks: int | None, seed: int) -> Mission:
    if family == "cfstp":
        return random_cfstp(agents or 20, tasks or 300, seed)
    return random_mission(MissionParameters(family=family, agents=agents, tasks=tasks, knowledge="full"), seed)


def named(text: str) -> object:
    """Return the policy of a text such as ``replan[method=cpsat,iterations=5]``."""
    name, settings = re.fullmatch(r"([^\[]+)(?:\[(.*)\])?", text).groups()
    pairs = (pair.split("=") for pair in (settings or "").split(",") if pair)
    return load_policy(name, **{key: number(value) for key, value in pairs})


def number(value: str) -> object:
    try:
        return int(value)
    except ValueError:
        return float(value) if re.fullmatch(r"[\d.e+-]+", value) else value


def figures(result: MissionResult) -> list[float]:
    total = result.tasks_done + result.tasks_missed + result.tasks_left
    time = np.nan if result.mission_time is None else result.mission_time
    times = [np.nan if ms is None else ms for ms in (result.decision_ms_mean, result.decision_ms_p99)]
    return [time, result.tasks_done / max(total, 1), result.switches, result.distance, *times]


def cell(values: np.ndarray, others: np.ndarray | None) -> str:
    """Return a mean with its interval, or with the paired difference and the interval of that."""
    subject = values if others is None else values - others
    kept = subject[~np.isnan(subject)]
    if not len(kept):
        return "-"
    half = stats.t.ppf(0.975, len(kept) - 1) * kept.std(ddof=1) / np.sqrt(len(kept)) if len(kept) > 1 else np.nan
    if others is None:
        return f"{kept.mean():.4g} ± {half:.2g}"
    return f"{np.nanmean(values):.4g} ({kept.mean():+.3g} ± {half:.2g})"


if __name__ == "__main__":
    main()
