"""The network of all methods: it is invariant to the order of agents and tasks, and takes any number of them."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from boards import EXTREMES, layout

from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.problems import Instance
from alloc.problems.game import reset, step
from alloc.problems.generate import paper_like

SIZES = {"attention": NetworkSize(16, 16, 4), "none": NetworkSize(16, 16, 4, attention=False)}


@pytest.fixture(params=list(SIZES))
def network(request: pytest.FixtureRequest) -> ActorCritic:
    torch.manual_seed(1)
    return ActorCritic(SIZES[request.param]).requires_grad_(False)


def test_network_is_permutation_equivariant(network: ActorCritic) -> None:
    """Permuting agents and tasks permutes the bids, and changes neither reserve nor value."""
    instance = paper_like(12, 4, 50, seed=0)
    agents, tasks = np.random.default_rng(1).permutation(12), np.random.default_rng(2).permutation(4)
    other = Instance(
        ability=instance.ability[agents],
        workload=instance.workload[tasks],
        task_position=instance.task_position[tasks],
        start_task=np.argsort(tasks)[instance.start_task[agents]],
        battery=instance.battery[agents],
        energy_per_distance=instance.energy_per_distance,
    )
    one, two = (network(board, reset(board)) for board in (layout(instance), layout(other)))
    torch.testing.assert_close(one.bids[0, agents][:, [*tasks, 4]], two.bids[0], atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(one.reserve, two.reserve, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(one.value, two.value, atol=1e-4, rtol=1e-4)


def test_batched_games_are_scored_as_single_ones(network: ActorCritic) -> None:
    """The outputs for a game do not depend on the other games of the batch."""
    board = layout(*(paper_like(8, 3, 34, seed) for seed in range(5)))
    together = network(board, reset(board))
    for game in range(5):
        alone = board[torch.tensor([game])]
        for one, two in zip(network(alone, reset(alone)), together, strict=True):
            torch.testing.assert_close(one[0], two[game], atol=1e-5, rtol=1e-5)


def test_sparse_candidates_are_scored_as_on_the_dense_board(network: ActorCritic) -> None:
    """Scores do not depend on whether candidates are all tasks or some in any order."""
    instance = paper_like(20, 9, 90, seed=4)
    dense, near = layout(instance), layout(instance, near=5)
    scale = (dense.scale / near.scale).float()  # the two boards measure distances by their own means
    near = replace(
        near,
        distance=near.distance * scale,
        task_distance=dense.task_distance,
        reachable_share=dense.reachable_share,
        supply_ratio=dense.supply_ratio,
    )
    all_, some = (network(board, reset(board)).bids for board in (dense, near))
    torch.testing.assert_close(all_.gather(2, near.candidates)[near.legal], some[near.legal], atol=1e-4, rtol=1e-4)


def test_agents_without_ability_do_not_affect_encodings() -> None:
    """Padding agents of a region do not change the encodings of places."""
    torch.manual_seed(2)
    network = ActorCritic(SIZES["attention"]).requires_grad_(False)
    board = layout(paper_like(8, 3, 34, 0))

    def filled(name: str) -> torch.Tensor:
        values = getattr(board, name)
        return torch.cat([values, values[:, :1]], 1)

    per_agent = ("ability", "candidates", "legal", "distance", "contribution", "start", "reachable_share", "endurance")
    more = replace(board, **{name: filled(name) for name in per_agent})
    for nothing in (more.ability, more.contribution):
        nothing[:, -1] = 0.0
    one, two = (network._members(some, reset(some)) for some in (board, more))
    torch.testing.assert_close(one, two, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("name", list(EXTREMES))
def test_extremes_stay_finite(network: ActorCritic, name: str) -> None:
    """Scores and gradients are finite on extreme valid instances."""
    board = layout(EXTREMES[name])
    state = reset(board)
    for slot in (state.slot, torch.full_like(state.slot, board.shape[2] - 1)):
        assert all(scores.isfinite().all() for scores in network(board, step(board, state, slot)))
    network.requires_grad_(True)
    sum(scores.sum() for scores in network(board, state)).backward()
    assert all(weight.grad is None or weight.grad.isfinite().all() for weight in network.parameters())


def test_attention_depends_on_group_members_and_neighbours() -> None:
    """Swapping two equal agents changes the encodings of all places, but not without attention."""
    instance = Instance(
        ability=[1, 1, 1], workload=[1, 1, 1], task_position=[[0, 0], [1, 0], [2, 0]], start_task=[0, 1, 2]
    )
    board = layout(instance)
    before = reset(board)
    after = step(board, before, torch.tensor([[1, 0, 2]]))
    for size in SIZES.values():
        torch.manual_seed(0)
        network = ActorCritic(size).requires_grad_(False)
        change = (network.places(board, after) - network.places(board, before)).abs().amax(2)[0]
        assert ((change > 1e-4) == size.attention).all()
