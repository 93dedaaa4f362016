"""Statistics of a comparison: scores by instance, paired differences with intervals, and tests.

The instance is the unit of observation: seeds are averaged per instance, so that a hundred runs on three instances are
three observations, not a hundred. All tests and intervals are computed by scipy.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.stored import Endings

CONFIDENCE = 0.95

RESAMPLES = 9999
"""Number of bootstrap resamples; their seed is fixed, so that the same runs give the same interval."""

SMALL = 10
"""Number of instances below which the sample is reported as small, as intervals and tests then say little."""

MIN_INSTANCES = 3
"""Minimum number of instances for an interval or a test."""

MAX_DRAWN = 20_000_000
"""Maximum number of values that the bootstrap draws at once, to limit memory; enough for 2,000 instances."""

EQUAL = 1e-9
"""Relative difference up to which two scores count as equal, as in the evaluator."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Comparison of two methods over all instances on which both have the score for every seed.

    Attributes
    ----------
    method, against : str
    score : str
        ``makespan`` or ``energy``.
    instances : int
        Number of instances compared.
    left_out : int
        Number of instances on which one of the two lacks the score, for instance because a task was unserved or a run
        failed, or on which the other has 0 and this method more, so that there is no ratio.
    mean : float or None
        Mean relative difference: -0.1 is 10 % less than the other.
    low, high : float or None
        BCa bootstrap 95 % confidence interval of the mean; None for fewer than three instances.
    p : float or None
        p-value of Wilcoxon's signed-rank test, two-sided.
    p_holm : float or None
        p-value corrected for the number of methods by Holm's procedure.
    better, equal, worse : int
        Number of instances on which the method has a lower, equal and higher score than the other.
    """

    method: str
    against: str
    score: str
    instances: int
    left_out: int
    mean: float | None = None
    low: float | None = None
    high: float | None = None
    p: float | None = None
    p_holm: float | None = None
    better: int = 0
    equal: int = 0
    worse: int = 0

    @property
    def is_small(self) -> bool:
        """Whether the number of instances is small; see `SMALL`."""
        return self.instances < SMALL


def scores(endings: Sequence[Sequence[Ending | None]], score: str) -> NDArray[np.float64]:
    """Return the mean of a score over the seeds of each instance; NaN if a run lacks it.

    Parameters
    ----------
    endings : sequence of sequence of Ending or None
        Endings of one method, by instance and seed.
    score : str
        A field of `Ending`.

    Returns
    -------
    ndarray, shape (instances,)
    """
    return np.array([_mean([_score(ending, score) for ending in runs]) for runs in endings])


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


def _score(ending: Ending | None, score: str) -> float:
    """Return a score, or NaN; energy counts only if all tasks are served, as idling costs none."""
    if ending is None or ending.outcome is not Outcome.SOLVED or ending.makespan is None:
        return float("nan")
    value = getattr(ending, score)
    return float("nan") if value is None else float(value)


def differences(endings: Endings, score: str = "makespan") -> list[Difference]:
    """Return the differences of each method from the first one, on the same instances.

    Parameters
    ----------
    endings : mapping
        How runs ended, by method, instance and seed.
    score : str
        ``makespan`` or ``energy``.

    Returns
    -------
    list of Difference
        One for each method but the first.
    """
    first, *others = endings
    base = scores(endings[first], score)
    found = [_difference(other, first, score, scores(endings[other], score), base) for other in others]
    corrected = holm([one.p for one in found])
    return [Difference(**{**vars(one), "p_holm": p}) for one, p in zip(found, corrected, strict=True)]


def _difference(
    method: str, against: str, score: str, ours: NDArray[np.float64], theirs: NDArray[np.float64]
) -> Difference:
    both_nothing = (ours == 0) & (theirs == 0)
    known = ~np.isnan(ours) & ((theirs > 0) | both_nothing)
    relative = (ours[known] + both_nothing[known]) / (theirs[known] + both_nothing[known]) - 1  # 1 / 1 for 0 / 0
    relative[np.abs(relative) <= EQUAL] = 0.0
    low, high = interval(relative)
    return Difference(
        method=method,
        against=against,
        score=score,
        instances=len(relative),
        left_out=len(ours) - len(relative),
        mean=float(relative.mean()) if len(relative) else None,
        low=low,
        high=high,
        p=signed_rank(relative),
        better=int((relative < 0).sum()),
        equal=int((relative == 0).sum()),
        worse=int((relative > 0).sum()),
    )


def interval(values: NDArray[np.float64]) -> tuple[float | None, float | None]:
    """Return the BCa bootstrap 95 % confidence interval of the mean; None for fewer than three values.

    Parameters
    ----------
    values : ndarray, shape (instances,)
        Finite values.

    References
    ----------
    Efron (1987), Better bootstrap confidence intervals, doi:10.1080/01621459.1987.10478410.
    """
    from scipy import stats

    if len(values) < MIN_INSTANCES:
        return None, None
    if np.ptp(values) == 0:  # all resamples are equal, and BCa is undefined
        return float(values[0]), float(values[0])
    found = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=RESAMPLES,
        batch=max(1, MAX_DRAWN // len(values)),
        confidence_level=CONFIDENCE,
        method="BCa",
        rng=np.random.default_rng(0),
    )
    low, high = found.confidence_interval
    return float(low), float(high)


def signed_rank(values: NDArray[np.float64]) -> float | None:
    """Return the p-value of Wilcoxon's signed-rank test, two-sided; None for fewer than three values.

    Zeros are left out, as by Wilcoxon; if all values are zero, p is 1. With ties among few values, the exact
    distribution is enumerated.

    Parameters
    ----------
    values : ndarray, shape (instances,)
        Differences, finite.

    References
    ----------
    Wilcoxon (1945), Individual comparisons by ranking methods, doi:10.2307/3001968.
    """
    from scipy import stats

    if len(values) < MIN_INSTANCES:
        return None
    differing = values[values != 0]
    if not len(differing):
        return 1.0
    has_ties = len(np.unique(np.abs(differing))) < len(differing)
    method = stats.PermutationMethod(n_resamples=2**13) if has_ties and len(differing) <= 13 else "auto"
    return float(stats.wilcoxon(differing, method=method).pvalue)


def holm(p_values: Sequence[float | None]) -> list[float | None]:
    """Return p-values corrected for their number by Holm's procedure; None stays None.

    References
    ----------
    Holm (1979), A simple sequentially rejective multiple test procedure.
    """
    order = sorted((p, place) for place, p in enumerate(p_values) if p is not None)
    corrected: list[float | None] = [None] * len(p_values)
    largest = 0.0
    for rank, (p, place) in enumerate(order):
        largest = max(largest, min(1.0, (len(order) - rank) * p))
        corrected[place] = largest
    return corrected
