"""Tables of a report on policies in missions."""

from collections.abc import Sequence

from alloc.allocators.experiments.differences import Interval, PolicyDifference, paired_differences
from alloc.allocators.experiments.policies import PolicyRow
from alloc.allocators.experiments.report.table import Table
from alloc.allocators.experiments.statistics import CONFIDENCE, SMALL
from alloc.allocators.experiments.stored import Comparison, Endings, doubts
from alloc.allocators.experiments.sweep import mean
from alloc.problems.text import counted, number, percent


def mission_tables(comparison: Comparison, endings: Endings, rows: Sequence[PolicyRow]) -> list[Table]:
    """Return a table of policies, and tables of their differences.

    Parameters
    ----------
    comparison : Comparison
        Comparison of policies.
    endings : mapping
        Endings of its runs.
    rows : sequence of PolicyRow
        Rows of the comparison.
    """
    tables = difference_tables(paired_differences(rows), len(comparison.instances))
    return [_policies(comparison, endings, rows), *tables]


def _policies(comparison: Comparison, endings: Endings, rows: Sequence[PolicyRow]) -> Table:
    """Return the table of means over all missions; there is no mean of a value that a mission lacks."""
    cells = []
    for policy in comparison.methods:
        own = [row for row in rows if row.policy == policy and not row.reason]
        time, done, energy, late = (
            mean([getattr(row, name) for row in own]) if own else None
            for name in ("mission_time_mean", "priority_done_share", "energy_mean", "decision_ms_mean")
        )
        cells.append([policy, str(len(own)), number(time, 5), percent(done), number(energy, 4), number(late, 3)])
    run = next(iter(comparison.jobs.values())).run
    limit = "no deadline" if run.deadline_ms is None else f"{run.deadline_ms:g} ms per decision"
    size = f"{counted(len(comparison.instances), 'mission')}, {counted(len(comparison.seeds), 'seed')}"
    notes = [f"{size}; knowledge {run.knowledge}; {limit}; {run.version}; {run.machine}."]
    notes += [f"{row.mission}, {row.policy}: {row.reason}" for row in rows if row.reason]
    header = ["policy", "missions", "time", "priority done", "energy", "ms/decision"]
    return Table("Policies", header, cells, [*notes, *doubts(endings)])


def difference_tables(differences: Sequence[PolicyDifference], missions: int) -> list[Table]:
    """Return a table of the differences of policies from the first one; an empty list for a single policy."""
    if not differences:
        return []
    first, confidence = differences[0].against, percent(CONFIDENCE)
    title = f"Differences from {first} on the same missions and seeds ({confidence} interval)"
    header = ["policy", "time", "interval", "pairs", "energy", "interval", "priority done", "interval", "pairs"]
    return [Table(title, header, [_difference(one) for one in differences], _sample(missions))]


def _sample(missions: int) -> list[str]:
    """Return a warning about a small sample, if it is one."""
    if missions == 1:
        return ["A single mission: pairs are its seeds, and do not generalise to other missions."]
    return [f"Small sample: intervals from fewer than {SMALL} missions are unreliable."] if missions < SMALL else []


def _difference(one: PolicyDifference) -> list[str]:
    return [
        one.policy,
        *_interval(one.mission_time),
        str(one.mission_time.pairs),
        *_interval(one.energy),
        *_interval(one.priority_done_share),
        str(one.priority_done_share.pairs),
    ]


def _interval(interval: Interval) -> list[str]:
    """Return the mean and both ends of an interval in per cent, with dashes for unknown values."""
    if interval.mean is None:
        return ["-", "-"]
    mean = f"{_percent(interval.mean)} %"
    if interval.low is None or interval.high is None:
        return [mean, "-"]
    return [mean, f"{_percent(interval.low)} to {_percent(interval.high)} %"]


def _percent(share: float) -> str:
    return "0" if abs(share) < 5e-7 else f"{100 * share:+.3g}"
