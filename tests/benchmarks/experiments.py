r"""Methods on families of instances at several limits, as a table; the experiments that documents have figures of.

    python tests/benchmarks/experiments.py references --store runs.db
    python tests/benchmarks/experiments.py learned rivals --store runs.db

Runs are those of `alloc compare --store`: each is made once, in a process of its own, with processors to itself. What
an instance is compared with is the best of all runs that the store has of it: the greatest bound, the least T, and the
least energy at a T that is at most 0.01 % more; `references` makes runs for that. A method is *first* on an instance if
none that kept to the limit has a better answer: fewer tasks unserved, then less T, then less energy; several can be.
Late runs (20 % and 20 ms beyond the limit) are never first. What else is to be known of the same runs, `alloc compare`
tells.
"""

import argparse
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from alloc.allocators import Budget
from alloc.allocators.experiments.campaign import Campaign, Means
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.store import Store
from alloc.allocators.experiments.stored import planned
from alloc.cli.commands.experiments.sources import gather
from alloc.cli.options import BETWEEN_SETTINGS, values
from alloc.problems import paper_like

EQUAL, ALIKE = 1e-9, 1e-4
"""Relative differences up to which two figures are equal, and up to which makespans allow to compare energies."""

PAPER = ("paper-1", "paper-2", "paper-3", "paper-4")
HARD = "random[agents=300,tasks=30,battery=30"
KINDS = (
    "sites=clustered,starts=own",
    "integer=false",
    "ability=lognormal,ability_max=100,workload=lognormal,integer=false",
    "ability=pareto,integer=false",
    "load=1.4285714285714286",
    "load=0.5",
    "communication_range=0.25",
    "communication_range=0.25,starts=own,dimensions=2",
    "speed=2,8,starts=own",
)
UNSEEN = (*(f"{HARD},{kind}]" for kind in KINDS), "random[agents=100,tasks=20,battery=30,speed=0.5,2,starts=own]")
LARGE = {
    "2000/100": lambda seed: paper_like(2000, 100, 9600, seed, battery=30.0),
    "5000/200": lambda seed: paper_like(5000, 200, 24000, seed, battery=30.0),
}
"""Like the paper's scenarios 3 and 4: 4.8 units of ability per agent."""

LEARNED, RIVALS = ("gappo", "gappo-ls"), ("ppo", "a2c", "dqn", "ddpg")


@dataclass(frozen=True)
class Experiment:
    """Families as `alloc compare` takes them but for their seeds, or of `LARGE`; methods, and seconds."""

    families: tuple[str, ...]
    methods: tuple[str, ...]
    limits: tuple[float, ...]
    seeds: int
    threads: int = 1
    objective: str = "makespan-energy"


EXPERIMENTS = {
    "references": Experiment(PAPER + UNSEEN, ("cpsat", "milp", "local-search"), (10.0,), 10),
    "learned": Experiment(PAPER, ("gappo",), (1.0,), 100, threads=2),
    "hybrid": Experiment(PAPER, ("local-search", "gappo-ls"), (0.1, 1.0), 25),
    "rivals": Experiment(("paper-1",), RIVALS, (2.0,), 25),
    "first": Experiment(("paper-1", "paper-4"), (*LEARNED, *RIVALS, "greedy", "ga", "hedonic"), (1.0,), 20),
    "unseen": Experiment(UNSEEN, LEARNED, (2.0,), 10),
    "local-search": Experiment(PAPER, ("local-search",), (0.1, 1.0), 100),
    "large": Experiment(tuple(LARGE), ("local-search", *LEARNED), (10.0,), 10),
    "exact": Experiment(PAPER, ("cpsat", "milp", "cpsat[descent=false]", "milp[descent=false]", "milp[plain=true]"),
                        (10.0,), 100, objective="makespan"),
    "ga": Experiment(PAPER, ("ga",), (10.0,), 20, objective="makespan"),
    "all": Experiment((*PAPER, UNSEEN[0], UNSEEN[2], UNSEEN[7], UNSEEN[8]), ("greedy", "local-search", "ga", "hedonic",
                      "auction", "lp-round", "cpsat", "milp", *LEARNED, *RIVALS), (0.03, 0.3, 3.0), 3),
}  # fmt: skip

HEAD = ("family", "method", "limit s", "T", "worst T", "least T", "beyond bound", "worst", "energy / least",
        "at least T", "unserved", "no answer", "first T", "first ms", "s", "first")  # fmt: skip


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


