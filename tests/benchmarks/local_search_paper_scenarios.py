"""T and energy of `local-search` on the paper's scenarios, as a table.

    python tests/benchmarks/local_search_paper_scenarios.py --scenarios 1 2 3 4 --seeds 100
    python tests/benchmarks/local_search_paper_scenarios.py --energy-limit 3 --keep    # better energies are kept

The first row of each scenario is for the makespan alone, the second for the energy at it. Energies are compared with
the least ever met at T = 1, which are kept in `local_search_best_known.json` beside this file, by scenario and seed;
what a run meets counts as well. They were made by the second command with limits of 1 and 2.5 s.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from alloc.allocators import load, solve
from alloc.allocators.result import Result
from alloc.problems.generate import paper

BEST_KNOWN = Path(__file__).with_name("local_search_best_known.json")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--method", default="local-search")
    parser.add_argument("--scenarios", type=int, nargs="+", default=[1, 2, 3, 4], choices=[1, 2, 3, 4])
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument(
        "--makespan-limit", type=float, default=0.1, help="seconds for the makespan alone; 0: no such row"
    )
    parser.add_argument("--energy-limit", type=float, default=1.0, help="seconds for both; 0: no such row")
    parser.add_argument("--keep", action="store_true", help="write better energies to the file of the best known")
    options = parser.parse_args()
    allocator = load(options.method)
    print(
        f"{'method':>14} {'scenario':>8} {'objective':>15} {'limit s':>8} {'T = 1':>10} {'worst T':>8} {'mean s':>7}",
        end="",
    )
    print(f" {'energy / best':>13} {'worst':>6}")
    for scenario in options.scenarios:
        for objective, limit in (("makespan", options.makespan_limit), ("makespan-energy", options.energy_limit)):
            if limit == 0:
                continue
            results = [
                solve(paper(scenario, seed), allocator, objective=objective, time_limit_s=limit, threads=1)
                for seed in range(options.seeds)
            ]
            line = f"{options.method:>14} {scenario:>8} {objective:>15} {limit:>8g} {figures(results)}"
            if objective == "makespan-energy":
                ratios = compare(scenario, results, keep=options.keep)
                line += f" {ratios.mean():>13.4f} {ratios.max():>6.3f}"
            print(line, flush=True)


def figures(results: list[Result]) -> str:
    """Return how many reach T = 1, the worst T, and the mean time."""
    makespans = np.array([result.makespan for result in results])
    reached = f"{(makespans < 1 + 1e-9).sum()} of {len(results)}"
    return f"{reached:>10} {makespans.max():>8.5f} {np.mean([result.runtime_s for result in results]):>7.4f}"


def compare(scenario: int, results: list[Result], *, keep: bool) -> np.ndarray:
    """Return energies over the best known, those of these results included."""
    known = json.loads(BEST_KNOWN.read_text()) if BEST_KNOWN.exists() else {}
    best = known.setdefault(str(scenario), [])
    best += [None] * (len(results) - len(best))
    for seed, result in enumerate(results):
        if result.makespan < 1 + 1e-9 and (best[seed] is None or result.energy < best[seed]):
            best[seed] = round(result.energy, 9)
    if keep:
        rows = [f'"{key}": {json.dumps(known[key])}' for key in sorted(known)]
        BEST_KNOWN.write_text("{\n" + ",\n".join(rows) + "\n}\n")
    return np.array([result.energy / (least or np.inf) for result, least in zip(results, best, strict=False)])


if __name__ == "__main__":
    main()
