r"""Methods on families of instances at several limits, as a table; the experiments that documents have figures of.

    python tests/benchmarks/experiments.py references --store runs.db
    python tests/benchmarks/experiments.py learned rivals --store runs.db
    python tests/benchmarks/experiments.py auto --families real --methods auto milp --time-limits 20 --store runs.db

Runs are those of `alloc compare --store`, and the columns those of its reports (`--report FILE.md`): T against the best
known of each instance, and methods beside each other. Families are those of `alloc compare` without their seeds, or of
`kinds.py`. The best known is that of all runs that the store has of an instance; `references` makes runs for it. Where
numbers of threads are compared, a method is beside itself; iterations are those of one thread: two have twice as many.
"""

import argparse
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kinds import KINDS, LARGE, VARIANTS

from alloc.allocators import Budget
from alloc.allocators.experiments.campaign import Campaign, Resources
from alloc.allocators.experiments.report.standing import OF_BEST, OF_OTHERS, standing_tables
from alloc.allocators.experiments.standings import Best, standings
from alloc.allocators.experiments.store.outcome import Ending
from alloc.allocators.experiments.store.store import Store
from alloc.allocators.experiments.stored import Comparison, Endings, planned
from alloc.cli.commands.experiments.sources import gather
from alloc.cli.options import listed
from alloc.problems import Instance

PAPER = ("paper-1", "paper-2", "paper-3", "paper-4")
HARD = "random[agents=300,tasks=30,battery=30"
UNSEEN = (
    *(f"{HARD},{kind}]" for kind in (
        "sites=clustered,starts=own", "integer=false", "ability=pareto,integer=false", "load=1.4285714285714286",
        "ability=lognormal,ability_max=100,workload=lognormal,integer=false", "load=0.5", "communication_range=0.25",
        "communication_range=0.25,starts=own,dimensions=2", "speed=2,8,starts=own",
    )),
    "random[agents=100,tasks=20,battery=30,speed=0.5,2,starts=own]",
)  # fmt: skip
VARIED = (*VARIANTS, "paper-1", "paper-3")
SIZES = ("random[agents=500,tasks=50]", "random[agents=10000,tasks=200]")
COVERING = tuple(
    f"covering[agents={n},tasks={m},ability_min={low},ability_max={high},workload={workload}]"
    for n, m, low, high in ((30, 10, 100, 800), (40, 16, 1, 100), (60, 20, 1, 100), (100, 40, 20, 50),
                            (100, 25, 1, 1000), (200, 50, 1, 1000), (400, 100, 1, 1000))
    for workload in ("equal", "uniform")
)  # fmt: skip

LEARNED, RIVALS = ("gappo", "gappo-ls"), ("ppo", "a2c", "dqn", "ddpg")
PLAIN = ("cpsat", "milp", "cpsat[descent=false]", "milp[descent=false]", "milp[plain=true]")
HEURISTIC = ("greedy", "local-search", "ga", "hedonic", "auction", "lp-round")


@dataclass(frozen=True)
class Experiment:
    """Families, methods, limits in seconds or a number of iterations, instances of each family, numbers of threads."""

    families: tuple[str, ...]
    methods: tuple[str, ...]
    limits: tuple[float | None, ...]
    seeds: int
    threads: tuple[int, ...] = (1,)
    objective: str = "makespan-energy"
    iterations: int | None = None


EXPERIMENTS = {
    "references": Experiment(PAPER + UNSEEN, ("cpsat", "milp", "local-search"), (10.0,), 10),
    "learned": Experiment(PAPER, ("gappo",), (1.0,), 100, threads=(2,)),
    "hybrid": Experiment(PAPER, ("local-search", "gappo-ls"), (0.1, 1.0), 25),
    "rivals": Experiment(("paper-1",), RIVALS, (2.0,), 25),
    "first": Experiment(("paper-1", "paper-4"), (*LEARNED, *RIVALS, "greedy", "ga", "hedonic"), (1.0,), 20),
    "unseen": Experiment(UNSEEN, LEARNED, (2.0,), 10),
    "local-search": Experiment(PAPER, ("local-search",), (0.1, 1.0), 100),
    "large": Experiment(tuple(LARGE), ("local-search", *LEARNED), (10.0,), 10),
    "exact": Experiment(PAPER, PLAIN, (10.0,), 100, objective="makespan"),
    "energy": Experiment(PAPER, ("milp",), (3.0, 10.0, 30.0), 5, threads=(2,)),
    "ga": Experiment(PAPER, ("ga",), (10.0,), 20, objective="makespan"),
    "all": Experiment((*PAPER, UNSEEN[0], UNSEEN[4], UNSEEN[7], UNSEEN[8]),
                      (*HEURISTIC, "cpsat", "milp", *LEARNED, *RIVALS), (0.03, 0.3, 3.0), 3),
    "auto": Experiment(VARIED, ("auto", "local-search", "milp"), (1.0, 5.0), 1, objective="makespan"),
    "variants": Experiment(VARIED, ("auto",), (10.0,), 4, objective="makespan"),
    "covering": Experiment(COVERING, ("classes", "cpsat"), (10.0,), 2, objective="makespan"),
    "threads": Experiment((*SIZES, "speeds", "real"), ("local-search", "ga", "gappo-ls"), (None,), 10, threads=(1, 2),
                          iterations=150),
}  # fmt: skip


