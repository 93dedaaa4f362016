r"""Methods on families of instances at several limits, as a table; the experiments that documents have figures of.

    python tests/benchmarks/experiments.py references --store runs.db
    python tests/benchmarks/experiments.py learned rivals --store runs.db
    python tests/benchmarks/experiments.py auto --families real --methods auto milp --time-limits 20 --store runs.db

Runs are those of `alloc compare --store`: each is made once, in a process of its own, with processors to itself; what
else is to be known of them, `alloc compare` and `alloc report` tell. Families are those of `alloc compare` without
their seeds, or of `kinds.py`. What an instance is compared with is the best of all runs that the store has of it: the
greatest bound, the least T, and the least energy at a T that is at most 0.01 % more; `references` makes runs for that.
*Energy gap* is to the bound of the run itself. *Behind* is by how much more T, and energy at no less T, a method has
than the best of the other rows with the same family and limit, or than itself with another number of threads; below 0
it leads. A method is *first* on an instance if none that kept to the limit has a better answer: fewer tasks unserved,
then less T, then less energy; several can be. Late runs (20 % and 20 ms beyond the limit) are never first. Iterations
are those of one thread: two threads have twice as many.
"""

import argparse
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from kinds import KINDS, LARGE, VARIANTS

from alloc.allocators import Budget
from alloc.allocators.experiments.campaign import Campaign, Means
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.store import Store
from alloc.allocators.experiments.stored import Comparison, planned
from alloc.cli.commands.experiments.sources import gather
from alloc.cli.options import BETWEEN_SETTINGS, values
from alloc.problems import Instance

EQUAL, ALIKE = 1e-9, 1e-4
"""Relative differences up to which two figures are equal, and up to which makespans allow to compare energies."""

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
    "auto": Experiment(tuple(VARIANTS), ("auto", "local-search", "milp"), (1.0, 5.0), 1, objective="makespan"),
    "variants": Experiment(tuple(VARIANTS), ("auto",), (10.0,), 4, objective="makespan"),
    "covering": Experiment(COVERING, ("classes", "cpsat"), (10.0,), 2, objective="makespan"),
    "threads": Experiment((*SIZES, "speeds", "real"), ("local-search", "ga", "gappo-ls"), (None,), 10, threads=(1, 2),
                          iterations=150),
}  # fmt: skip

HEAD = ("family", "method", "threads", "limit", "T", "worst T", "least T", "proven", "beyond bound", "worst",
        "energy / least", "at least T", "energy gap", "worst", "behind", "worst", "energy behind", "unserved",
        "no answer", "first T", "first ms", "s", "first")  # fmt: skip


@dataclass(frozen=True)
class Best:
    """What is known of an instance: the greatest bound, the least makespan, and the least energy at it."""

    bound: float
    makespan: float
    energy: float

    @classmethod
    def of(cls, endings: Sequence[Ending]) -> "Best":
        """Return the best of all runs on one instance."""
        solved = [one for one in endings if one.makespan is not None and one.energy is not None]
        makespan = min((one.makespan for one in solved), default=np.inf)
        energies = [one.energy for one in solved if one.makespan <= makespan * (1 + ALIKE)]
        return cls(
            max((one.lower_bound or 0.0 for one in endings), default=0.0), makespan, min(energies, default=np.nan)
        )


Score = tuple[float, float, float]
WORST: Score = (np.inf, np.inf, np.inf)


def score(ending: Ending | None, limit: float, *, energy: bool) -> Score:
    """Return what is compared, the less the better; equal figures are made so, and late answers are the worst."""
    if ending is None or ending.outcome is not Outcome.SOLVED or (ending.runtime_s or 0.0) > 1.2 * limit + 0.02:
        return WORST
    figures = (float(ending.unserved or 0), ending.served_makespan, ending.energy if energy else 0.0)
    return tuple(float(f"{figure:.9g}") for figure in figures)  # type: ignore[return-value]


def behind(own: Ending, others: Sequence[Ending | None]) -> tuple[float, float]:
    """Return by which part T, and the energy at no less T, are above the least of others; nan where there is none."""
    served = [one for one in others if one is not None and one.makespan is not None]
    if own.makespan is None or not served:
        return np.nan, np.nan
    energies = [one.energy for one in served if one.makespan <= own.makespan * (1 + EQUAL)]
    least = min(energies, default=0.0)
    return own.makespan / min(one.makespan for one in served) - 1, own.energy / least - 1 if least else np.nan


def share(figures: Sequence[float | None], sign: str = "") -> tuple[str, str]:
    """Return mean and greatest of what is known, in per cent."""
    known = np.array([figure for figure in figures if figure is not None and np.isfinite(figure)])
    return (f"{known.mean():{sign}.3%}", f"{known.max():{sign}.3%}") if len(known) else ("-", "-")


