"""Rankings of methods relative to the best known results and to each other, on hand-computed runs."""

import numpy as np
import pytest

from alloc.allocators.experiments.standings import Best, best_known, standings
from alloc.allocators.experiments.store.outcome import Ending, Outcome


def solved(makespan, energy=1.0, unserved=0, **others):
    """Return an ending; with unserved tasks, its makespan is over the served ones only."""
    whole = None if unserved else makespan
    scores = {"makespan": whole, "served_makespan": makespan, "energy": energy, "unserved": unserved}
    return Ending(outcome=Outcome.SOLVED, **scores, **others)


def stand(endings, label, *, energy=False):
    """Return the standing of a method with a single run."""
    (found,) = standings(endings, best_known(endings), None, energy=energy)[label].stands
    return found


def test_run_that_serves_fewer_tasks_is_never_best():
    """A plan that leaves out the longest task has a shorter makespan, but no comparison with the bound, and loses."""
    endings = {"all": [[solved(2.0, 4.0, lower_bound=1.6)]], "some": [[solved(1.0, 1.0, unserved=1)]]}
    assert best_known(endings) == [Best(1.6, 0, 2.0, 4.0)]
    assert stand(endings, "all").is_least
    assert stand(endings, "all").beyond_bound == pytest.approx(0.25)
    assert stand(endings, "all").energy_ratio == 1.0
    assert not stand(endings, "some").is_least
    assert np.isnan([stand(endings, "some").beyond_bound, stand(endings, "some").energy_ratio]).all()


def test_plans_that_serve_most_tasks_are_compared_if_none_serves_all():
    """The fewest unserved tasks come first, then the makespan over the served ones."""
    endings = {"a": [[solved(3.0, 2.0, 1)]], "b": [[solved(2.0, 3.0, 1)]], "c": [[solved(1.0, 1.0, 2)]]}
    assert best_known(endings) == [Best(0.0, 1, 2.0, 3.0)]
    assert [stand(endings, label).is_least for label in "abc"] == [False, True, False]
    found = standings(endings, best_known(endings), None, energy=True)
    assert [found[label].first for label in "abc"] == [0, 1, 0]


def test_excess_is_relative_to_the_best_of_the_others():
    """Negative values lead; energy is compared with that of methods that are no slower."""
    endings = {"a": [[solved(1.0, 3.0)]], "b": [[solved(2.0, 1.0)]]}
    first, second = stand(endings, "a", energy=True), stand(endings, "b", energy=True)
    assert (first.behind, second.behind) == pytest.approx((-0.5, 1.0))
    assert np.isnan(first.energy_behind)
    assert second.energy_behind == pytest.approx(1 / 3 - 1)


def test_late_runs_are_never_first():
    """A late result never wins, however good it is; ties both win."""
    late, in_time = solved(1.0, runtime_s=2.0), solved(2.0, runtime_s=1.0)
    endings = {"a": [[late, solved(1.0, runtime_s=1.0)]], "b": [[in_time, solved(1.0 + 1e-12, runtime_s=1.0)]]}
    found = standings(endings, best_known(endings), 1.0, energy=False)
    assert [found[label].first for label in "ab"] == [1, 2]
