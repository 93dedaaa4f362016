"""Tables of a page: conditions of the runs, results of each method, and differences between methods."""

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.experiments.report.page.groups import Group, Layout
from alloc.allocators.experiments.statistics import MIN_INSTANCES, SMALL, differences, scores
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.store import CONDITIONS
from alloc.allocators.experiments.stored import Endings, doubts
from alloc.problems.text import counted

Entry = dict[str, object]

MAX_PAIRED = 100_000
"""Pairs of methods times instances up to which all pairs are compared, as intervals take time."""

NAMED = ("objective", "time_limit_s", "iterations", "target_gap", "threads", "version", "machine")
"""Conditions that have their own columns on a page."""

SCORES = ("makespan", "energy")


def conditions(group: Group) -> Entry:
    """Return the conditions and dates of the runs of a group, as a row of a table."""
    ended = _flat(group.endings)
    told = {name: value for name, value in asdict(group.run).items() if name in CONDITIONS}
    return {
        **told,
        "version": group.run.version.partition(" + ")[0],
        "others": [f"{name} {value}" for name, value in told.items() if name not in NAMED and value not in (None, "")],
        "revision": ", ".join(sorted({one.revision for one in ended if one.revision})),
        "runs": len(ended),
        "instances": len(group.instances),
        "from": _date(min(one.started_at for one in ended)),
        "to": _date(max(one.finished_at for one in ended)),
        "cpu_s": sum(one.cpu_s or 0.0 for one in ended),
    }


def _date(seconds: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M", time.gmtime(seconds))


def _flat(endings: Endings) -> list[Ending]:
    return [one for runs in endings.values() for some in runs for one in some if one is not None]


def methods(group: Group) -> list[Entry]:
    """Return the results of each method, one row per method.

    Means are over the instances that every method served; otherwise, a method that fails on hard ones would look best.
    """
    makespans = {label: scores(runs, "makespan") for label, runs in group.endings.items()}
    ratios = relative_to_best(list(makespans.values()))
    shared = _served_by_all(list(makespans.values()))
    rows = []
    for (label, runs), number, ratio in zip(group.endings.items(), group.methods, ratios, strict=True):
        ended = [one for some in runs for one in some if one is not None]
        rows.append(
            {
                "method": number,
                "runs": len(ended),
                "outcomes": {str(outcome): count for outcome, count in _outcomes(ended).items()},
                "solved": _outcomes(ended)[Outcome.SOLVED] / len(ended),
                "proven": sum(one.status == "optimal" for one in ended),
                "instances": sum(bool(some) for some in runs),
                "served": int((~np.isnan(makespans[label])).sum()),
                "best": int((ratio <= 1 + 1e-9).sum()),
                "ratio": _finite(np.exp(_mean(np.log(ratio[shared & (ratio > 0)])))),
                "makespan": _finite(_mean(makespans[label][shared])),
                "gap": _finite(_mean(scores(runs, "gap")[shared])),
                "energy": _finite(_mean(scores(runs, "energy")[shared])),
                "runtime_s": _finite(_mean(scores(runs, "runtime_s")[shared])),
                "memory_mb": max(one.memory_mb for one in ended),
                "picked": ", ".join(
                    sorted({one.picked for one in ended if one.picked and label.partition("[")[0] == "auto"})
                ),
            }
        )
    return rows


def _served_by_all(makespans: Sequence[NDArray[np.float64]]) -> NDArray[np.bool_]:
    """Return which instances have a makespan of every method that has any makespan, shape (instances,)."""
    known = ~np.isnan(np.array(makespans))
    return np.asarray(known[known.any(axis=1)].all(axis=0))


def _outcomes(ended: Sequence[Ending]) -> Counter[Outcome]:
    return Counter(one.outcome for one in ended)


def relative_to_best(values: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return values divided by the least of each instance, shape (methods, instances); NaN if that is missing or 0."""
    table = np.array(values)
    best = np.fmin.reduce(table, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where((best > 0) & np.isfinite(table), table / best, np.nan)


def _mean(values: NDArray[np.float64]) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else float("nan")


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def paired(layout: Layout, group: Group, against: str | None = None) -> list[Entry]:
    """Return the differences of methods from each reference: from every method if that is fast, or else from one.

    Parameters
    ----------
    layout : Layout
    group : Group
    against : str, optional
        The only reference; by default the first reference is the first method that was run.
    """
    number = {layout.labels[method]: method for method in group.methods}
    every = len(number) * (len(number) - 1) * len(group.instances) <= MAX_PAIRED
    references = [against] if against in number else list(number) if every else list(number)[:1]
    found = []
    for score in SCORES if len(number) > 1 else ():
        for reference in references:
            ordered = {reference: group.endings[reference], **group.endings}
            for one in differences(ordered, score):
                numbers = {"method": number[one.method], "against": number[one.against]}
                if one.instances:
                    found.append({**asdict(one), **numbers, "small": one.is_small})
    return found


def notes(group: Group) -> list[str]:
    """Return remarks on the results of a group, one sentence each."""
    found = doubts(group.endings)
    every, common = len(group.instances), len(group.common)
    if len(group.endings) == 1:
        found.append("Only one method was run under these conditions: there is nothing to compare it with.")
    elif not common:
        found.append("No instance was run by every method: there are no profiles, only differences between pairs.")
    elif common < every:
        share = f"{common} of {counted(every, 'instance')}"
        found.append(f"Profiles and curves over time are based on the {share} on which every method was run.")
    if len(group.endings) > 1 and common and common < SMALL:
        least = f"; fewer than {MIN_INSTANCES} allow neither interval nor test" if common < MIN_INSTANCES else ""
        found.append(f"Small sample: {counted(common, 'instance')} in common{least}.")
    found += _about_means(group)
    ended = _flat(group.endings)
    if all(one.outcome is not Outcome.SOLVED for one in ended):
        found.append("No run was solved: there are no scores to draw. See the failures below.")
    elif all(one.makespan is None for one in ended):
        found.append("No run has a makespan: all left tasks undone.")
    elif all(one.lower_bound is None for one in ended):
        found.append("No run proved a bound on the makespan: there are no gaps to a bound.")
    return found


def _about_means(group: Group) -> list[str]:
    """Return remarks on the means of methods, if these served different instances."""
    makespans = [scores(runs, "makespan") for runs in group.endings.values()]
    shared = int(_served_by_all(makespans).sum())
    served = int((~np.isnan(np.array(makespans))).any(axis=0).sum())
    if shared == served or not served:
        return []
    if not shared:
        return ["No instance was served by every method with results: there are no means; see the paired differences."]
    share = f"{shared} of {counted(served, 'instance')}"
    return [f"Means are over the {share} that every method with results served, and ignore the others."]
