"""On a GPU: scores and greedy games match those on the CPU, and plans are reproducible; skipped without a GPU."""

from collections.abc import Iterator

import numpy as np
import pytest
import torch
from boards import layout
from test_rollout import BOARDS

from alloc.allocators import load, solve
from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.play.batched_games import Games, play_games
from alloc.problems import Family, Instance, random_instance
from alloc.problems.game import Board, State, reset, step, sum_by_place
from alloc.problems.generate import paper_like

pytestmark = [
    pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU"),
    pytest.mark.timeout(400),  # compiles at first
]

METHODS = ("gappo", "ppo", "a2c", "dqn", "ddpg", "gappo-ls")
INSTANCES = {
    "paper": paper_like(40, 8, 160, seed=3),
    "ranges": random_instance(
        Family(agents=60, tasks=12, starts="own", communication_range=(0.3, 0.6), battery=None), 11
    ),
    "speeds": random_instance(Family(agents=60, tasks=12, starts="own", speed=(0.5, 2.0), battery=None), 11),
    "one of each": Instance(ability=[3], workload=[2]),
    "nothing to do": Instance(ability=[1, 2], workload=[0, 0]),
    "nobody can go": Instance(ability=[1], workload=[1], allowed_tasks=[[]]),
}


def pair() -> tuple[ActorCritic, ActorCritic]:
    """The same network here and there."""
    torch.manual_seed(3)
    here, there = ActorCritic(), ActorCritic()
    there.load_state_dict(here.state_dict())
    return here.eval().requires_grad_(False), there.eval().requires_grad_(False).to("cuda")


def games_on(board: Board, copies: int = 1) -> Games:
    row = np.arange(len(board.energy_weight)).repeat(copies)
    return Games(row, board.energy_weight.numpy().astype(float)[row], board.start.numpy()[row])


def states(board: Board) -> Iterator[State]:
    """States on the way of agents that go anywhere."""
    state, generator = reset(board), torch.Generator().manual_seed(0)
    for _ in range(4):
        yield state
        drawn = torch.rand(board.shape, generator=generator).masked_fill(~board.legal, -1.0).argmax(2)
        state = step(board, state, drawn)


@pytest.mark.parametrize("name", BOARDS)
def test_scores_match_the_cpu(name: str) -> None:
    """Bids, reserve and value agree within single precision in any state."""
    board, (here, there) = BOARDS[name](), pair()
    for state in states(board):
        away = State(*(part.to("cuda") for part in vars(state).values()))
        for expected, scores in zip(here(board, state), there(board.to("cuda"), away), strict=True):
            torch.testing.assert_close(scores.cpu(), expected, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("total", [True, False])
@pytest.mark.parametrize("name", BOARDS)
def test_greedy_games_match_the_cpu(name: str, total: bool) -> None:
    """Played greedily, every game ends in the same best position."""
    board, (here, there) = BOARDS[name](), pair()
    expected, found = (play_games(one, board, games_on(board), rounds=12, total=total) for one in (here, there))
    assert torch.equal(found.unserved.long(), expected.unserved.long())
    torch.testing.assert_close(found.shortfall, expected.shortfall.float(), atol=2e-5, rtol=1e-4)
    torch.testing.assert_close(found.distance, expected.distance.float(), atol=2e-5, rtol=1e-4)
    assert torch.equal(found.slot, expected.slot)


def test_sampled_games_are_reproducible() -> None:
    """Sampled games are legal, and reproducible bit for bit by seed."""
    board, (_, there) = BOARDS["ranged"](), pair()
    games = games_on(board, 50)
    first, again, other = (play_games(there, board, games, rounds=8, temperature=1.0, seed=seed) for seed in (1, 1, 2))
    for name, value in vars(first).items():
        assert torch.equal(value, getattr(again, name))
    assert not torch.equal(first.slot, other.slot)
    assert board.legal[torch.from_numpy(games.row)].gather(2, first.slot[..., None]).all()


def test_sums_are_reproducible() -> None:
    """Sums over the agents at a place are equal bit for bit for any batch size, and on the CPU."""
    generator = torch.Generator().manual_seed(0)
    values = torch.rand(64, 300, 5, generator=generator)
    place = torch.randint(7, (64, 300), generator=generator)
    there = values.to("cuda"), place.to("cuda")
    sums = [sum_by_place(*there, 7) for _ in range(20)]
    assert all(torch.equal(one, sums[0]) for one in sums)
    torch.testing.assert_close(sums[0].cpu(), sum_by_place(values, place, 7), atol=1e-4, rtol=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_plans_are_valid_and_reproducible(method: str) -> None:
    """With a sweep budget, every method gives the same answer twice, with one thread and with two."""
    policy = load(method, device="cuda")
    for name, instance in INSTANCES.items():
        first, again = (
            solve(instance, policy, objective="makespan-energy", iterations=4, time_limit_s=None, threads=threads)
            for threads in (1, 2)
        )
        assert first.evaluation is not None
        assert first.evaluation.violations == (), name
        assert len(first.evaluation.unserved_tasks) == (name == "nobody can go")
        assert first.allocation == again.allocation, name


def test_time_limit_is_respected() -> None:
    """A run ends in time with an answer, also on large boards."""
    policy = load("gappo", device="cuda")
    for instance in (INSTANCES["paper"], paper_like(500, 50, 2400, seed=1)):
        result = solve(instance, policy, objective="makespan-energy", time_limit_s=0.5)
        assert result.makespan is not None
        assert result.runtime_s <= 0.5 * 1.1 + 0.5


def test_board_of_many_games_matches_single_games() -> None:
    """Thousands of games at once end as single ones."""
    board, (_, there) = layout(*(paper_like(30, 6, 130, seed) for seed in range(4))), pair()
    many = play_games(there, board, games_on(board, 1000), rounds=12)
    alone = play_games(there, board, games_on(board), rounds=12)
    assert torch.equal(many.slot[::1000], alone.slot)
