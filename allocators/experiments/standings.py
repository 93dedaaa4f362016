"""Rankings of methods, relative to the best known results of each instance and to each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from alloc.allocators.experiments.statistics import EQUAL
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.stored import Endings

ALIKE = 1e-4
"""Relative difference of makespans up to which energies are compared."""

LATE, LATE_S = 1.2, 0.02
"""A run is late if it exceeds this factor times its time limit plus this many seconds."""

Score = tuple[float, float, float]
WORST: Score = (np.inf, np.inf, np.inf)


@dataclass(frozen=True)
class Best:
    """Best known values of an instance.

    Attributes
    ----------
    bound : float
        Best proven lower bound on the makespan; 0 if none.
    unserved : int or float
        Minimum number of unserved tasks; infinite if no run has a result.
    makespan : float
        Least makespan over the served tasks among runs with that number; infinite if none.
    energy : float
        Least energy among these runs at a makespan at most 0.01 % longer; NaN if none.
    """

    bound: float
    unserved: float
    makespan: float
    energy: float

    @classmethod
    def of(cls, endings: Sequence[Ending]) -> "Best":
        """Return the best values of all runs on one instance."""
        unserved = min((one.unserved or 0 for one in endings if one.served_makespan is not None), default=np.inf)
        solved = [
            (one.served_makespan, one.energy)
            for one in endings
            if one.served_makespan is not None and one.energy is not None and (one.unserved or 0) == unserved
        ]
        makespan = min((one for one, _ in solved), default=np.inf)
        energies = [energy for one, energy in solved if one <= makespan * (1 + ALIKE)]
        bound = max((one.lower_bound or 0.0 for one in endings), default=0.0)
        return cls(bound, unserved, makespan, min(energies, default=np.nan))


@dataclass(frozen=True)
class Stand:
    """A run relative to the best known values of its instance and to other methods there.

    Attributes
    ----------
    ending : Ending
    beyond_bound : float
        Relative excess of its makespan over the bound; NaN without a bound or with an unserved task.
    is_least : bool
        Whether nothing better is known: fewer unserved tasks, or as many and a shorter makespan.
    energy_ratio : float
        Ratio of its energy to the least known; NaN if none is known or it left more tasks unserved.
    behind, energy_behind : float
        Relative excess of its makespan, and of its energy at an equal or longer makespan, over the best of the other
        methods; negative if it leads. NaN if there is nothing to compare with.
    """

    ending: Ending
    beyond_bound: float
    is_least: bool
    energy_ratio: float
    behind: float
    energy_behind: float


@dataclass(frozen=True)
class Standing:
    """Ranking of a method over instances.

    Attributes
    ----------
    stands : list of Stand
        One for each run that has a makespan.
    runs : int
        Number of runs of the method.
    first : int
        Runs for which no other method had a better result: fewer unserved tasks, then shorter makespan, then less
        energy if that is an objective. Ties count for all; late runs are never first.
    """

    stands: list[Stand]
    runs: int
    first: int


def best_known(endings: Endings) -> list[Best]:
    """Return the best known values of each instance of a comparison."""
    by_instance = zip(*endings.values(), strict=True)
    return [Best.of([one for runs in lists for one in runs if one is not None]) for lists in by_instance]


def standings(
    endings: Endings, bests: Sequence[Best], time_limit_s: float | None, *, energy: bool
) -> dict[str, Standing]:
    """Return the standing of each method.

    Parameters
    ----------
    endings : mapping
        How runs ended, by method, instance and seed.
    bests : sequence of Best
        Best known values, by instance.
    time_limit_s : float, optional
        Time limit of each run.
    energy : bool
        Whether the energy is an objective.
    """
    limit_s = np.inf if time_limit_s is None else LATE * time_limit_s + LATE_S
    runs = {label: [one for seeds in lists for one in seeds] for label, lists in endings.items()}
    of_run = [best for best, seeds in zip(bests, next(iter(endings.values())), strict=True) for _ in seeds]
    scores = {label: [_score(one, limit_s, energy=energy) for one in some] for label, some in runs.items()}
    least = [min(together) for together in zip(*scores.values(), strict=True)]
    found = {}
    for label, own in runs.items():
        others = [[some[number] for rival, some in runs.items() if rival != label] for number in range(len(own))]
        stands = [
            _stand(one, best, rivals)
            for one, best, rivals in zip(own, of_run, others, strict=True)
            if one is not None and one.served_makespan is not None
        ]
        first = sum(one == best < WORST for one, best in zip(scores[label], least, strict=True))
        found[label] = Standing(stands, len(own), first)
    return found


def _score(ending: Ending | None, limit_s: float, *, energy: bool) -> Score:
    """Return a score, lower is better: nearly equal values are made equal, and late results are worst."""
    if ending is None or ending.outcome is not Outcome.SOLVED or ending.served_makespan is None:
        return WORST
    if (ending.runtime_s or 0.0) > limit_s:
        return WORST
    figures = (float(ending.unserved or 0), ending.served_makespan, ending.energy or 0.0 if energy else 0.0)
    unserved, makespan, least = (float(f"{figure:.9g}") for figure in figures)
    return unserved, makespan, least


def _stand(ending: Ending, best: Best, others: Sequence[Ending | None]) -> Stand:
    served = np.nan if ending.served_makespan is None else ending.served_makespan
    serves_as_many = (ending.unserved or 0) == best.unserved
    behind, energy_behind = _behind(ending, others)
    return Stand(
        ending,
        beyond_bound=ending.makespan / best.bound - 1 if best.bound and ending.makespan is not None else np.nan,
        is_least=serves_as_many and served <= best.makespan * (1 + EQUAL),
        energy_ratio=(ending.energy or 0.0) / best.energy if best.energy and serves_as_many else np.nan,
        behind=behind,
        energy_behind=energy_behind,
    )


def _behind(own: Ending, others: Sequence[Ending | None]) -> tuple[float, float]:
    served = [(one.makespan, one.energy) for one in others if one is not None and one.makespan is not None]
    if own.makespan is None or not served:
        return np.nan, np.nan
    energies = [energy for makespan, energy in served if energy is not None and makespan <= own.makespan * (1 + EQUAL)]
    least, fastest = min(energies, default=0.0), min(makespan for makespan, _ in served)
    behind = own.makespan / fastest - 1 if fastest else np.nan
    return behind, (own.energy or 0.0) / least - 1 if least else np.nan