def columns(endings: Sequence[Ending | None], bests: Sequence[Best], firsts: int) -> list[str]:
    """Return the figures of a method in a family."""
    solved = [(one, best) for one, best in zip(endings, bests, strict=True) if one and one.outcome is Outcome.SOLVED]
    if not solved:
        return ["-"] * (len(HEAD) - 4) + ["0"]
    makespan, bound, least = (
        np.array(values)
        for values in zip(*((one.served_makespan, best.bound, best.makespan) for one, best in solved), strict=True)
    )
    beyond = makespan / bound - 1
    ratio = np.array([one.energy / best.energy for one, best in solved])
    is_least = makespan <= least * (1 + EQUAL)
    points = [one.trace[0] for one, _ in solved if one.trace]
    return [
        f"{makespan.mean():.4f}", f"{makespan.max():.4f}", f"{is_least.sum()} of {len(endings)}",
        f"{beyond.mean():.2%}", f"{beyond.max():.2%}", f"{ratio.mean():.3f}",
        f"{ratio[is_least].mean():.3f}" if is_least.any() else "-",
        str(sum(one.unserved or 0 for one, _ in solved)), str(len(endings) - len(solved)),
        f"{np.mean(first):.4f}" if (first := [point[1] for point in points if point[1]]) else "-",
        f"{1000 * np.median([point[0] for point in points]):.1f}" if points else "-",
        f"{np.mean([one.runtime_s for one, _ in solved]):.3f}", str(firsts),
    ]  # fmt: skip


def lines(experiment: Experiment, store: Store, seeds: int, workers: int | None) -> Iterator[list[str]]:
    """Make the runs that the store has not yet, and yield a line per family, limit and method."""
    variants = {label: parsed(label) for label in experiment.methods}
    for family in experiment.families:
        own = LARGE.get(family)
        instances = [own(seed) for seed in range(seeds)] if own else gather([f"{family}:0-{seeds - 1}"])
        for limit in experiment.limits:
            comparison = planned(store, instances, variants, [0], objective=experiment.objective,
                                 budget=Budget(limit), threads=experiment.threads)  # fmt: skip
            Campaign(store, list(comparison.jobs.values()), Means(workers)).run(threading.Event())
            found = {label: [one for (one,) in runs] for label, runs in comparison.endings(store).items()}
            known: dict[str, list[Ending]] = {}
            for record in store.records().values():
                known.setdefault(record.run.instance, []).append(record.ending)
            hashes = [comparison.jobs[number, experiment.methods[0], 0].run.instance for number in range(seeds)]
            bests = [Best.of(known[one]) for one in hashes]
            energy = experiment.objective == "makespan-energy"
            scores = {label: [score(one, limit, energy=energy) for one in ends] for label, ends in found.items()}
            least = [min(of_seed) for of_seed in zip(*scores.values(), strict=True)]
            for label, ends in found.items():
                firsts = sum(one == best < WORST for one, best in zip(scores[label], least, strict=True))
                yield [family, label, f"{limit:g}", *columns(ends, bests, firsts)]


def parsed(label: str) -> tuple[str, dict[str, object]]:
    """Return the name and the parameters of a method that is written as on a command line."""
    name, bracket, settings = label.removesuffix("]").partition("[")
    return name, values(BETWEEN_SETTINGS.split(settings)) if bracket else {}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("experiments", nargs="+", choices=list(EXPERIMENTS), metavar="EXPERIMENT",
                        help=f"of {', '.join(EXPERIMENTS)}")  # fmt: skip
    parser.add_argument("--store", type=Path, required=True, metavar="FILE", help="where runs are kept")
    parser.add_argument("--seeds", type=int, help="instances of each family")
    parser.add_argument("--workers", type=int, help="runs at a time")
    options = parser.parse_args()
    with Store(options.store) as store:
        for name in options.experiments:
            experiment = EXPERIMENTS[name]
            print(f"\n{name}: {experiment.objective}, threads: {experiment.threads}\n", flush=True)
            print("| " + " | ".join(HEAD) + " |\n|---|---|" + "--:|" * (len(HEAD) - 2))
            for line in lines(experiment, store, options.seeds or experiment.seeds, options.workers):
                print("| " + " | ".join(line) + " |", flush=True)


if __name__ == "__main__":
    main()
