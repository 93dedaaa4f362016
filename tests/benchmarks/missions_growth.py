"""How long compiled missions take as agents grow: local knowledge, short radios, a failure for every five agents.

    python tests/benchmarks/missions_growth.py --agents 500 1000 2000 --plot docs/missions/missions_scale.png

Radii shrink so that an agent has about as many neighbours in each mission. Seconds are of a processor. Exponents are
those of the power law from one row to the next.
"""

import argparse
import math
import resource
import time
from pathlib import Path

import matplotlib.pyplot as plt

from alloc.allocators import load_policy
from alloc.allocators.online.compiled.run import run_compiled
from alloc.problems.missions.families.draw import random_mission
from alloc.problems.missions.families.parameters import MissionParameters
from alloc.problems.missions.mission import Mission

NEIGHBOURS = 20
"""Agents within the radius of another, on average."""


def mission(agents: int, tasks: int) -> Mission:
    """Return a mission in which a fifth of the agents fail, and half of the tasks appear later."""
    radius = math.sqrt(NEIGHBOURS / agents / math.pi)
    return random_mission(MissionParameters("failures", agents, tasks, radius=radius, sensing=radius), 1)


def main() -> None:
    """Print a row for each size and policy, and plot them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agents", type=int, nargs="+", default=[500, 1000, 2000])
    parser.add_argument("--tasks", type=int, default=500)
    parser.add_argument("--policies", nargs="+", default=["greedy", "gappo"])
    parser.add_argument("--plot", type=Path)
    given = parser.parse_args()
    print("| agents | tasks | events | policy | seconds | exponent | tasks done | GB at most |")
    print("|--:|--:|--:|---|--:|--:|--:|--:|")
    figure, axes = plt.subplots()
    for policy in given.policies:
        run_compiled(mission(10, 10), load_policy(policy))  # compiles
        taken: list[float] = []
        for agents in given.agents:
            drawn, began = mission(agents, given.tasks), time.process_time()
            result = run_compiled(drawn, load_policy(policy))
            taken.append(time.process_time() - began)
            events = sum(event.hour > 0 for event in drawn.timeline)
            before = math.nan if len(taken) < 2 else given.agents[len(taken) - 2]
            power = math.nan if len(taken) < 2 else math.log(taken[-1] / taken[-2]) / math.log(agents / before)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
            row = f"| {agents} | {given.tasks} | {events} | {policy} | {taken[-1]:.1f} | {power:.1f} |"
            print(f"{row} {result.tasks_done} | {peak:.1f} |", flush=True)
        axes.loglog(given.agents, taken, marker="o", label=policy)
    axes.set(xlabel="agents", ylabel="seconds of a processor")
    axes.legend()
    if given.plot:
        figure.savefig(given.plot)


if __name__ == "__main__":
    main()
