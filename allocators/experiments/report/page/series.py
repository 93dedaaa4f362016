"""Data of the charts of a page: profiles, curves over time, trade-offs, scaling and gaps."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.experiments.profiles import profiles, targets_reached
from alloc.allocators.experiments.report.page.groups import Group, Layout
from alloc.allocators.experiments.report.page.source import EDGES_S, moment
from alloc.allocators.experiments.report.page.summary import Entry, relative_to_best
from alloc.allocators.experiments.statistics import scores
from alloc.allocators.experiments.store.outcome import Ending

MAX_POINTS = 2000
"""Maximum number of points of a scatter plot; if there are more, an evenly spaced subset is drawn."""

MAX_SIZES = 12
"""Maximum number of distinct numbers of agents; more are grouped into geometrically spaced bins."""

QUARTILES = (0.25, 0.5, 0.75)
WHISKERS = (0.05, 0.25, 0.5, 0.75, 0.95)

STEPS = 60
"""Number of factors at which profiles are drawn."""

MEASURES = ("runtime_s", "gap", "ratio", "memory_mb")
"""Measures that are drawn over the number of agents."""


def series(layout: Layout, group: Group) -> Entry:
    """Return the data of the charts of a group, with methods as numbers."""
    return {
        "profiles": _profiles(group),
        "time": _over_time(group),
        "tradeoff": _tradeoff(group),
        "scaling": _scaling(layout, group),
        "gaps": _gaps(group),
    }


def _profiles(group: Group) -> list[Entry]:
    """Return performance profiles up to 1.02 times the factor that covers 95 % of the results, within 1.02 and 10."""
    common = group.endings_in_common
    if len(common) < 2 or not group.common:
        return []
    ratios = relative_to_best([scores(runs, "makespan") for runs in common.values()])
    known = ratios[np.isfinite(ratios)]
    if not known.size:
        return []
    top = float(np.clip(np.quantile(known, 0.95) * 1.02, 1.02, 10.0))
    factors = np.linspace(1.0, top, STEPS).tolist()
    shares = profiles(common, factors)
    return [{"method": m, "x": factors, "y": shares[label]} for m, label in zip(group.methods, common, strict=True)]


def _over_time(group: Group) -> list[Entry]:
    """Return the share of targets reached, and quartiles of the distance to the best known makespan, over time."""
    common = group.endings_in_common
    ended = [one for runs in common.values() for some in runs for one in some if one is not None]
    steps = [moment(point[0]) for one in ended for point in one.trace]
    if not steps:
        return []
    last = max(max(steps) + 2, *(moment(one.runtime_s or 0.0) for one in ended))
    first, last = max(min(steps) - 1, 0), min(last, len(EDGES_S) - 1)
    times = EDGES_S[first : last + 1]
    reached = targets_reached(common, times)
    best = [_best([one for runs in common.values() for one in runs[n]]) for n in range(len(group.common))]
    found: list[Entry] = []
    for method, (label, runs) in zip(group.methods, common.items(), strict=True):
        table = np.array(
            [
                _course(one, first, last) / goal - 1
                for goal, some in zip(best, runs, strict=True)
                if goal
                for one in some
                if one is not None
            ]
        ).reshape(-1, last - first + 1)
        low, middle, high = _quantiles(table, QUARTILES) if len(table) else [[None] * len(times)] * 3
        curve = {"x": list(times), "y": reached[label], "low": low, "middle": middle, "high": high}
        found.append({"method": method, **curve})
    return found


def _best(endings: Sequence[Ending | None]) -> float | None:
    return min((one.makespan for one in endings if one is not None and one.makespan is not None), default=None)


def _course(ending: Ending, first: int, last: int) -> NDArray[np.float64]:
    """Return the best makespan that a run had found by each time; infinite before the first."""
    course = np.full(last - first + 1, np.inf)
    for time_s, makespan, *_ in ending.trace:
        if makespan is not None:
            course[moment(time_s) - first :] = makespan
    return course


def _quantiles(table: NDArray[np.float64], shares: Sequence[float]) -> list[list[float | None]]:
    """Return quantiles of each column without interpolation; None if infinite."""
    found = np.quantile(table, shares, axis=0, method="inverted_cdf")
    return [[float(one) if np.isfinite(one) else None for one in row] for row in found]


def _tradeoff(group: Group) -> list[Entry]:
    """Return makespan and energy of each method on each instance, relative to the least of any method there."""
    both = [
        relative_to_best([scores(runs, score) for runs in group.endings.values()]) for score in ("makespan", "energy")
    ]
    found = []
    for method, times, energies in zip(group.methods, *both, strict=True):
        known = np.flatnonzero(np.isfinite(times) & np.isfinite(energies))
        kept = known[:: -(-len(known) * len(group.methods) // MAX_POINTS) or 1]
        if len(known):
            found.append(
                {
                    "method": method,
                    "instance": [group.instances[n] for n in kept],
                    "x": times[kept].tolist(),
                    "y": energies[kept].tolist(),
                    "points": len(known),
                    "x_median": float(np.median(times[known])),
                    "y_median": float(np.median(energies[known])),
                }
            )
    return found


def _scaling(layout: Layout, group: Group) -> list[Entry]:
    """Return quartiles of the measures of each method by number of agents."""
    agents = np.array([layout.known[n].agents for n in group.instances], dtype=float)
    bins = _bins(agents)
    ratios = relative_to_best([scores(runs, "makespan") for runs in group.endings.values()])
    found = []
    for method, runs, ratio in zip(group.methods, group.endings.values(), ratios, strict=True):
        for measure in MEASURES:
            values = ratio if measure == "ratio" else _measured(runs, measure)
            for number in np.unique(bins).tolist():
                here = (bins == number) & np.isfinite(values)
                if here.any():
                    low, middle, high = np.quantile(values[here], QUARTILES).tolist()
                    size = float(np.exp(np.log(np.maximum(agents[here], 1)).mean()))
                    place = {"method": method, "measure": measure, "agents": size, "instances": int(here.sum())}
                    found.append({**place, "low": low, "middle": middle, "high": high})
    return found


def _measured(runs: Sequence[Sequence[Ending | None]], measure: str) -> NDArray[np.float64]:
    """Return a measure of each instance; time and memory also if a task was unserved."""
    if measure == "gap":
        return scores(runs, measure)
    known = [[getattr(one, measure) for one in some if one is not None and one.runtime_s is not None] for some in runs]
    return np.array([np.mean(some) if some else np.nan for some in known])


def _bins(agents: NDArray[np.float64]) -> NDArray[np.intp]:
    sizes = np.unique(agents)
    if len(sizes) <= MAX_SIZES:
        return np.searchsorted(sizes, agents)
    low, high = np.log(max(sizes[0], 1.0)), np.log(sizes[-1])
    place = (np.log(np.maximum(agents, 1.0)) - low) / (high - low)
    return np.asarray(np.floor(place * (MAX_SIZES - 1e-9)), dtype=np.intp)


def _gaps(group: Group) -> list[Entry]:
    """Return quantiles of the gap to the best bound of each method, and the number of instances with a gap."""
    found: list[Entry] = []
    for method, runs in zip(group.methods, group.endings.values(), strict=True):
        values = scores(runs, "gap")
        known = values[np.isfinite(values)]
        if len(known):
            figures = dict(zip(("least", "low", "middle", "high", "most"), np.quantile(known, WHISKERS), strict=True))
            told = {name: float(value) for name, value in figures.items()}
            found.append({"method": method, "instances": len(known), "of": _count(runs), **told})
    return found


def _count(runs: Sequence[Sequence[Ending | None]]) -> int:
    return sum(bool(some) for some in runs)
