"""Performance profiles, and shares of targets reached over time."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.experiments.statistics import EQUAL, scores
from alloc.allocators.experiments.store.outcome import Ending
from alloc.allocators.experiments.stored import Endings

WITHIN = (0.0, 0.01, 0.05)
"""Relative distances to the best known makespan of an instance that count as targets."""

FACTORS = (1.0, 1.001, 1.01, 1.05, 1.1, 1.2, 1.5, 2.0)
"""Ratios to the best method on an instance at which performance profiles are evaluated."""


def profiles(
    endings: Endings, factors: Sequence[float] = FACTORS, score: str = "makespan"
) -> Mapping[str, list[float]]:
    """Return performance profiles: the share of instances on which a method is within each factor of the best.

    Instances that no method solved are left out; an instance that a method did not solve counts against it.

    Parameters
    ----------
    endings : mapping
        How runs ended, by method, instance and seed.
    factors : sequence of float
        Ratios, >= 1.
    score : str
        ``makespan`` or ``energy``.

    Returns
    -------
    dict
        A share for each factor, by method.

    References
    ----------
    Dolan and Moré (2002), doi:10.1007/s101070100263.
    """
    table = np.array([scores(runs, score) for runs in endings.values()])
    table = table[:, ~np.isnan(table).all(axis=0)]
    best = np.nanmin(table, axis=0) if table.size else np.zeros(0)
    shares = [[_share(row <= best * (factor + EQUAL)) for factor in factors] for row in table]
    return dict(zip(endings, shares, strict=True))


def targets_reached(
    endings: Endings, times_s: Sequence[float], within: Sequence[float] = WITHIN
) -> Mapping[str, list[float]]:
    """Return the share of targets that each method has reached by each time, over all runs.

    Targets are makespans: the best one known of an instance, from any of these runs, times 1 plus each value of
    `within`. A run reaches a target at the first improvement in its trace that is as good. Missing runs reach none.

    Parameters
    ----------
    endings : mapping
        How runs ended, by method, instance and seed.
    times_s : sequence of float
        Seconds since the start of the run.
    within : sequence of float
        Relative distances to the best known makespan.

    Returns
    -------
    dict
        A share for each time, by method.

    References
    ----------
    Hansen et al. (2021), COCO: a platform for comparing continuous optimizers, doi:10.1080/10556788.2020.1808977.
    """
    known = [ending for lists in endings.values() for runs in lists for ending in runs if ending is not None]
    if not known:
        return {label: [0.0] * len(times_s) for label in endings}
    best = [_best([runs[number] for runs in endings.values()]) for number in range(len(next(iter(endings.values()))))]
    found = {}
    for label, lists in endings.items():
        reached = np.array(
            [
                _reached(ending, target * (1 + more))
                for target, runs in zip(best, lists, strict=True)
                if target is not None
                for ending in runs
                for more in within
            ]
        )
        found[label] = [_share(reached <= time) for time in times_s]
    return found


def _best(lists: Sequence[Sequence[Ending | None]]) -> float | None:
    makespans = [ending.makespan for runs in lists for ending in runs if ending is not None]
    return min((makespan for makespan in makespans if makespan is not None), default=None)


def _reached(ending: Ending | None, target: float) -> float:
    """Return the time at which a run reached a makespan of at most `target`; infinity if never."""
    points = () if ending is None else ending.trace
    good = (time for time, makespan, *_ in points if makespan is not None and makespan <= target * (1 + EQUAL))
    return min(good, default=float("inf"))


def _share(which: NDArray[np.bool_]) -> float:
    return float(np.mean(which)) if which.size else 0.0
