"""The tables of how methods stand against the best known, and beside each other."""

from collections.abc import Sequence

import numpy as np

from alloc.allocators.experiments.report.table import Table
from alloc.allocators.experiments.standings import LATE, Standing

OF_BEST = ["method", "T", "worst", "least T", "proven", "beyond bound", "worst", "energy / least", "worst",
           "at least T", "energy gap", "worst"]  # fmt: skip
OF_OTHERS = ["method", "T behind", "worst", "energy behind", "worst", "first", "first T", "first ms", "s", "unserved",
             "no answer"]  # fmt: skip


def standing_tables(found: dict[str, Standing]) -> list[Table]:
    """Return both tables; the first has a row for each method, and the second the same rows in the same order."""
    best, others = zip(*(_cells(label, standing) for label, standing in found.items()), strict=True)
    notes_of_best = [
        "T over the tasks that are served; runs with the least T known, among those with the fewest tasks unserved; "
        "runs proven optimal; T beyond the greatest bound known; energy over the least known at the least T, and the "
        "mean of that over runs with the least T; energy gap to the run's own bound.",
    ]
    notes_of_others = [
        "By how much more T a method has than the best of the others, and by how much more energy than the best of "
        "those that are no slower; below 0 it leads. First: "
        "nobody had fewer tasks unserved, then less T, then less energy; never runs that took more than "
        f"{LATE:g} times their limit. First answer: its T, mean, and its time, median.",
    ]
    return [
        Table("Against the best known", OF_BEST, list(best), notes_of_best),
        Table("Beside the others", OF_OTHERS, list(others), notes_of_others),
    ]


def _cells(label: str, standing: Standing) -> tuple[list[str], list[str]]:
    stands, silent = standing.stands, str(standing.runs - len(standing.stands))
    if not stands:
        return [label, *["-"] * (len(OF_BEST) - 1)], [label, *["-"] * 4, "0", *["-"] * 4, silent]
    endings = [one.ending for one in stands]
    makespans = [one.served_makespan for one in endings]
    points = [one.trace[0] for one in endings if one.trace]
    least = [one.energy_ratio for one in stands if one.is_least]
    best = [
        *_figures(makespans, ".5g"),
        f"{sum(one.is_least for one in stands)} of {standing.runs}",
        str(sum(one.status == "optimal" for one in endings)),
        *_figures([one.beyond_bound for one in stands], ".3%"),
        *_figures([one.energy_ratio for one in stands], ".3f"),
        _figures(least, ".3f")[0],
        *_figures([one.energy_gap for one in endings], ".3%"),
    ]
    others = [
        *_figures([one.behind for one in stands], "+.3%"),
        *_figures([one.energy_behind for one in stands], "+.3%"),
        str(standing.first),
        _figures([point[1] for point in points], ".4f")[0],
        f"{1000 * float(np.median([point[0] for point in points])):.1f}" if points else "-",
        _figures([one.runtime_s for one in endings], ".3g")[0],
        str(sum(one.unserved or 0 for one in endings)),
        silent,
    ]
    return [label, *best], [label, *others]


def _figures(values: Sequence[float | None], form: str) -> tuple[str, str]:
    """Return mean and greatest of what is known."""
    known = np.array([value for value in values if value is not None and np.isfinite(value)])
    return (f"{known.mean():{form}}", f"{known.max():{form}}") if len(known) else ("-", "-")
