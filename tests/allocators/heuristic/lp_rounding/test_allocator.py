"""Relax, round and repair."""

import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import all_can_be_served, seeds_where, tiny_instance

from alloc.allocators import Budget, RefusedError, Search, solve
from alloc.allocators.heuristic.lp_rounding.allocator import LpRound, LpRoundParameters
from alloc.allocators.heuristic.lp_rounding.relaxation import Relaxation
from alloc.problems import InputError, Instance, Objective, evaluate, paper


def relaxation(instance: Instance, by_place: bool = True) -> tuple[Relaxation, Search]:
    lp = Relaxation(instance, by_place=by_place, time_share=0.4)
    return lp, Search(instance, Objective.MAKESPAN_ENERGY, Budget(None))


def test_least_makespan_matches_hand_calculation() -> None:
    """Two thirds of the ability go to two thirds of the work; with task lists, each agent does its own task."""
    lp, search = relaxation(Instance(ability=[4, 2], workload=[4, 2]))
    assert lp.least_makespan(search) == pytest.approx(1.0)
    lp, search = relaxation(Instance(ability=[3, 3], workload=[4, 2], allowed_tasks=[[0], [1]]))
    assert lp.least_makespan(search) == pytest.approx(4 / 3)
    late = Instance(ability=[1], workload=[2], agent_position=[[0, 0]], task_position=[[3, 0]], speed=[1])
    lp, search = relaxation(late)
    assert lp.least_makespan(search) == pytest.approx(5.0)


@pytest.mark.parametrize("seed", seeds_where(lambda one: all_can_be_served(one) and not one.has_travel_time, 20))
def test_relaxation_never_exceeds_the_optimum(seed: int) -> None:
    """The least fractional makespan is at most that of any allocation that serves every task."""
    instance = tiny_instance(seed)
    best = brute_force(instance)
    assert not best.unserved
    lp, search = relaxation(instance)
    assert lp.least_makespan(search) <= best.makespan * (1 + 1e-6)


def test_rounding_lacks_at_most_one_agent_per_task() -> None:
    """Before any repair, no task of the first scenario is short by more than an agent of ability 10."""
    instance = paper(1, 1000)
    lp, search = relaxation(instance)
    makespan = lp.least_makespan(search)
    rounded = lp.rounded(search, makespan)
    assert (evaluate(instance, rounded).group_ability >= instance.workload / makespan - 10 - 1e-6).all()


def test_energy_is_near_its_bound() -> None:
    """Scenario 1 is solved to T = 1 with an energy slightly above its bound."""
    result = solve(paper(1, 1000), "lp-round", objective="makespan-energy", iterations=200, time_limit_s=None)
    assert result.makespan == pytest.approx(1.0)
    assert result.energy <= 1.4 * result.energy_lower_bound


def test_large_programmes_are_refused() -> None:
    """If the linear programme cannot be solved in time, it is refused before the clock starts."""
    rng = np.random.default_rng(0)
    large = Instance(
        ability=rng.random(4000) + 1,
        workload=np.ones(200),
        agent_position=rng.random((4000, 2)),
        task_position=rng.random((200, 2)),
    )
    with pytest.raises(RefusedError, match="linear programme"):
        solve(large, "lp-round", objective="makespan-energy", time_limit_s=1)


def test_parameters_are_set_by_keyword() -> None:
    """Parameters are set by keyword; wrong ones are named."""
    assert LpRound(repair_iterations=0).parameters == LpRoundParameters(repair_iterations=0)
    with pytest.raises(InputError) as caught:
        LpRound(time_share=0)
    assert caught.value.place == "time_share"
