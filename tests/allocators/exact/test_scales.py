"""Optima and bounds are valid in any units of distances, workloads and abilities."""

import numpy as np
import pytest
from oracle import brute_force, least_energy_within
from tiny_instances import scaled_instance

from alloc.allocators import Status, solve
from alloc.allocators.exact.cpsat import integer_costs
from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.milp import scaled_costs
from alloc.allocators.exact.model import Model
from alloc.allocators.exact.solver_model import SolverLimits, SolverModel
from alloc.problems import (
    Instance,
    agent_classes,
    energy_lower_bound,
    fewest_unserved,
    lp_makespan_lower_bound,
    makespan_lower_bound,
)
from alloc.problems.generate import paper_like

EQUAL = 1 + 1e-9

SERVED = [seed for seed in range(40) if fewest_unserved(scaled_instance(seed)) == 0]


@pytest.mark.parametrize("method", ["milp", "cpsat", "auto"])
@pytest.mark.parametrize(
    "seed", [pytest.param(one, marks=[pytest.mark.slow] * (k >= 6)) for k, one in enumerate(SERVED[:20])]
)
def test_optima_and_bounds_match_brute_force(seed, method):
    """Plans reported as optimal are optimal, and no bound exceeds the value of a plan."""
    instance = scaled_instance(seed)
    result = solve(instance, method, objective="makespan-energy", time_limit_s=60)
    assert result.status is Status.OPTIMAL
    assert result.makespan == pytest.approx(brute_force(instance).makespan, rel=1e-6)
    assert result.lower_bound <= brute_force(instance).makespan * EQUAL
    least = least_energy_within(instance, result.makespan)
    assert result.energy == pytest.approx(least, rel=1e-6, abs=0)
    assert result.energy_lower_bound <= least * EQUAL


@pytest.mark.parametrize("seed", SERVED)
def test_bounds_without_integer_solver_are_valid(seed):
    """No bound of the linear programmes, nor of the sums, exceeds the best plan's value."""
    instance = scaled_instance(seed)
    best = brute_force(instance)
    energy, fractional = energy_lower_bound(instance, best.makespan), lp_makespan_lower_bound(instance)
    assert makespan_lower_bound(instance) <= best.makespan * EQUAL
    assert fractional is None or fractional <= best.makespan * EQUAL
    assert energy is None or energy <= best.energy * EQUAL


@pytest.mark.parametrize("method", ["milp", "cpsat", "auto"])
@pytest.mark.parametrize("unit", [1e-9, 1e-7, 1.0, 1e9])
def test_least_energy_matches_hand_calculation(method, unit):
    """The least energy is four units of distance, not five, however small the unit."""
    instance = Instance(
        ability=[2, 1, 3],
        workload=[2, 2],
        agent_position=[[6 * unit, 0], [4 * unit, 0], [7 * unit, 0]],
        task_position=[[4 * unit, 0], [5 * unit, 0]],
    )
    result = solve(instance, method, objective="makespan-energy")
    assert result.status is Status.OPTIMAL
    assert result.energy == pytest.approx(4 * unit, rel=1e-9, abs=0)
    assert result.energy_lower_bound <= 4 * unit * EQUAL


@pytest.mark.parametrize(("method", "unit"), [("milp", 2.0**-30), ("cpsat", 2.0**-30), ("milp", 2.0**30)])
@pytest.mark.parametrize(
    ("plain", "budget"),
    [
        (paper_like(20, 10, 70, 1), {"time_limit_s": 10}),  # both sides meet
        (paper_like(24, 12, 80, 3), {"time_limit_s": None, "iterations": 20}),  # the solver closes what they leave
    ],
    ids=["in time", "in iterations"],
)
def test_larger_instances_are_proven_in_any_unit(method, unit, plain, budget):
    """If plans and bounds are sought before the solver, the least energy is the same number of units as well."""
    scaled = Instance(
        ability=plain.ability,
        workload=plain.workload,
        agent_position=plain.start_position * unit,
        task_position=plain.task_position * unit,
        energy_per_distance=plain.energy_per_distance,
    )
    one, other = (solve(each, method, objective="makespan-energy", **budget) for each in (plain, scaled))
    assert one.status is other.status is Status.OPTIMAL
    assert other.energy == pytest.approx(one.energy * unit, rel=1e-6, abs=0)


@pytest.mark.parametrize("method", ["milp", "cpsat", "auto"])
@pytest.mark.parametrize("small", [1e-13, 1e-11, 1e-10, 9e-10, 1.1e-9, 1e-8])
@pytest.mark.parametrize("speed", [np.inf, 1e3])
def test_equal_makespans_cost_the_least_energy_of_all(method, small, speed):
    """An agent that saves less than the tolerance stays idle, one that saves more is sent: all methods agree."""
    instance = Instance(
        ability=[1, small], workload=[1], agent_position=[[0, 0], [5, 0]], task_position=[[0, 0]], speed=[speed] * 2
    )
    result = solve(instance, method, objective="makespan-energy")
    least = least_energy_within(instance, result.makespan)
    assert result.status is Status.OPTIMAL
    assert result.energy == least
    assert result.energy_lower_bound <= least


def energy_model(cost: np.ndarray, hint: np.ndarray | None) -> SolverModel:
    """Return a model that minimises the cost, with a class of agents for each pair."""
    instance = Instance(ability=np.arange(1.0, 1 + len(cost)), workload=[1.0])
    demand: Demand = Model.build(instance, agent_classes(instance, by_place=False), 1).at(1.0)
    return SolverModel(demand, cost, hint, SolverLimits(seconds=1, threads=1, seed=0, repeatable=False))


@pytest.mark.parametrize("unit", [1e-280, 1e-9, 1e-3, 1.0, 1e9, 1e280])
@pytest.mark.parametrize("dear", [1.0, 1e9])
def test_costs_are_scaled_to_about_one_for_solvers(unit, dear):
    """For any unit, and any cost of pairs that no plan needs, the incumbent keeps its cost, and nothing overflows."""
    cost, hint = np.array([3.0, 1.0, 2.0 * dear]) * unit, np.array([1, 1, 0])
    scaled, scale = scaled_costs(energy_model(cost, hint))
    assert np.log2(scale) == round(np.log2(scale))
    assert 2.0**-8 <= scaled @ hint <= 2.0**22
    assert scaled @ hint / scale == cost @ hint
    assert (scaled / scale <= cost).all()
    whole, fine = integer_costs(energy_model(cost, hint))
    assert (whole >= 0).all()
    assert whole @ hint / fine == pytest.approx(cost @ hint, rel=1e-9, abs=0)


def test_ordinary_costs_are_not_scaled():
    """Costs of ordinary magnitude are passed to the solver unchanged."""
    cost = np.random.default_rng(0).random(5)
    scaled, scale = scaled_costs(energy_model(cost, np.ones(5, dtype=np.intp)))
    assert scale == 1.0
    assert (scaled == cost).all()
