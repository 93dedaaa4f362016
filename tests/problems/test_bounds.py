"""Lower bounds: never above the optimum, and equal to hand-computed values."""

from typing import Any
from unittest import mock

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from oracle import brute_force
from strategies import instances, rebuilt

from alloc.problems import Instance, energy_lower_bound, lp_makespan_lower_bound, makespan_lower_bound
from alloc.problems.generate import paper

ROUNDING = 1 + 1e-9


@given(instances(most_agents=5, most_tasks=3))
def test_bounds_never_exceed_the_optimum(instance: Instance) -> None:
    """If all tasks can be served, no bound exceeds the optimum of brute force."""
    best = brute_force(instance)
    assume(not best.unserved)
    assert makespan_lower_bound(instance) <= best.makespan * ROUNDING
    fractional = lp_makespan_lower_bound(instance)
    assert fractional is None or fractional <= best.makespan * ROUNDING
    energy = energy_lower_bound(instance, best.makespan)
    assert energy is None or energy <= best.energy * ROUNDING


@given(instances(most_agents=4, most_tasks=3))
def test_energy_bound_never_increases_with_time(instance: Instance) -> None:
    """More time never raises the energy bound."""
    best = brute_force(instance)
    assume(not best.unserved)
    tight, loose = (energy_lower_bound(instance, best.makespan * factor) for factor in (1.0, 2.0))
    assert tight is not None
    assert loose is not None
    assert loose <= tight * ROUNDING + 1e-12


@given(instances(most_agents=4, most_tasks=3))
def test_bound_never_increases_with_another_agent(instance: Instance) -> None:
    """A copy of the first agent never raises the bound, unless there are too few agents anyway."""
    assume(instance.n >= (instance.workload > 0).sum())
    more = rebuilt(instance, np.append(np.arange(instance.n), 0), np.arange(instance.m))
    assert makespan_lower_bound(more) <= makespan_lower_bound(instance) * ROUNDING


@pytest.mark.parametrize(
    ("fields", "bound"),
    [
        ({"ability": [2, 3], "workload": [5, 5]}, 5 / 2),  # one of the two has agent 2 alone
        ({"ability": [1, 1, 1, 1], "workload": [2, 6]}, 2.0),  # all abilities against all workloads
        ({"ability": [10, 1, 1], "workload": [4, 4, 4]}, 4.0),  # at most one task has the large agent
        ({"ability": [5, 1], "workload": [6, 1], "allowed_tasks": [[1], [0, 1]]}, 6.0),  # its only agent
        ({"ability": [1, 1, 1], "workload": [2, 2.5]}, 2.0),  # demands 1 + 2 fit from T = 2 on, not before
        ({"ability": [1, 2], "workload": [0, 0]}, 0.0),
    ],
)
def test_every_part_of_the_bound_is_tight_somewhere(fields: dict, bound: float) -> None:
    """Each part of the bound is the largest in some instance."""
    assert makespan_lower_bound(Instance(**fields)) == pytest.approx(bound)


def test_bound_by_arrival_matches_hand_calculation() -> None:
    """An agent of ability 2, 3 hours from the nearest task, cannot do 4 before hour 5."""
    instance = Instance(
        ability=[1, 1], workload=[2, 2], agent_position=[[3, 0]] * 2, task_position=[[0, 0], [0, 0]], speed=[1, 1]
    )
    assert makespan_lower_bound(instance) == pytest.approx(5.0)
    stuck = Instance(ability=[1, 1], workload=[2], speed=[1, np.inf], allowed_tasks=[None, []])
    assert makespan_lower_bound(stuck) == pytest.approx(2.0)


def test_bound_by_linear_programme_matches_hand_calculation() -> None:
    """Tasks 1 and 2 with 6 hours of work together have only agents 1 and 2 of ability 1: 3 hours."""
    instance = Instance(ability=[1, 1, 9], workload=[2, 4, 9], allowed_tasks=[[0, 1], [0, 1], [2]])
    bound = lp_makespan_lower_bound(instance)
    assert bound == pytest.approx(3.0, rel=1e-6)
    assert bound <= 3.0


def test_energy_bound_matches_hand_calculation() -> None:
    """Both tasks must be done in an hour: two agents fly 1 each at 5 per unit, one of the others stays."""
    instance = Instance(
        ability=[2, 2, 2],
        workload=[2, 4],
        task_position=[[0, 0], [1, 0]],
        start_task=[0, 0, 0],
        energy_per_distance=5.0,
    )
    assert energy_lower_bound(instance, 1.0) == pytest.approx(10.0, rel=1e-6)
    assert energy_lower_bound(instance, 0.5) is None  # not even all agents together are that fast


@pytest.mark.parametrize("scenario", [1, 2, 3, 4])
def test_bound_of_paper_instances_is_an_hour(scenario: int) -> None:
    """Abilities and workloads have equal totals, so that the bound is 1 h, which is reached."""
    assert makespan_lower_bound(paper(scenario, 0)) == pytest.approx(1.0, abs=1e-12)


def test_bound_is_tight_with_one_dominant_agent() -> None:
    """If one agent has a thousand times the work of all others, tolerances of the solver do not weaken the bound."""
    lists = [[0], *[list(range(1, 31))] * 300]
    instance = Instance(ability=np.ones(301), workload=[1e4, *[1] * 30], allowed_tasks=lists)
    assert lp_makespan_lower_bound(instance) == pytest.approx(1e4, rel=1e-11)


@given(instances(most_agents=4, most_tasks=3), st.integers(0, 2**32))
def test_bound_is_valid_for_any_multipliers(instance: Instance, seed: int) -> None:
    """Bounds are valid even for wrong multipliers of the solver."""
    best, rng = brute_force(instance), np.random.default_rng(seed)
    assume(not best.unserved)

    def wrong(cost: np.ndarray, constraints: Any, limits: np.ndarray, time_limit_s: float) -> np.ndarray:
        return rng.exponential(size=len(limits))

    with mock.patch("alloc.problems.bounds._multipliers", wrong):
        fractional, energy = lp_makespan_lower_bound(instance), energy_lower_bound(instance, best.makespan)
    assert fractional is None or fractional <= best.makespan * ROUNDING
    assert energy is None or energy <= best.energy * ROUNDING


def test_bound_is_valid_for_extreme_ratios() -> None:
    """Bounds are valid for extreme ratios of ability to workload."""
    instance = Instance(ability=[1e-60, 1.0], workload=[1.0, 1e-60])
    assert (lp_makespan_lower_bound(instance) or 0.0) <= 1.0 + 1e-9
    assert makespan_lower_bound(instance) <= 1.0


@pytest.mark.parametrize("work", [1e-60, 3e-60, 1e-59])
def test_smallest_workloads_have_a_valid_bound(work: float) -> None:
    """The smallest representable workloads have a valid bound, too."""
    instance = Instance(ability=[1, 2, 3, 4], workload=[work, work * 3, 0])
    assert makespan_lower_bound(instance) <= brute_force(instance).makespan
