"""What a second thread brings: iterations in the same time, and the plan at as many iterations of each thread.

    python tests/benchmarks/threads.py --methods local-search,ga,gappo-ls --seeds 10
    python tests/benchmarks/threads.py --families 500x50,speeds --objective makespan --iterations 300

`T` and `energy` compare N iterations of one thread with 2 N of two, in per cent: negative is better. `more` is the
quotient of the iterations that both make in `--seconds`; where other work is on the machine, it says little, and the
processor time of both is shown. Families are AGENTSxTASKS, or kinds of `variant_kinds.py`.
"""

import argparse
import time

import numpy as np
from variant_kinds import KINDS

from alloc.allocators import Allocator, Budget, Search, load, solve
from alloc.problems import Instance, Objective
from alloc.problems.generate import Family, random_instance


def instance(family: str, seed: int) -> Instance:
    """Return an instance of a family."""
    if family in KINDS:
        return KINDS[family](seed)
    agents, tasks = map(int, family.split("x"))
    return random_instance(Family(agents=agents, tasks=tasks), seed)


def iterations_in(allocator: Allocator, case: Instance, objective: str, seconds: float, threads: int) -> int:
    """Return how many iterations a run makes in so many seconds."""
    search = Search(case, Objective(objective), Budget(seconds), threads=threads)
    allocator.allocate(search)
    return search.iteration


def measure(allocator: Allocator, family: str, options: argparse.Namespace) -> str:
    """Return a row of the table."""
    rows, spent, counts = [], np.zeros(2), np.zeros(2)
    for seed in range(options.seeds):
        case, scores = instance(family, seed), []
        for number, threads in enumerate((1, 2)):
            begin = time.process_time()
            result = solve(
                case,
                allocator,
                objective=options.objective,
                iterations=threads * options.iterations,
                time_limit_s=None,
                seed=seed,
                threads=threads,
            )
            spent[number] += time.process_time() - begin
            scores.append(result.evaluation)
            if options.seconds:
                counts[number] += iterations_in(allocator, case, options.objective, options.seconds, threads)
        one, two = scores
        rows.append(
            (
                100 * (two.served_makespan / one.served_makespan - 1),
                100 * (two.energy / one.energy - 1) if one.energy else 0.0,
                two.is_better_than(one, Objective(options.objective)),
                one.is_better_than(two, Objective(options.objective)),
            )
        )
    makespan, energy, better, worse = np.array(rows, dtype=float).T
    more = f"{counts[1] / counts[0]:>6.2f}" if options.seconds else f"{'-':>6}"
    line = f"{makespan.mean():>+9.4f} {energy.mean():>+9.3f} {int(better.sum()):>7} {int(worse.sum()):>6}"
    return f"{line} {more} {spent[0]:>7.1f} {spent[1]:>7.1f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--methods", default="local-search,ga,gappo-ls")
    parser.add_argument("--families", default="500x50,10000x200,speeds,real")
    parser.add_argument("--objective", default="makespan-energy", choices=["makespan", "makespan-energy"])
    parser.add_argument("--iterations", type=int, default=150, help="of one thread")
    parser.add_argument("--seconds", type=float, default=0.0, help="to count iterations in; 0 leaves that out")
    parser.add_argument("--seeds", type=int, default=10)
    options = parser.parse_args()
    heads = f"{'T %':>9} {'energy %':>9} {'better':>7} {'worse':>6} {'more':>6} {'cpu s':>7} {'cpu s':>7}"
    print(f"{'method':>13} {'family':>10} {heads}")
    for method in options.methods.split(","):
        allocator = load(method)
        for family in options.families.split(","):
            print(f"{method:>13} {family:>10} {measure(allocator, family, options)}", flush=True)


if __name__ == "__main__":
    main()
