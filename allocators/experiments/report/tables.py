"""Tables of a report, with cells as text, independent of their output format."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from alloc.allocators.experiments.compare import Row
from alloc.allocators.experiments.profiles import FACTORS, WITHIN, profiles, targets_reached
from alloc.allocators.experiments.report.standing import standing_tables
from alloc.allocators.experiments.report.table import Table
from alloc.allocators.experiments.standings import best_known, standings
from alloc.allocators.experiments.statistics import (
    CONFIDENCE,
    MIN_INSTANCES,
    SMALL,
    Difference,
    differences,
)
from alloc.allocators.experiments.store.outcome import Outcome
from alloc.allocators.experiments.stored import Comparison, Endings, doubts
from alloc.allocators.experiments.sweep import mean_and_worst
from alloc.problems import Objective
from alloc.problems.text import counted, number, percent


def report_tables(comparison: Comparison, endings: Endings, rows: Sequence[Row]) -> list[Table]:
    """Return the tables of a report: methods, outcomes, differences, profiles, standings, and targets over time.

    Parameters
    ----------
    comparison : Comparison
    endings : mapping
        Endings of its runs.
    rows : sequence of Row
        Rows of the comparison, with the gaps to report.
    """
    tables = [_methods(comparison, endings, rows)]
    if any(_outcomes(endings, label).keys() - {Outcome.SOLVED} for label in endings):
        tables.append(_outcome_table(endings))
    if len(endings) > 1:
        tables += [*difference_tables(comparison, endings), _profile_table(endings)]
    run = next(iter(comparison.jobs.values())).run
    energy = run.objective == Objective.MAKESPAN_ENERGY
    tables += standing_tables(standings(endings, best_known(endings), run.time_limit_s, energy=energy))
    return [*tables, _target_table(comparison, endings)]


def difference_tables(comparison: Comparison, endings: Endings) -> list[Table]:
    """Return tables of the differences of methods from the first one, in makespan and, if an objective, energy."""
    goals = {job.run.objective for job in comparison.jobs.values()}
    scores = ["makespan", "energy"] if Objective.MAKESPAN_ENERGY in goals else ["makespan"]
    return [_difference_table(differences(endings, score)) for score in scores]


def _methods(comparison: Comparison, endings: Endings, rows: Sequence[Row]) -> Table:
    cells = []
    for label in endings:
        own = [row for row in rows if row.method == label]
        means = [
            mean_and_worst([getattr(row, name) for row in own if not row.reason and not row.unserved])[0]
            for name in ("makespan_mean", "gap_mean", "energy_mean", "runtime_mean_s")
            if own
        ] or [None] * 4
        solved = _outcomes(endings, label)[Outcome.SOLVED]
        served = sum(not row.reason and not row.unserved for row in own)
        figures = [number(means[0], 5), percent(means[1]), number(means[2], 4), number(means[3], 3)]
        cells.append([label, str(solved), str(served), *figures])
    run = next(iter(comparison.jobs.values())).run
    limits = {"s": run.time_limit_s, "iterations": run.iterations, "as target gap": run.target_gap}
    budget = ", ".join(f"{value:g} {unit}" for unit, value in limits.items() if value is not None)
    return Table(
        "Methods",
        ["method", "runs solved", "instances served", "T", "gap", "energy", "time (s)"],
        cells,
        [
            f"{counted(len(comparison.instances), 'instance')}, {counted(len(comparison.seeds), 'seed')}; "
            f"{run.objective}; {budget or 'no limit'}, {counted(run.threads, 'thread')}; {run.version}; {run.machine}.",
            "Means over the instances on which all runs of the method served all tasks, averaged over seeds first.",
            *doubts(endings),
        ],
    )


def _outcomes(endings: Endings, label: str) -> Counter[Outcome]:
    return Counter(ending.outcome for runs in endings[label] for ending in runs if ending is not None)


def _outcome_table(endings: Endings) -> Table:
    found = {label: _outcomes(endings, label) for label in endings}
    kinds = [kind for kind in Outcome if any(counts[kind] for counts in found.values())]
    rows = [[label, *(str(counts[kind]) for kind in kinds)] for label, counts in found.items()]
    return Table("How runs ended", ["method", *kinds], rows, [])


def _difference_table(found: Sequence[Difference]) -> Table:
    score = {"makespan": "T", "energy": "energy"}[found[0].score]
    notes = [
        f"Relative differences of {score} on the same instances, with {percent(CONFIDENCE)} BCa bootstrap intervals "
        "of the mean; p of Wilcoxon's two-sided signed-rank test, also corrected by Holm's procedure."
    ]
    if score == "energy":
        notes.append("Energies are at each method's own makespan; less energy at a longer makespan is not better.")
    smallest = min(one.instances for one in found)
    if smallest < MIN_INSTANCES:
        notes.append(f"Fewer than {MIN_INSTANCES} instances allow neither interval nor test.")
    elif smallest < SMALL:
        notes.append(f"Small sample: {smallest} instances; intervals and tests of fewer than {SMALL} are unreliable.")
    left_out = max(one.left_out for one in found)
    if left_out:
        notes.append(f"Left out: up to {counted(left_out, 'instance')} on which one of the two methods has no value.")
    header = ["method", f"{score} less", "equal", "more", "difference", "from", "to", "p", "p (Holm)"]
    return Table(f"Against {found[0].against}: {score}", header, [_difference_cells(one) for one in found], notes)


def _difference_cells(one: Difference) -> list[str]:
    shares = [_signed(one.mean), _signed(one.low), _signed(one.high)]
    return [one.method, *map(str, (one.better, one.equal, one.worse)), *shares, number(one.p, 2), number(one.p_holm, 2)]


def _signed(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:+.3g} %"


def _profile_table(endings: Endings) -> Table:
    rows = [[label, *map(percent, shares)] for label, shares in profiles(endings).items()]
    notes = ["Share of instances on which T is at most this factor times the best method's (performance profile)."]
    return Table("Performance profiles", ["method", *(f"{factor:g}" for factor in FACTORS)], rows, notes)


def _target_table(comparison: Comparison, endings: Endings) -> Table:
    times = _times(comparison, endings)
    rows = [[label, *map(percent, shares)] for label, shares in targets_reached(endings, times).items()]
    targets = ", ".join(percent(more) for more in WITHIN)
    notes = [f"Share of targets reached by this time: T within {targets} of the best known on each instance."]
    return Table("Targets over time", ["method", *(f"{time:g} s" for time in times)], rows, notes)


def _times(comparison: Comparison, endings: Endings) -> list[float]:
    """Return four times up to the time limit or, without one, up to the end of the longest run."""
    limits = [job.run.time_limit_s for job in comparison.jobs.values() if job.run.time_limit_s is not None]
    ends = [ending.runtime_s or 0.0 for lists in endings.values() for runs in lists for ending in runs if ending]
    last = max(limits or ends, default=0.0) or 1.0
    return [float(f"{time:.2g}") for time in np.geomspace(last / 1000, last, 4)]
