"""Paired differences of policies from the first one, on the same missions and seeds, with 95 % intervals.

They are the same as on the page of `alloc report` for these missions.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from alloc.allocators.experiments.policies import PolicyRow
from alloc.allocators.experiments.statistics import interval
from alloc.allocators.experiments.sweep import mean
from alloc.problems import MissionResult

MEASURES = ("mission_time", "priority_done_share", "energy")


@dataclass(frozen=True)
class Interval:
    """A mean difference with its 95 % BCa bootstrap interval.

    Attributes
    ----------
    mean : float or None
        None if there are no pairs.
    low, high : float or None
        None for fewer than three pairs.
    pairs : int
        Missions in which both policies have a value for every seed; seeds, if there is only one mission.
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
        Relative differences: -0.1 is 10 % less. Only of pairs in which both policies did all tasks.
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
    """Return the paired differences of each policy from the first one, on the same missions and seeds.

    A pair is a mission, with means over its seeds, as runs of one mission are not independent. With a single mission, a
    pair is a seed.

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
        by_mission = [
            _pairs(runs.get((policy, number), {}), runs.get((policies[0], number), {})) for number in missions
        ]
        pairs = [[pair] for pair in by_mission[0]] if len(missions) == 1 else by_mission
        intervals = {name: paired_interval([_difference(name, some) for some in pairs]) for name in MEASURES}
        found.append(PolicyDifference(policy=policy, against=policies[0], **intervals))
    return found


def _pairs(
    ours: dict[int, MissionResult], theirs: dict[int, MissionResult]
) -> list[tuple[MissionResult, MissionResult]]:
    return [(result, theirs[seed]) for seed, result in ours.items() if seed in theirs]


def _difference(measure: str, pairs: Sequence[tuple[MissionResult, MissionResult]]) -> float | None:
    """Return the relative difference of two means, or the difference of two mean shares; None where a run lacks it."""
    if not pairs:
        return None
    ours, theirs = (mean([_figure(measure, pair[side]) for pair in pairs]) for side in (0, 1))
    if ours is None or theirs is None:
        return None
    if measure == "priority_done_share":
        return ours - theirs
    return ours / theirs - 1 if theirs > 0 else None


def _figure(measure: str, result: MissionResult) -> float | None:
    """Return a measure of a run; none of the energy where tasks are left, as idling takes none."""
    value: float | None = getattr(result, measure)
    return None if measure == "energy" and result.mission_time is None else value


def paired_interval(differences: Sequence[float | None]) -> Interval:
    """Return the mean of the differences of pairs, with its interval; None where a pair lacks the figure."""
    values = np.array([value for value in differences if value is not None], dtype=float)
    low, high = interval(values)
    return Interval(float(values.mean()) if len(values) else None, low, high, len(values))
