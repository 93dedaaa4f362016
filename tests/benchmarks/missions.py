"""Policies with local knowledge in compiled loops, with the measures of the reference.

    python tests/benchmarks/missions.py local --csv docs/missions/missions.csv
    python tests/benchmarks/missions.py local --csv new.csv --missions 5 --rows "20/40;10/40" --first-seed 4000000000
    python tests/benchmarks/missions.py growth --agents 500 1000 2000 --plot docs/missions/missions_scale.png
    python tests/benchmarks/missions.py throughput

`local`: `gappo` against each other policy, on missions that no training, tuning or validation saw. Half of those of a
row are of the family `steady`, half of `failures`; all policies meet the same. The CSV has a line for each mission,
and only what it lacks is run, so that an interrupted benchmark goes on; cut the columns of a policy that has changed.
The table has, of `gappo` from each other policy in per cent, paired, with its 95 % interval (Student's t).

`growth`: seconds of a processor for one mission, with a failure for every five agents. Radii shrink so that an agent
has about as many neighbours in each. Exponents are those of the power law from one row to the next.

`throughput`: missions per second of a processor in compiled loops, as in training, best and median of rounds.
"""

import argparse
import csv
import math
import resource
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy import stats

from alloc.allocators import Policy, load_policy
from alloc.allocators.learned.missions.network import compiled_weights
from alloc.allocators.learned.missions.play import new_buffers, play
from alloc.allocators.missions.pack import begun, pack
from alloc.allocators.online.compiled.run import run_compiled
from alloc.cli.options import listed
from alloc.problems import Burst, Mission, MissionParameters, Radio, random_mission

FIRST_SEED = 3_000_000_000
"""Trainings and tunings draw seeds below 1e9, and their validations begin there."""

NEAR, NEARER = Radio(radius=0.3, loss=0.2), Radio(radius=0.15, loss=0.2)
ROWS: dict[str, tuple[int, int, Radio]] = {
    **{f"{n}/{m}": (n, m, NEAR) for n, m in ((20, 40), (40, 80), (10, 40), (60, 40))},
    **{f"{n}/{m}, radii 0.15": (n, m, NEARER) for n, m in ((20, 40), (40, 80), (10, 40), (60, 40))},
    "loss 0": (20, 40, replace(NEAR, loss=0.0)),
    "loss 80 %": (20, 40, replace(NEAR, loss=0.8)),
    "bursts": (20, 40, replace(NEAR, loss=0.0, burst=Burst(good=1.0, bad=1.0))),
    "delay 0.5 h": (20, 40, replace(NEAR, delay=0.5)),
}
"""Agents, tasks and radio; agents see as far as they hear."""

POLICIES = ("gappo", "gappo[periods=1]", "ppo", "hedonic", "auction", "greedy", "nearest")
MEASURES = ("mission_time", "energy", "switches", "messages")
NEIGHBOURS = 20
"""Agents within the radius of another, on average, where missions grow."""

Line = dict[str, str]


def loaded(labels: Sequence[str]) -> dict[str, Policy]:
    """Return policies by how they are written."""
    found = listed(",".join(labels), "--policies")
    return {label: load_policy(name, **settings or {}) for label, (name, settings) in found.items()}


def drawn(seed: int, agents: int, tasks: int, radio: Radio) -> Mission:
    """Return a mission of a row."""
    family = ("steady", "failures")[seed % 2]
    parameters = MissionParameters(family, agents, tasks, radius=radio.radius, sensing=radio.radius)
    return replace(random_mission(parameters, seed), radio=radio)


def measured(mission: Mission, seed: int, policies: dict[str, Policy]) -> Line:
    """Return the columns of some policies in a mission."""
    found = {label: run_compiled(mission, policy, seed) for label, policy in policies.items()}
    values = {f"{label} {one}": getattr(result, one) for label, result in found.items() for one in MEASURES}
    return {name: "" if value is None else f"{value:.4g}" for name, value in values.items()}


def complete(file: Path, names: Sequence[str], missions: int, first_seed: int) -> dict[tuple[str, int], Line]:
    """Run what a file lacks, and return its lines by row and number; all rows grow together."""
    policies, lines = loaded(POLICIES), dict[tuple[str, int], Line]()
    if file.exists():
        with file.open(newline="") as text:
            lines = {(line["missions"], int(line["number"])): line for line in csv.DictReader(text)}
    for number, name in ((number, name) for number in range(missions) for name in names):
        line = lines.setdefault((name, number), {"missions": name, "number": str(number)})
        lacking = {label: policy for label, policy in policies.items() if f"{label} {MEASURES[0]}" not in line}
        if lacking:
            line |= measured(drawn(first_seed + number, *ROWS[name]), number, lacking)
            header = ["missions", "number", *(f"{policy} {one}" for policy in POLICIES for one in MEASURES)]
            with file.open("w", newline="") as text:
                writer = csv.DictWriter(text, header, lineterminator="\n")
                writer.writeheader()
                writer.writerows(lines.values())
    return lines


