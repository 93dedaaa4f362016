"""Performance profiles and targets over time, compared with hand-computed numbers."""

import pytest

from alloc.allocators.experiments.profiles import profiles, targets_reached
from alloc.allocators.experiments.store.outcome import Ending, Outcome


def solved(makespan, trace=()):
    return Ending(outcome=Outcome.SOLVED, makespan=makespan, energy=1.0, trace=trace)


def runs(*makespans):
    """Return how runs ended, one seed an instance."""
    return [[solved(one)] for one in makespans]


def test_profiles_count_instances_within_a_factor_of_the_best():
    """At factor 1 a profile is the share of wins; unsolved instances count against a method."""
    endings = {"a": runs(1, 2, 1, None), "b": runs(2, 1, None, None)}
    assert profiles(endings, [1.0, 2.0]) == {"a": pytest.approx([2 / 3, 1.0]), "b": pytest.approx([1 / 3, 2 / 3])}
    assert profiles({"a": runs(None)}, [1.0]) == {"a": [0.0]}


def test_targets_are_reached_over_time():
    """A run reaches a target when its trace first has it; the best known may be by another method."""
    fast = solved(1.0, trace=((0.1, None, 0.0, None), (0.5, 1.04, 0.0, None), (2.0, 1.0, 0.0, None)))
    slow = solved(1.2, trace=((0.1, 1.2, 0.0, None),))
    found = targets_reached({"a": [[fast]], "b": [[slow]], "c": [[None]]}, [0.2, 1.0, 3.0], within=(0.0, 0.05))
    assert found == {"a": [0.0, 0.5, 1.0], "b": [0.0, 0.0, 0.0], "c": [0.0, 0.0, 0.0]}