def columns(endings: Sequence[Ending | None], rivals: Sequence[Sequence[Ending | None]], bests: Sequence[Best],
            firsts: int) -> list[str]:  # fmt: skip
    """Return the figures of a method in a family; `rivals` are how the others ended, by instance."""
    found = [row for row in zip(endings, rivals, bests, strict=True) if row[0] and row[0].served_makespan is not None]
    if not found:
        return ["-"] * (len(HEAD) - 5) + ["0"]
    solved = [one for one, _, _ in found]
    makespan, bound, least = (
        np.array(figures)
        for figures in zip(*((one.served_makespan, best.bound, best.makespan) for one, _, best in found), strict=True)
    )
    ratio = np.array([one.energy / best.energy if best.energy else np.nan for one, _, best in found])
    is_least, proven = makespan <= least * (1 + EQUAL), sum(one.status == "optimal" for one in solved)
    points, lost = [one.trace[0] for one in solved if one.trace], [behind(one, others) for one, others, _ in found]
    firsts_of_trace = [point[1] for point in points if point[1]]
    return [
        f"{makespan.mean():.4f}", f"{makespan.max():.4f}", f"{is_least.sum()} of {len(endings)}", str(proven),
        *share(makespan / bound - 1), f"{ratio.mean():.3f}", f"{ratio[is_least].mean():.3f}" if is_least.any() else "-",
        *share([one.energy_gap for one in solved]), *share([one for one, _ in lost], "+"),
        share([one for _, one in lost], "+")[0], str(sum(one.unserved or 0 for one in solved)),
        str(len(endings) - len(solved)), f"{np.mean(firsts_of_trace):.4f}" if firsts_of_trace else "-",
        f"{1000 * np.median([point[0] for point in points]):.1f}" if points else "-",
        f"{np.mean([one.runtime_s for one in solved]):.3f}", str(firsts),
    ]  # fmt: skip


def ran(
    store: Store, instances: Sequence[Instance], methods: Sequence[str], budget: Budget, *, threads: int = 1,
    objective: str = "makespan", workers: int | None = None,
) -> tuple[Comparison, Mapping[str, list[Ending]]]:  # fmt: skip
    """Make the runs that the store has not yet, and return how all ended, by method."""
    comparison = planned(store, instances, {label: parsed(label) for label in methods}, [0], objective=objective,
                         budget=budget, threads=threads)  # fmt: skip
    Campaign(store, list(comparison.jobs.values()), Means(workers)).run(threading.Event())
    return comparison, {label: [one for (one,) in runs] for label, runs in comparison.endings(store).items()}


def lines(experiment: Experiment, store: Store, first: int, workers: int | None) -> Iterator[list[str]]:
    """Make the runs that the store has not yet, and yield a line per family, limit, method and number of threads."""
    ends = first, first + experiment.seeds
    for family in experiment.families:
        own = KINDS.get(family)
        instances = [own(seed) for seed in range(*ends)] if own else gather([f"{family}:{first}-{ends[1] - 1}"])
        for limit in experiment.limits:
            found: dict[tuple[str, int], list[Ending]] = {}
            for threads in experiment.threads:
                iterations = experiment.iterations and threads * experiment.iterations
                comparison, runs = ran(store, instances, experiment.methods, Budget(limit, iterations),
                                       threads=threads, objective=experiment.objective, workers=workers)  # fmt: skip
                found |= {(label, threads): endings for label, endings in runs.items()}
            known: dict[str, list[Ending]] = {}
            for record in store.records().values():
                known.setdefault(record.run.instance, []).append(record.ending)
            places = [(number, experiment.methods[0], 0) for number in range(len(instances))]
            bests = [Best.of(known[comparison.jobs[place].run.instance]) for place in places]
            energy = experiment.objective == "makespan-energy"
            scores = {key: [score(one, limit or np.inf, energy=energy) for one in runs] for key, runs in found.items()}
            least = [min(of_seed) for of_seed in zip(*scores.values(), strict=True)]
            told = f"{limit:g} s" if limit else f"{experiment.iterations} iterations"
            for key, endings in found.items():
                firsts = sum(one == best < WORST for one, best in zip(scores[key], least, strict=True))
                threaded = len(experiment.threads) > 1
                rivals = [
                    runs for other, runs in found.items() if other != key and (other[0] == key[0] or not threaded)
                ]
                others = list(zip(*rivals, strict=True)) or [()] * len(instances)
                yield [family, key[0], str(key[1]), told, *columns(endings, others, bests, firsts)]


def parsed(label: str) -> tuple[str, dict[str, object]]:
    """Return the name and the parameters of a method that is written as on a command line."""
    name, bracket, settings = label.removesuffix("]").partition("[")
    return name, values(BETWEEN_SETTINGS.split(settings)) if bracket else {}


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
            print("| " + " | ".join(HEAD) + " |\n|---|---|" + "--:|" * (len(HEAD) - 2))
            for line in lines(experiment, store, options.first_seed, options.workers):
                print("| " + " | ".join(line) + " |", flush=True)


if __name__ == "__main__":
    main()
