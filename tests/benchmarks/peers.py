"""Our methods beside naive models and published programs, on the same instances: docs/benchmarks/peers.md.

    python tests/benchmarks/peers.py                                  # a look: small families, 2 seconds a run
    python tests/benchmarks/peers.py --families all --methods all --seeds 5 --time-limit 30 --pygrape DIR --write

Every run is a process of its own (`peers_run.py`), so that libraries do not clash and memory is each method's own.
`naive-cvxpy` and `naive-cpsat` decide every pair of agent and task (e_ij); `prtpy` is its integer programme for the
weighted largest smallest sum (pip install alloc-mrta[bench]); `pygrape` needs a folder with pyGRAPE.py
(github.com/inmo-jang/pyGRAPE), and `hedonic@0.5` or `pygrape@0.5` lets agents hear each other up to that distance. All
answers are scored by `alloc.problems.evaluate`; gaps are against the best bound that any of our methods proved on
that instance, the makespans of exact methods included. Figures are means over the seeds.
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from machine_covering import SHAPES as COVERING

from alloc.allocators import describe, names
from alloc.problems import (
    Allocation,
    Instance,
    evaluate,
    machine_covering,
    paper,
    random_instance,
    write_instance,
)
from alloc.problems import Family as Spread

RUN = Path(__file__).with_name("peers_run.py")
PAGE = Path(__file__).parents[2] / "docs" / "benchmarks" / "peers.md"
BEGIN, END = "<!-- table of tests/benchmarks/peers.py -->", "<!-- end of table -->"
LOADING_S = 60.0
"""What a process may take beyond its time limit, for imports and for what does not keep to limits."""

Maker = Callable[[int], Instance]


def families() -> dict[str, tuple[str, Maker]]:
    """Return objective and maker of the instances of each family."""
    energy, plain = "makespan-energy", "makespan"
    found: dict[str, tuple[str, Maker]] = {}
    for number in (1, 2, 3, 4):
        found[f"paper-{number}"] = (energy, lambda seed, number=number: paper(number, seed))
    found["reach"] = (energy, lambda seed: random_instance(Spread(starts="own", communication_range=(0.4, 0.8)), seed))
    found["speeds"] = (energy, lambda seed: random_instance(Spread(starts="own", speed=(0.5, 2.0), battery=None), seed))
    for kind, sizes in COVERING.items():
        for n, m, low, high in sizes:
            for equal in (True, False):
                name = f"{kind} ({n},{m}) U[{low},{high}] {'equal' if equal else 'unequal'}"
                found[name] = (plain, lambda seed, size=(n, m, low, high), equal=equal: machine_covering(
                    *size, seed, equal=equal))  # fmt: skip
    return found


QUICK = ["paper-1", "reach", "speeds", "small (9,3) U[1,20] equal", "small (9,3) U[1,20] unequal"]
QUICK_METHODS = ["naive-cvxpy", "naive-cpsat", "prtpy", "greedy", "local-search", "hedonic", "auction", "cpsat"]
NAIVE = ["naive-cvxpy", "naive-cpsat", "prtpy"]


@dataclass(frozen=True)
class Row:
    """What one method made of one instance; `why` says why there is nothing."""

    makespan: float = math.nan
    energy: float = math.nan
    bound: float = 0.0
    seconds: float = math.nan
    memory_mib: float = math.nan
    why: str = ""


def measure(method: str, instance: Instance, objective: str, options: argparse.Namespace) -> Row:
    """Run one method on one instance in a process of its own, and score its answer."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "instance.npz"
        write_instance(instance, path)
        command = [sys.executable, str(RUN), method, str(path), objective, str(options.time_limit)]
        command += [str(options.threads), str(options.pygrape or "")]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, timeout=options.time_limit + LOADING_S, check=False
            )
        except subprocess.TimeoutExpired:
            return Row(why=f"not done {LOADING_S:.0f} s after its limit")
    if done.returncode:
        return Row(why=(done.stderr.strip().splitlines() or ["failed"])[-1][:100])
    answer = json.loads(done.stdout.splitlines()[-1])
    if "why" in answer:
        return Row(why=answer["why"], seconds=answer.get("seconds", math.nan))
    score = evaluate(instance, Allocation(np.array(answer["task"], dtype=np.intp)))
    assert not score.violations, f"{method} sends agents where they cannot go"
    makespan = math.inf if score.makespan is None else score.makespan
    bound = answer["bound"] or 0.0
    return Row(makespan, score.energy, bound, answer["seconds"], answer["memory_mib"])


