"""What a report on policies in missions tells people."""

from collections.abc import Sequence

from alloc.allocators.experiments.differences import Interval, PolicyDifference, paired_differences
from alloc.allocators.experiments.policies import PolicyRow
from alloc.allocators.experiments.report.table import Table
from alloc.allocators.experiments.statistics import CONFIDENCE, SMALL
from alloc.allocators.experiments.stored import Comparison, Endings, doubts
from alloc.allocators.experiments.sweep import mean
from alloc.problems.text import counted, number, percent


def mission_tables(comparison: Comparison, endings: Endings, rows: Sequence[PolicyRow]) -> list[Table]:
    """Return a table of policies, and tables of how they differ.

    Parameters
    ----------
    comparison : Comparison
        Of policies.
    endings : mapping
        How its runs ended.
    rows : sequence of PolicyRow
        Those of the comparison.
    """
    tables = difference_tables(paired_differences(rows), len(comparison.instances))
    return [_policies(comparison, endings, rows), *tables]


def _policies(comparison: Comparison, endings: Endings, rows: Sequence[PolicyRow]) -> Table:
    """Return the means over all missions; of a figure that a mission lacks there is none."""
    cells = []
    for policy in comparison.methods:
        own = [row for row in rows if row.policy == policy and not row.reason]
        time, done, energy, late = (
            mean([getattr(row, name) for row in own]) if own else None
            for name in ("mission_time_mean", "priority_done_share", "energy_mean", "decision_ms_mean")
        )
        cells.append([policy, str(len(own)), number(time, 5), percent(done), number(energy, 4), number(late, 3)])
    run = next(iter(comparison.jobs.values())).run
    limit = "no deadline" if run.deadline_ms is None else f"{run.deadline_ms:g} ms for each decision"
    size = f"{counted(len(comparison.instances), 'mission')}, {counted(len(comparison.seeds), 'seed')}"
    notes = [f"{size}; knowledge {run.knowledge}; {limit}; {run.version}; {run.machine}."]
    notes += [f"{row.mission}, {row.policy}: {row.reason}" for row in rows if row.reason]
    header = ["policy", "missions", "time", "priority done", "energy", "ms/decision"]
    return Table("Policies", header, cells, [*notes, *doubts(endings)])


def difference_tables(differences: Sequence[PolicyDifference], missions: int) -> list[Table]:
    """Return how policies differ from the first one in so many missions, as one table; none if there is only one."""
    if not differences:
        return []
    first, confidence = differences[0].against, percent(CONFIDENCE)
    title = f"Against {first}, in the same missions with the same seeds ({confidence} interval)"
    header = ["policy", "time", "interval", "pairs", "energy", "interval", "priority done", "interval", "pairs"]
    return [Table(title, header, [_difference(one) for one in differences], _sample(missions))]


def _sample(missions: int) -> list[str]:
    """Return what is to be known of a small sample, in a sentence."""
    if missions == 1:
        return ["A single mission: pairs are its seeds, and tell nothing of other missions."]
    return [f"Small sample: intervals from fewer than {SMALL} missions say little."] if missions < SMALL else []


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
    """Return the mean and the two ends in per cent, dashes for what is not known."""
    if interval.mean is None:
        return ["-", "-"]
    mean = f"{_percent(interval.mean)} %"
    if interval.low is None or interval.high is None:
        return [mean, "-"]
    return [mean, f"{_percent(interval.low)} to {_percent(interval.high)} %"]


def _percent(share: float) -> str:
    return "0" if abs(share) < 5e-7 else f"{100 * share:+.3g}"
