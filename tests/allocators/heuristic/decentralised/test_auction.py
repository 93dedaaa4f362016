"""The auction in which tasks bid for agents."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from alloc.allocators import Budget, Search, solve
from alloc.allocators.heuristic.decentralised.auction import Auction
from alloc.allocators.heuristic.decentralised.deadlines import AuctionParameters, DeadlineSeries
from alloc.problems import IDLE, Allocation, InputError, Instance, Objective, evaluate, paper


def series(instance: Instance, objective: Objective = Objective.MAKESPAN_ENERGY) -> DeadlineSeries:
    return DeadlineSeries(Search(instance, objective, Budget(None)), AuctionParameters())


def test_single_agent_tasks_reach_the_bound_of_bertsekas() -> None:
    """If each task needs one of several equal agents, the distance exceeds the least by at most the increments."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        m = int(rng.integers(2, 8))
        instance = Instance(
            ability=np.ones(m),
            workload=np.ones(m),
            agent_position=rng.random((m, 2)),
            task_position=rng.random((m, 2)),
        )
        auction = series(instance)
        assert auction.meet(1.0)
        task = auction.market.owner
        assert sorted(task.tolist()) == list(range(m))
        cost = auction.cost[instance.reach.origin]
        least = cost[linear_sum_assignment(cost)].sum()
        assert cost[np.arange(m), task].sum() <= least + m * AuctionParameters().increment + 1e-9


def test_reported_deadlines_are_met() -> None:
    """If an auction meets all demands, tasks are done by the deadline, and no group has a superfluous agent."""
    for seed in range(1000, 1003):
        instance = paper(1, seed)
        auction = series(instance)
        assert auction.meet(1.05)
        allocation = evaluate(instance, Allocation(auction.market.owner.copy()))
        assert allocation.makespan <= 1.05 + 1e-9
        spare = allocation.group_ability - instance.workload / 1.05
        for i in np.flatnonzero(auction.market.owner != IDLE).tolist():
            assert spare[auction.market.owner[i]] < instance.ability[i]


def test_auction_ends_at_impossible_deadlines() -> None:
    """An auction for an infeasible deadline ends and reports failure."""
    assert not series(Instance(ability=[1, 1], workload=[4, 4])).meet(1.0)
    assert not series(Instance(ability=[1, 1], workload=[4, 4], allowed_tasks=[[0], [0]])).meet(4.0)


@pytest.mark.slow
def test_paper_scenario_is_solved() -> None:
    """The first scenario is solved to within 2 %, with less energy if that counts; messages are counted."""
    plain = solve(paper(1, 1000), "auction", iterations=20_000, time_limit_s=None)
    saving = solve(paper(1, 1000), "auction", objective="makespan-energy", iterations=20_000, time_limit_s=None)
    assert plain.makespan <= 1.02
    assert saving.makespan <= 1.02
    assert saving.energy < 0.5 * plain.energy
    assert saving.energy <= 1.7 * saving.energy_lower_bound
    assert "messages" in plain.notes[0]


def test_slack_saves_energy() -> None:
    """With 5 % more time, the energy is far lower."""
    instance = paper(1, 1000)
    settings = {"objective": "makespan-energy", "iterations": 20_000, "time_limit_s": None}
    strict = solve(instance, "auction", **settings)
    loose = solve(instance, "auction", makespan_slack=0.05, **settings)
    assert loose.makespan <= 1.05 * 1.02
    assert loose.energy < 0.95 * strict.energy


def test_parameters_are_set_by_keyword() -> None:
    """Parameters are set by keyword; wrong ones are named."""
    assert Auction(deadlines=2).parameters == AuctionParameters(deadlines=2)
    with pytest.raises(InputError) as caught:
        Auction(increment=0)
    assert caught.value.place == "increment"