def column(lines: Sequence[Line], policy: str, measure: str) -> list[float]:
    """Return a measure of all missions, NaN where a policy left tasks undone."""
    return [float(line[f"{policy} {measure}"] or "nan") for line in lines]


def against(lines: Sequence[Line], rival: str, measure: str) -> str:
    """Return the mean difference of `gappo` from a rival in per cent, its interval, and pairs left out."""
    pairs = zip(column(lines, "gappo", measure), column(lines, rival, measure), strict=True)
    known = [100 * (one / other - 1) for one, other in pairs if not math.isnan(one / other)]
    if len(known) < 2:
        return "-"
    left = f" ({len(lines) - len(known)})" if len(known) < len(lines) else ""
    return f"{np.mean(known):+.1f} ± {stats.t.interval(0.95, len(known) - 1, scale=stats.sem(known))[1]:.1f}{left}"


def local(given: argparse.Namespace) -> None:
    """Run what is missing, and print the tables."""
    names = given.rows.split(";") if given.rows else list(ROWS)
    known = complete(given.csv, names, given.missions, given.first_seed)
    lines = {name: [line for (row, _), line in known.items() if row == name] for name in names}
    for measure in ("mission_time", "energy"):
        print(f"\n| {measure} | {' | '.join(POLICIES[1:])} |\n|---|{'--:|' * len(POLICIES[1:])}")
        for name in names:
            print("|", name, "|", " | ".join(against(lines[name], rival, measure) for rival in POLICIES[1:]), "|")
    for name in names:
        means = [f"{np.nanmean(column(lines[name], policy, one)):.0f}" for policy in POLICIES for one in MEASURES[2:]]
        print(name, "switches and messages of each policy:", *means)


def growth(given: argparse.Namespace) -> None:
    """Print a row for each size and policy, and plot them."""
    print("| agents | tasks | events | policy | seconds | exponent | tasks done | GB at most |")
    print("|--:|--:|--:|---|--:|--:|--:|--:|")
    figure, axes = plt.subplots()
    for label, policy in loaded(given.policies).items():
        run_compiled(drawn(1, 10, 10, NEAR), policy)  # compiles
        taken: list[float] = []
        for agents in given.agents:
            radius = math.sqrt(NEIGHBOURS / agents / math.pi)
            mission, began = drawn(1, agents, given.tasks, replace(NEAR, radius=radius)), time.process_time()
            result = run_compiled(mission, policy)
            taken.append(time.process_time() - began)
            power = np.diff(np.log(taken[-2:])) / np.diff(np.log(given.agents[: len(taken)][-2:]))
            events = sum(event.hour > 0 for event in mission.timeline)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
            row = f"| {agents} | {given.tasks} | {events} | {label} | {taken[-1]:.1f} | {power.sum():.1f} |"
            print(f"{row} {result.tasks_done} | {peak:.1f} |", flush=True)
        axes.loglog(given.agents, taken, marker="o", label=label)
    axes.set(xlabel="agents", ylabel="processor time (s)")
    axes.legend()
    if given.plot:
        figure.savefig(given.plot)


def throughput(given: argparse.Namespace) -> None:
    """Print how many missions of 20 agents and 40 tasks `gappo` plays per second."""
    policy = load_policy("gappo")
    weights, rates = compiled_weights(policy.network), []
    missions = [
        pack(random_mission(MissionParameters("steady", 20, 40), FIRST_SEED + i)) for i in range(given.missions)
    ]
    for _ in range(given.rounds + 1):
        began = time.process_time()
        for seed, mission in enumerate(missions):
            play(begun(mission, seed), new_buffers(20, 40, policy.parameters.periods), weights, seed)
        rates.append(len(missions) / (time.process_time() - began))
    print(f"missions per second: {max(rates[1:]):.0f} at best, median {np.median(rates[1:]):.0f}")  # the first compiles


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("local")
    one.add_argument("--csv", type=Path, required=True)
    one.add_argument("--missions", type=int, default=100)
    one.add_argument("--rows", default="", help="names, with a semicolon between them; all by default")
    one.add_argument("--first-seed", type=int, default=FIRST_SEED)
    one.set_defaults(command=local)
    other = commands.add_parser("growth")
    other.add_argument("--agents", type=int, nargs="+", default=[500, 1000, 2000])
    other.add_argument("--tasks", type=int, default=500)
    other.add_argument("--policies", nargs="+", default=["greedy", "gappo"])
    other.add_argument("--plot", type=Path)
    other.set_defaults(command=growth)
    last = commands.add_parser("throughput")
    last.add_argument("--missions", type=int, default=60)
    last.add_argument("--rounds", type=int, default=10)
    last.set_defaults(command=throughput)
    given = parser.parse_args()
    given.command(given)


if __name__ == "__main__":
    main()
