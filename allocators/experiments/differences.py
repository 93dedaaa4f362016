"""Paired differences of policies from the first one, on the same missions and seeds, with 95 % intervals."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from alloc.allocators.experiments.policies import PolicyRow
from alloc.allocators.experiments.statistics import CONFIDENCE
from alloc.problems import MissionResult

MEASURES = ("mission_time", "priority_done_share", "energy")


@dataclass(frozen=True)
class Interval:
    """A mean difference with its 95 % confidence interval (Student's t).

    Attributes
    ----------
    mean : float or None
        None if there are no pairs.
    low, high : float or None
        None for a single pair.
    pairs : int
        Missions, or seeds of a single mission, for which both policies have a value.
    """

    mean: float | None
    low: float | None
    high: float | None
    pairs: int


@dataclass(frozen=True, kw_only=True)
class PolicyDifference:
    """Differences between two policies, over all missions and seeds.

    Attributes
    ----------
    policy, against : str
    mission_time, energy : Interval
        Relative differences: -0.1 is 10 % less. Mission times only of pairs of runs that both did all tasks.
    priority_done_share : Interval
        Difference of the two shares.
    """

    policy: str
    against: str
    mission_time: Interval
    energy: Interval
    priority_done_share: Interval

    def to_dict(self) -> dict[str, object]:
        """Return the fields by name, ready for JSON.

        Returns
        -------
        dict
        """
        return asdict(self)


def paired_differences(rows: Sequence[PolicyRow]) -> list[PolicyDifference]:
    """Return the paired differences of each policy from the first one, by mission and seed.

    Runs of one mission are not independent; with several missions, pairs are therefore means over their seeds.

    Parameters
    ----------
    rows : sequence of PolicyRow
        Rows of `compare_policies`.

    Returns
    -------
    list of PolicyDifference
        One for each policy but the first.
    """
    policies = list(dict.fromkeys(row.policy for row in rows))
    runs = {(row.policy, row.number): {result.seed: result for result in row.results} for row in rows}
    missions = sorted({row.number for row in rows})
    found = []
    for policy in policies[1:]:
        pairs = [_pairs(runs.get((policy, number), {}), runs.get((policies[0], number), {})) for number in missions]
        intervals = {
            name: paired_interval([[_difference(name, *pair) for pair in some] for some in pairs]) for name in MEASURES
        }
        found.append(PolicyDifference(policy=policy, against=policies[0], **intervals))
    return found


def _pairs(
    ours: dict[int, MissionResult], theirs: dict[int, MissionResult]
) -> list[tuple[MissionResult, MissionResult]]:
    return [(result, theirs[seed]) for seed, result in ours.items() if seed in theirs]


def _difference(measure: str, one: MissionResult, other: MissionResult) -> float | None:
    """Return a relative difference, or the difference of two shares; None if a run lacks the value."""
    ours, theirs = getattr(one, measure), getattr(other, measure)
    if ours is None or theirs is None:
        return None
    if measure == "priority_done_share":
        return float(ours - theirs)
    return float(ours / theirs - 1) if theirs > 0 else None


def paired_interval(by_mission: Sequence[Sequence[float | None]]) -> Interval:
    """Return the interval of differences, given by mission and seed; None marks a pair without a value."""
    from scipy import stats

    known = [[value for value in values if value is not None] for values in by_mission]
    values = known[0] if len(known) == 1 else [float(np.mean(some)) for some in known if some]
    count = len(values)
    if count < 2:
        return Interval(values[0] if values else None, None, None, count)
    mean = float(np.mean(values))
    half = float(stats.t.ppf((1 + CONFIDENCE) / 2, count - 1) * np.std(values, ddof=1) / np.sqrt(count))
    return Interval(mean, mean - half, mean + half, count)
