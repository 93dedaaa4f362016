"""Tables of methods relative to the best known results, and to each other."""

from collections.abc import Sequence

import numpy as np

from alloc.allocators.experiments.report.table import Table
from alloc.allocators.experiments.standings import LATE, Standing

OF_BEST = ["method", "T", "worst", "least T", "proven", "beyond bound", "worst", "energy / least", "worst",
           "at least T", "energy gap", "worst"]  # fmt: skip
OF_OTHERS = ["method", "T behind", "worst", "energy behind", "worst", "first", "first T", "first ms", "s", "unserved",
             "no answer"]  # fmt: skip


def standing_tables(found: dict[str, Standing]) -> list[Table]:
    """Return both tables, with a row for each method in the same order."""
    best, others = zip(*(_cells(label, standing) for label, standing in found.items()), strict=True)
    notes_of_best = [
        "T: makespan over the served tasks. Least T: runs with the best known T among those with the fewest unserved "
        "tasks. Proven: runs proven optimal. Beyond bound: T above the best known bound. Energy / least: energy over "
        "the least known at that T; at least T: its mean over runs with the best known T. Energy gap: to the bound of "
        "the run itself.",
    ]
    notes_of_others = [
        "Behind: T relative to the best other method, and energy relative to the best other method that is no slower; "
        "negative values lead. First: runs for which no other method had fewer unserved tasks, then less T, then less "
        f"energy; never runs that took more than {LATE:g} times their limit. First T and ms: mean T and median time of "
        "the first answer.",
    ]
    return [
        Table("Relative to the best known", OF_BEST, list(best), notes_of_best),
        Table("Relative to the other methods", OF_OTHERS, list(others), notes_of_others),
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
    """Return the mean and the maximum of the known values."""
    known = np.array([value for value in values if value is not None and np.isfinite(value)])
    return (f"{known.mean():{form}}", f"{known.max():{form}}") if len(known) else ("-", "-")
