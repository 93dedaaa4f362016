"""Distances in the compiled loops are those of the instance."""

from itertools import product

import numpy as np
from hypothesis import given, settings
from strategies import instances

from alloc.allocators.heuristic.local_search.candidates import arrays_and_candidates
from alloc.allocators.heuristic.local_search.distances import untabulated_distance
from alloc.allocators.heuristic.local_search.instance_arrays import instance_arrays
from alloc.problems import Instance


@settings(max_examples=60, deadline=None)
@given(instances())
def test_distances_match_reach(instance):
    """The loops compute the same distances as `Reach`, bit for bit, and ``inf`` out of reach."""
    arrays = instance_arrays(instance)
    expected = np.where(instance.reach.mask, instance.reach.distance, np.inf)
    for row, task in product(range(len(arrays.origin_position)), range(instance.m)):
        assert untabulated_distance.py_func(arrays, row, task) == expected[row, task]
    tabulated, _ = arrays_and_candidates(instance, 2)
    assert np.array_equal(tabulated.distance, expected)


def test_extreme_coordinates_match_reach():
    """Coordinates at the limits of the valid range have the distances of `Reach`."""
    instance = Instance(
        ability=[1, 1], workload=[1, 1], agent_position=[[1e60, 0], [0, 3e40]], task_position=[[0, 1e60], [5, 5]]
    )
    arrays, _ = arrays_and_candidates(instance, 2)
    assert np.array_equal(arrays.distance, instance.reach.distance)
