"""Policies with local knowledge on missions that no training, tuning or validation saw: `gappo` against each other one.

    python tests/benchmarks/missions_local.py --csv docs/missions/missions.csv
    python tests/benchmarks/missions_local.py --csv new.csv --missions 5 --rows "20/40;10/40" --first-seed 4000000000
    python tests/benchmarks/missions_local.py --csv docs/missions/missions.csv --again "gappo;gappo[periods=1]"

Half of the missions of a row are of the family `steady`, half of `failures`; all policies meet the same. They run in
compiled loops, with the measures of the reference. The CSV has a line for each mission; one that is there is not run
again, so that an interrupted benchmark goes on; `--again` runs policies anew that have changed. The table has, of
`gappo` from each other policy in per cent, paired, with its 95 % interval (Student's t).
"""

import argparse
import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy import stats

from alloc.allocators import load_policy
from alloc.allocators.online.compiled.run import run_compiled
from alloc.problems import Mission, MissionParameters, random_mission
from alloc.problems.missions.radio import Burst, Radio

FIRST_SEED = 3_000_000_000
"""Trainings and tunings draw seeds below 1e9, and their validations begin there."""

ROWS: dict[str, dict[str, object]] = {
    **{f"{n}/{m}": {"agents": n, "tasks": m} for n, m in ((20, 40), (40, 80), (10, 40), (60, 40))},
    **{f"{n}/{m}, radii 0.15": {"agents": n, "tasks": m, "radius": 0.15} for n, m in ((20, 40), (40, 80), (10, 40))},
    "60/40, radii 0.15": {"agents": 60, "radius": 0.15},
    "loss 0": {"loss": 0.0},
    "loss 80 %": {"loss": 0.8},
    "bursts": {"radio": Radio(radius=0.3, burst=Burst(good=1.0, bad=1.0))},
    "delay 0.5 h": {"radio": Radio(radius=0.3, loss=0.2, delay=0.5)},
}
POLICIES = ("gappo", "gappo[periods=1]", "ppo", "hedonic", "auction", "greedy", "nearest")
MEASURES = ("mission_time", "energy", "switches", "messages")
KEPT = ("joins", "appears", "deadline", "growth", "events", "horizon", "knowledge", "sensing", "seed")

Lines = dict[tuple[str, int], dict[str, str]]


def drawn(
    seed: int,
    agents: int = 20,
    tasks: int = 40,
    radius: float = 0.3,
    loss: float = 0.2,
    radio: Radio | None = None,
) -> Mission:
    """Return a mission; `radio` replaces what radius and loss say of it."""
    family = ("steady", "failures")[seed % 2]
    parameters = MissionParameters(family, agents, tasks, radius=radius, sensing=radius, loss=loss)
    mission = random_mission(parameters, seed)
    return (
        mission
        if radio is None
        else Mission(mission.instance, **{name: getattr(mission, name) for name in KEPT}, radio=radio)
    )


def measured(mission: Mission, seed: int, labels: Sequence[str] = POLICIES) -> dict[str, str]:
    """Return the columns of some policies in a mission."""
    found = {}
    for label in labels:
        name, _, periods = label.rstrip("]").partition("[periods=")
        result = run_compiled(mission, load_policy(name, **({"periods": int(periods)} if periods else {})), seed)
        values = [getattr(result, measure) for measure in MEASURES]
        found |= {
            f"{label} {measure}": "" if value is None else f"{value:.4g}"
            for measure, value in zip(MEASURES, values, strict=True)
        }
    return found


def column(lines: list[dict[str, str]], policy: str, measure: str) -> np.ndarray:
    """Return a measure of all missions, NaN where a policy left tasks undone."""
    return np.array([float(line[f"{policy} {measure}"] or "nan") for line in lines])


def against(lines: list[dict[str, str]], rival: str, measure: str) -> str:
    """Return the mean difference of `gappo` from a rival in per cent, its interval, and pairs left out."""
    ratios = column(lines, "gappo", measure) / column(lines, rival, measure)
    kept = 100 * (ratios[~np.isnan(ratios)] - 1)
    half = stats.t.ppf(0.975, len(kept) - 1) * kept.std(ddof=1) / np.sqrt(len(kept))
    left = f" ({len(ratios) - len(kept)})" if len(kept) < len(ratios) else ""
    return f"{kept.mean():+.1f} ± {half:.1f}{left}"


def tell(name: str, lines: list[dict[str, str]], measure: str) -> None:
    """Print a row of a table."""
    print("|", name, "|", " | ".join(against(lines, rival, measure) for rival in POLICIES[1:]), "|", flush=True)


def main() -> None:
    """Run what is missing, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--csv", type=Path, required=True)
    parser.add_argument("--missions", type=int, default=100)
    parser.add_argument("--rows", default="", help="names, with a semicolon between them; all by default")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--again", default="", help="policies to run anew, with a semicolon between them")
    given = parser.parse_args()
    names = given.rows.split(";") if given.rows else list(ROWS)
    header = ["missions", "number", *(f"{policy} {measure}" for policy in POLICIES for measure in MEASURES)]
    if not given.csv.exists():
        given.csv.write_text(",".join(header) + "\n")
    with given.csv.open(newline="") as file:
        done: Lines = {(line["missions"], int(line["number"])): line for line in csv.DictReader(file)}
    if given.again:
        for (name, number), line in done.items():
            mission = drawn(given.first_seed + number, **ROWS[name])
            line |= measured(mission, number, given.again.split(";"))
        with given.csv.open("w", newline="") as file:
            writer = csv.DictWriter(file, header, lineterminator="\n")
            writer.writeheader()
            writer.writerows(done.values())
    for number in range(given.missions):  # all rows grow together
        for name in names:
            if (name, number) not in done:
                mission = drawn(given.first_seed + number, **ROWS[name])
                done[name, number] = {"missions": name, "number": str(number), **measured(mission, number)}
                with given.csv.open("a", newline="") as file:
                    csv.DictWriter(file, header, lineterminator="\n").writerow(done[name, number])
    for measure in ("mission_time", "energy"):
        print(f"\n| {measure} | {' | '.join(POLICIES[1:])} |\n|---|{'--:|' * len(POLICIES[1:])}")
        for name in names:
            tell(name, [line for (row, _), line in done.items() if row == name], measure)
    for name in names:
        lines = [line for (row, _), line in done.items() if row == name]
        means = [f"{np.nanmean(column(lines, policy, one)):.0f}" for policy in POLICIES for one in MEASURES[2:]]
        print(name, "switches and messages of each policy:", *means)


if __name__ == "__main__":
    main()
