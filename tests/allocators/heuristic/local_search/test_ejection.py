"""Ejection chains, and covers of a task by idle agents with ability to spare."""

import numpy as np
import pytest
from oracle import least_energy_within

from alloc.allocators.heuristic.local_search.annealing import LENGTH, eject, undo
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState
from alloc.allocators.heuristic.local_search.moves import move
from alloc.allocators.heuristic.local_search.plan import N_LOGGED, N_SHORT, POOL_BY_SUMS
from alloc.problems import Allocation, Instance

LINE = np.array([[0.0, 0], [1, 0], [2, 0]])


@pytest.fixture
def ring() -> Instance:
    """Three agents, each on a task 1 away; each may also do the next one, where it starts, at no cost."""
    return Instance(
        ability=np.ones(3),
        workload=np.ones(3),
        task_position=LINE,
        agent_position=LINE[[1, 2, 0]],
        allowed_tasks=[[0, 1], [1, 2], [2, 0]],
    )


def state_of(instance: Instance, plan: list[int]) -> AnnealingState:
    state = AnnealingState(instance, 0, 3)
    state.begin(Allocation(np.array(plan)), 1.0)
    return state


def test_ejection_chain_solves_a_ring(ring: Instance) -> None:
    """No two tasks share two agents, so that no exchange helps; one ejection chain moves all three agents."""
    state = state_of(ring, [0, 1, 2])
    weights = state.weights(1.0, 0.0, 100.0, 100.0)
    for _ in range(10):  # helpers are drawn
        eject(state.arrays, state.plan, state.workspace, weights, state.candidates, 1.0, 0, 1)
    assert state.allocation == Allocation(np.array([1, 2, 0]))
    assert state.cost == pytest.approx(0.0, abs=1e-12)
    assert state.n_short == 0


def test_ejection_chain_without_gain_is_undone(ring: Instance) -> None:
    """From the best plan, every chain is undone: agents, abilities, cost and shortfalls are restored."""
    state = state_of(ring, [1, 2, 0])
    before = [array.copy() for array in (state.plan.group_of_agent, state.plan.group_ability, state.plan.cost)]
    weights = state.weights(1.0, 0.0, 100.0, 100.0)
    for agent, task in ((0, 0), (1, 1), (2, 2)) * 5:
        eject(state.arrays, state.plan, state.workspace, weights, state.candidates, 1.0, agent, task)
        after = (state.plan.group_of_agent, state.plan.group_ability, state.plan.cost)
        assert all(np.array_equal(one, other) for one, other in zip(before, after, strict=True))
        assert state.plan.counter[N_SHORT] == 0


def test_longest_ejection_chain_can_be_undone() -> None:
    """Every exchange of a chain may move its whole pool: undoing it restores all groups."""
    longest = 1 + (2 * LENGTH + 1) * POOL_BY_SUMS
    instance = Instance(
        ability=np.ones(300), workload=np.ones(3), task_position=LINE, agent_position=np.zeros((300, 2))
    )
    state = state_of(instance, [0] * 300)
    before, random = state.plan.group_of_agent.copy(), np.random.default_rng(0)
    for _ in range(3):
        since = int(state.plan.counter[N_LOGGED])
        for agent in random.integers(0, 300, longest).tolist():
            target = int(random.integers(0, 4))
            if state.plan.size[target] < np.diff(state.plan.begin)[target]:
                move(state.plan, agent, target)
        undo(state.plan, state.workspace, since, 0, 0.0)
        assert np.array_equal(state.plan.group_of_agent, before)


def test_one_strong_agent_may_be_cheaper_than_many() -> None:
    """A small task gets a nearby strong agent with ability to spare instead of distant weak ones."""
    far = np.full((7, 2), 9.0)
    instance = Instance(
        ability=[10, *np.ones(7)], workload=[3], task_position=[[0, 0]], agent_position=[[0.1, 0], *far.tolist()]
    )
    state = state_of(instance, [-1, 0, 0, 0, -1, -1, -1, -1])
    state.run(20, state.weights(1.0, 0.0, 100.0, 100.0))
    assert state.best == Allocation(np.array([0, *[-1] * 7]))


@pytest.mark.parametrize("seed", range(3))
def test_annealing_with_short_lists_finds_the_optimum(seed: int) -> None:
    """If each agent may do two of four tasks, the energy equals brute force, and the state stays consistent."""
    rng = np.random.default_rng(seed)
    instance = Instance(
        ability=rng.integers(1, 9, 9),
        workload=rng.integers(4, 9, 4),
        task_position=rng.random((4, 2)),
        agent_position=rng.random((9, 2)),
        allowed_tasks=[[i % 4, (i + 1 + i // 4) % 4] for i in range(9)],
    )
    state = state_of(instance, [i % 4 for i in range(9)])
    state.begin(Allocation(np.arange(9) % 4), 2.0)
    for noise in np.geomspace(0.1, 1e-4, 30).tolist():
        state.run(300, state.weights(1.0, noise, 1.0, 1.0))
    assert state.best_cost == pytest.approx(least_energy_within(instance, 2.0))
    ability, cost = state.plan.group_ability[:-1].copy(), state.cost
    state.recompute()
    assert state.plan.group_ability[:-1] == pytest.approx(ability)
    assert state.cost == pytest.approx(cost)
