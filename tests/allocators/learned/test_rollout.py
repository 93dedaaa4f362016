"""Rollouts: incremental scores equal full ones, and the best position on the way is what comes back."""

import numpy as np
import pytest
import torch

from alloc.allocators.learned.curriculum import reference_board
from alloc.allocators.learned.network import ActorCritic
from alloc.allocators.learned.rollout import _Game, play, repeat
from alloc.problems import Allocation, Instance, evaluate
from alloc.problems.game import Board, State, begin
from alloc.problems.generate import paper_like, random_instance
from alloc.problems.generate_family import Family

RANGED = Family(agents=30, tasks=7, starts="own", communication_range=(0.3, 0.6), battery=None)


@pytest.fixture(params=["paper", "ranged"])
def instance(request: pytest.FixtureRequest) -> Instance:
    return paper_like(40, 8, 160, seed=3) if request.param == "paper" else random_instance(RANGED, 5)


def board_of(instance: Instance, prices: list[float]) -> Board:
    return repeat(reference_board([instance], [1.0], np.random.default_rng(0)), torch.tensor(prices))


@pytest.fixture
def network() -> ActorCritic:
    torch.manual_seed(1)
    return ActorCritic().eval().requires_grad_(False)


@pytest.mark.parametrize("haste", [0.0, 0.5])
def test_incremental_scores_equal_full_ones(instance: Instance, network: ActorCritic, haste: float) -> None:
    """After dozens of random moves every logit is what scoring all pairs anew gives, but for places left before."""
    board = board_of(instance, [0.2, 0.7, 1.5])
    generator = torch.Generator().manual_seed(0)
    state = begin(board)
    game = _Game(network, board, state, lambda: False)
    left = torch.zeros(board.shape, dtype=torch.bool)
    for _ in range(25):
        logits, full = game.logits(state), network(board, state)[0]
        barred = full < -1e8
        barred[:, :-1] |= left.flatten(1)
        live = ~state.done
        torch.testing.assert_close(logits[live][~barred[live]], full[live][~barred[live]], atol=1e-4, rtol=1e-4)
        assert (logits[live][barred[live]] < -1e8).all()
        after = game.move(state, logits + 4 * torch.randn(logits.shape, generator=generator), haste)
        left.scatter_(
            2, state.task[..., None], left.gather(2, state.task[..., None]) | (after.task != state.task)[..., None]
        )
        state = after


def test_the_best_position_comes_back(instance: Instance, network: ActorCritic) -> None:
    """What `play` says of its best position is what the evaluator says, and never worse than the start."""
    board = board_of(instance, [0.5] * 4)
    best = play(network, board, steps=30, temperature=1.0, generator=torch.Generator().manual_seed(2))
    reference = instance.workload.max() / (board.target[0, : instance.m].max().item() * instance.ability.mean())
    start = play(network, board, steps=0)
    for game in range(4):
        task = best.task[game].numpy()
        score = evaluate(instance, Allocation(np.where(task == instance.m, -1, task)))
        assert score.violations == ()
        assert len(score.unserved_tasks) == int(best.unserved[game])
        assert score.served_makespan == pytest.approx(best.time[game].item() * reference, rel=1e-4)
        now, before = ((int(b.unserved[game]), b.time[game].item()) for b in (best, start))
        assert now <= before


def test_disjoint_moves_share_no_task(instance: Instance, network: ActorCritic) -> None:
    """With several moves a step, no task but the place of the idle changes twice."""
    board = board_of(instance, [0.5])
    state = begin(board)
    game = _Game(network, board, state, lambda: False)
    after: State = game.move(state, game.logits(state), 1.0)
    moved = torch.nonzero(after.task[0] != state.task[0])[:, 0]
    touched = [t for i in moved.tolist() for t in (int(state.task[0, i]), int(after.task[0, i])) if t != instance.m]
    assert len(moved) > 1
    assert len(touched) == len(set(touched))


def test_relabelling_agents_and_tasks_relabels_the_bids(network: ActorCritic) -> None:
    """The network knows no order of agents or tasks."""
    instance = paper_like(12, 4, 50, seed=0)
    agents, tasks = np.random.default_rng(1).permutation(12), np.random.default_rng(2).permutation(4)
    place = np.argsort(tasks)
    other = Instance(
        ability=instance.ability[agents],
        workload=instance.workload[tasks],
        task_position=instance.task_position[tasks],
        start_task=place[instance.start_task[agents]],
    )
    boards = [board_of(each, [0.5]) for each in (instance, other)]
    one, two = (network(board, begin(board))[0][0, :-1].reshape(12, 5) for board in boards)
    torch.testing.assert_close(one[agents][:, [*tasks, 4]], two, atol=1e-4, rtol=1e-4)
