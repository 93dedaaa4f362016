"""Statistics of comparisons: hand-computed numbers, and invariances."""

import numpy as np
import pytest

from alloc.allocators.experiments import statistics
from alloc.allocators.experiments.statistics import (
    differences,
    holm,
    interval,
    scores,
    signed_rank,
)
from alloc.allocators.experiments.store.outcome import Ending, Outcome


def solved(makespan, energy=1.0):
    return Ending(outcome=Outcome.SOLVED, makespan=makespan, energy=energy)


def runs(*makespans):
    """Return how runs ended, one seed an instance."""
    return [[solved(one)] for one in makespans]


FAILED = Ending(outcome=Outcome.FAILED)


def test_seeds_are_averaged_within_an_instance():
    """An instance is one observation, the mean over its seeds, or none if a run has no score."""
    found = scores([[solved(1.0), solved(3.0)], [solved(1.0), FAILED], [solved(1.0), None], [solved(None)]], "makespan")
    np.testing.assert_array_equal(found, [2.0, np.nan, np.nan, np.nan])
    (one,) = differences({"a": [[solved(2.0)] * 9] * 4, "b": [[solved(1.0), solved(2.0), solved(3.0)] * 3] * 4})
    assert (one.instances, one.mean, one.equal) == (4, 0.0, 4)


def test_differences_are_relative_and_paired():
    """Each instance is compared with itself, so that large instances do not outweigh small ones."""
    first, second = differences({"a": runs(1, 10, 100), "b": runs(1.1, 11, 110), "c": runs(0.5, 10, 150)})
    assert (first.method, first.against) == ("b", "a")
    assert first.mean == pytest.approx(0.1)
    assert (second.better, second.equal, second.worse) == (1, 1, 1)
    assert second.mean == pytest.approx(0)


def test_instances_without_a_score_are_left_out_and_counted():
    """If one of two methods failed or left a task unserved, the instance is counted as left out."""
    base = {"a": [[solved(1.0)], [solved(None)], [FAILED], [solved(1.0)]], "b": runs(2, 2, 2, 2)}
    (one,) = differences(base)
    assert (one.instances, one.left_out, one.worse) == (2, 2, 2)
    assert (one.low, one.high, one.p, one.p_holm) == (None, None, None, None)


def test_two_zero_scores_are_equal():
    """Two energies of 0 are equal; ratios of 1 to 0 are left out."""
    endings = {"a": [[solved(1.0, 0.0)]] * 2 + [[solved(1.0, 2.0)]]}
    endings["b"] = [[solved(1.0, 0.0)], [solved(1.0, 1.0)], [solved(1.0, 1.0)]]
    (one,) = differences(endings, "energy")
    assert (one.instances, one.left_out, one.better, one.equal, one.worse) == (2, 1, 1, 1, 0)
    assert one.mean == pytest.approx(-0.25)


def test_small_samples_are_recognised():
    """Nine instances are a small sample, ten are not."""
    assert differences({"a": runs(*[1] * 9), "b": runs(*[2] * 9)})[0].is_small
    assert not differences({"a": runs(*[1] * 10), "b": runs(*[2] * 10)})[0].is_small


def test_wilcoxon_has_the_exact_p_value():
    """For six differences of one sign p is 2 / 2^6, with or without ties; zeros are left out; none have no p."""
    assert signed_rank(np.arange(1.0, 7.0)) == pytest.approx(2 / 2**6)
    assert signed_rank(np.ones(6)) == pytest.approx(2 / 2**6)
    assert signed_rank(np.array([0.0, 0, *range(1, 7)])) == pytest.approx(2 / 2**6)
    assert signed_rank(np.zeros(5)) == 1.0
    assert signed_rank(np.ones(2)) is None


def test_holm_multiplies_by_the_remaining_hypotheses():
    """The smallest p of three counts three times, the next twice, and none is below the one before it."""
    assert holm([0.04, 0.01, None, 0.03]) == pytest.approx([0.06, 0.03, None, 0.06], nan_ok=True)
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert holm([]) == []


def test_intervals_have_their_nominal_coverage(monkeypatch):
    """About 95 % of intervals from thirty skewed values contain the true mean."""
    monkeypatch.setattr(statistics, "RESAMPLES", 999)
    rng = np.random.default_rng(7)
    found = [interval(rng.lognormal(size=30)) for _ in range(100)]
    share = np.mean([low <= np.exp(0.5) <= high for low, high in found])
    assert 0.86 <= share <= 0.99


def test_intervals_of_equal_values_are_a_point():
    """If all differences are equal, the interval is that value; intervals are deterministic."""
    assert interval(np.full(5, 0.25)) == (0.25, 0.25)
    assert interval(np.array([1.0, 2.0, 4.0])) == interval(np.array([1.0, 2.0, 4.0]))
