"""Whether `auto` is ever behind a single method: makespan, and energy at equal makespan, on the kinds of variant_kinds.

    python tests/benchmarks/auto_against_methods.py --time-limits 1,5 --seeds 1
    python tests/benchmarks/auto_against_methods.py --kinds real --objectives makespan --methods milp --time-limits 20

For each kind, objective and limit a line: by how much the makespan of `auto` exceeds the least of the others, mean and
worst over the seeds, and which method that is; with the energy in the objective, also by how much its energy exceeds
the least of those that are no slower. Negative figures are leads of `auto`. A method that refuses an instance is left
out.
"""

import argparse

from variant_kinds import KINDS, clock_of_limits, instance

from alloc.allocators import load, solve
from alloc.allocators.result import Result
from alloc.problems import Instance, Objective, RefusedError

METHODS = "local-search,cpsat,milp,lp-round,gappo,gappo-ls,ga,greedy"

EQUAL = 1e-9
"""Relative difference up to which two makespans are equal."""

Gap = tuple[float, str]
"""How much more `auto` has than the best other method, as a part, and that method."""


def run(case: Instance, method: str, objective: Objective, limit: float, threads: int) -> Result | None:
    """Run one method; None where it refuses, or serves too few tasks."""
    try:
        allocator = method if method == "auto" else load(method)
        result = solve(case, allocator, objective=objective, time_limit_s=limit, threads=threads)
    except RefusedError:
        return None
    return None if result.makespan is None else result


def gap(value: float, others: dict[str, float]) -> Gap:
    """Return by how much `value` exceeds the least of the others."""
    best = min(others, key=lambda name: others[name])
    return (value / others[best] - 1 if others[best] > 0 else 0.0), best


def gaps(auto: Result, others: dict[str, Result]) -> tuple[Gap, Gap]:
    """Return the gaps of makespan and of energy; the energy counts where a method is no slower than `auto`."""
    assert auto.makespan is not None
    assert auto.energy is not None
    makespans = {name: each.makespan for name, each in others.items() if each.makespan is not None}
    energies = {
        name: each.energy
        for name, each in others.items()
        if each.energy is not None and makespans[name] <= auto.makespan * (1 + EQUAL)
    }
    return gap(auto.makespan, makespans), gap(auto.energy, energies) if energies else (0.0, "-")


def column(found: list[Gap]) -> str:
    """Return mean and worst in per cent, and the method of the worst."""
    worst = max(found)
    return f" {100 * sum(value for value, _ in found) / len(found):>8.3f} {100 * worst[0]:>8.3f} {worst[1]:>13}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", default=",".join(KINDS), help="comma between")
    parser.add_argument("--methods", default=METHODS)
    parser.add_argument("--objectives", default="makespan,makespan-energy")
    parser.add_argument("--time-limits", default="1,5", help="seconds")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--processor-time", action="store_true", help="limits count the time of this process alone")
    parser.add_argument("--each", action="store_true", help="also a line for each run")
    options = parser.parse_args()
    heads = "".join(f" {'mean %':>8} {'worst %':>8} {'against':>13}" for _ in range(2))
    print(f"{'':>10} {'':>15} {'':>6} {'makespan':>31} {'energy':>31}")
    print(f"{'kind':>10} {'objective':>15} {'limit':>6}{heads}  picked", flush=True)
    for kind in options.kinds.split(","):
        for objective in map(Objective, options.objectives.split(",")):
            for limit in map(float, options.time_limits.split(",")):
                with clock_of_limits(processor_time=options.processor_time):
                    print(row(kind, objective, limit, options), flush=True)


def row(kind: str, objective: Objective, limit: float, options: argparse.Namespace) -> str:
    """Run all methods on the instances of one kind, and return the line of the table."""
    found, picked = [], set()
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        case, results = instance(kind, seed), {}
        for method in ["auto", *options.methods.split(",")]:
            result = run(case, method, objective, limit, options.threads)
            if result is None:
                continue
            results[method] = result
            if options.each:
                bounds = f"bound {result.lower_bound:.9g} E {result.energy:.6g} bound {result.energy_lower_bound}"
                print(
                    f"# {kind} {seed} {objective.value} {limit:g} {method} T {result.makespan:.9g} {bounds}", flush=True
                )
        auto = results.pop("auto")
        picked.add(auto.method)
        found.append(gaps(auto, results))
    makespan = column([each[0] for each in found])
    energy = column([each[1] for each in found]) if objective is Objective.MAKESPAN_ENERGY else f"{'':>32}"
    return f"{kind:>10} {objective.value:>15} {limit:>6g}{makespan}{energy}  {', '.join(sorted(picked))}"


if __name__ == "__main__":
    main()