def lines(family: str, objective: str, results: dict[str, list[Row]]) -> list[str]:
    """Return a row of the table per method."""
    seeds = len(next(iter(results.values())))
    bounds = [max(rows[seed].bound for rows in results.values()) for seed in range(seeds)]
    table = []
    for method, rows in results.items():
        solved = [(row, bound) for row, bound in zip(rows, bounds, strict=True) if not row.why]
        if not solved:
            table.append(f"| {family} | {method} | - | - | - | - | - | {rows[0].why} |")
            continue
        gap = np.mean(
            [(row.makespan - bound) / row.makespan if row.makespan < math.inf else 1 for row, bound in solved]
        )
        makespan, seconds = np.mean([row.makespan for row, _ in solved]), np.mean([row.seconds for row, _ in solved])
        energy = f"{np.mean([row.energy for row, _ in solved]):.1f}" if objective == "makespan-energy" else "-"
        memory = np.mean([row.memory_mib for row, _ in solved])
        remark = f"{len(solved)} of {seeds} answered" if len(solved) < seeds else ""
        table.append(
            f"| {family} | {method} | {makespan:.4f} | {gap:.2%} | {energy} | {seconds:.3f} | {memory:.0f} | {remark} |"
        )
    return table


def chosen_methods(options: argparse.Namespace) -> list[str]:
    if options.methods == "all":
        chosen = [*NAIVE, *(name for name in names() if not describe(name).missing)]
    else:
        chosen = QUICK_METHODS if options.methods == "quick" else options.methods.split(",")
    if options.pygrape:
        chosen = [*chosen, *(name for name in options.communication.split(",") if name)]
    return chosen


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--families", default="quick", help="quick, all, or names (or their beginnings) split by ;")
    parser.add_argument("--methods", default="quick", help="quick, all, or names split by commas")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--time-limit", type=float, default=2.0, help="seconds per run")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--pygrape", type=Path, help="folder with pyGRAPE.py; left out without")
    parser.add_argument(
        "--communication", default="pygrape,pygrape@0.5,hedonic@0.5", help="methods to add with --pygrape"
    )
    parser.add_argument("--write", action="store_true", help=f"put the table into {PAGE.name}")
    options = parser.parse_args()
    known = families()
    begins = tuple(QUICK if options.families == "quick" else options.families.split(";"))
    wanted = [name for name in known if options.families == "all" or name.startswith(begins)]
    table = ["| instances | method | T | gap | energy | s | MiB | |", "|---|---|---|---|---|---|---|---|"]
    print("\n".join(table), flush=True)
    for family in wanted:
        objective, maker = known[family]
        instances = [maker(seed) for seed in range(options.first_seed, options.first_seed + options.seeds)]
        results = {
            method: [measure(method, instance, objective, options) for instance in instances]
            for method in chosen_methods(options)
        }
        found = lines(family, objective, results)
        print("\n".join(found), flush=True)
        table += found
    if options.write:
        text = PAGE.read_text(encoding="utf-8")
        before, _, rest = text.partition(BEGIN)
        note = f"\n\n{options.seeds} seeds, {options.time_limit:g} s, {options.threads} threads.\n\n"
        PAGE.write_text(
            before + BEGIN + note + "\n".join(table) + "\n\n" + END + rest.partition(END)[2], encoding="utf-8"
        )


if __name__ == "__main__":
    main()