def ran(
    store: Store, instances: Sequence[Instance], methods: Sequence[str], budget: Budget, *, threads: int = 1,
    objective: str = "makespan", workers: int | None = None,
) -> tuple[Comparison, Endings]:  # fmt: skip
    """Make the runs that the store has not yet, and return how all ended."""
    variants = {
        label: (name, settings or {}) for label, (name, settings) in listed(",".join(methods), "--methods").items()
    }
    comparison = planned(store, instances, variants, [0], objective=objective, budget=budget, threads=threads)
    Campaign(store, list(comparison.jobs.values()), Resources(workers)).run(threading.Event())
    return comparison, comparison.endings(store)


def known(store: Store, comparison: Comparison) -> list[Best]:
    """Return the best that the store has of each instance."""
    found: dict[str, list[Ending]] = {}
    for record in store.records().values():
        found.setdefault(record.run.instance, []).append(record.ending)
    hashes = {number: job.run.instance for (number, _, _), job in comparison.jobs.items()}
    return [Best.of(found[instance]) for instance in hashes.values()]


def lines(experiment: Experiment, store: Store, first: int, workers: int | None) -> Iterator[list[str]]:
    """Make the runs that the store has not yet, and yield a line per family, limit, number of threads and method."""
    seeds = range(first, first + experiment.seeds)
    energy = experiment.objective == "makespan-energy"
    for family in experiment.families:
        own = KINDS.get(family)
        instances = [own(seed) for seed in seeds] if own else gather([f"{family}:{seeds[0]}-{seeds[-1]}"])
        for limit in experiment.limits:
            found: dict[tuple[str, int], Sequence[Sequence[Ending | None]]] = {}
            for threads in experiment.threads:
                budget = Budget(limit, experiment.iterations and threads * experiment.iterations)
                comparison, endings = ran(store, instances, experiment.methods, budget, threads=threads,
                                          objective=experiment.objective, workers=workers)  # fmt: skip
                found |= {(label, threads): runs for label, runs in endings.items()}
            bests = known(store, comparison)
            told = f"{limit:g} s" if limit else f"{experiment.iterations} iterations"
            for group in beside(found):
                standing = standings({str(key): found[key] for key in group}, bests, limit, energy=energy)
                best, others = (table.rows for table in standing_tables(standing))
                for (label, threads), ours, theirs in zip(group, best, others, strict=True):
                    yield [family, told, str(threads), label, *ours[1:], *theirs[1:]]


def beside(found: Mapping[tuple[str, int], object]) -> list[list[tuple[str, int]]]:
    """Return what is beside each other: all methods, or where there are several numbers of threads each with itself."""
    if len({threads for _, threads in found}) == 1:
        return [list(found)]
    return [[key for key in found if key[0] == label] for label in dict.fromkeys(label for label, _ in found)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("experiments", nargs="+", choices=list(EXPERIMENTS), metavar="EXPERIMENT",
                        help=f"of {', '.join(EXPERIMENTS)}")  # fmt: skip
    parser.add_argument("--store", type=Path, required=True, metavar="FILE", help="where runs are kept")
    parser.add_argument("--families", nargs="+", help="instead of those of the experiment, as are the next")
    parser.add_argument("--methods", nargs="+")
    parser.add_argument("--time-limits", nargs="+", type=float, dest="limits", help="seconds")
    parser.add_argument("--iterations", type=int, help="of one thread")
    parser.add_argument("--objective", choices=["makespan", "makespan-energy"])
    parser.add_argument("--seeds", type=int, help="instances of each family")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--workers", type=int, help="runs at a time")
    options = parser.parse_args()
    given = {name: tuple(value) if isinstance(value, list) else value for name, value in vars(options).items()
             if value is not None and name in Experiment.__annotations__}  # fmt: skip
    with Store(options.store) as store:
        for name in options.experiments:
            experiment = replace(EXPERIMENTS[name], **given)
            print(f"\n{name}: {experiment.objective}\n", flush=True)
            head = ("family", "limit", "threads", *OF_BEST, *OF_OTHERS[1:])
            print("| " + " | ".join(head) + " |\n" + "|---" * 4 + "|--:" * (len(head) - 4) + "|")
            for line in lines(experiment, store, options.first_seed, options.workers):
                print("| " + " | ".join(line) + " |", flush=True)


if __name__ == "__main__":
    main()
