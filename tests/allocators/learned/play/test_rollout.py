"""Rollouts: incremental scores equal full ones, and the best position of a game is returned."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch
from boards import layout, plan_of

from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.play import rollout
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.allocators.learned.play.rollout import Best, LocalScores, play, position, step_and_score
from alloc.problems import Evaluation, Family, Instance, evaluate, paper_like, random_instance
from alloc.problems.game import (
    Board,
    Rules,
    State,
    TurnRule,
    action_mask,
    observe_pairs,
    reset,
    step,
)

RANGED = Family(agents=30, tasks=7, starts="own", communication_range=(0.3, 0.6), battery=None)
SWIFT = Family(agents=24, tasks=5, starts="own", speed=(0.2, 2.0))


def dense() -> Board:
    return layout(*(paper_like(30, 6, 130, seed) for seed in range(4)))


def near() -> Board:
    return layout(*(paper_like(30, 12, 130, seed) for seed in range(4)), near=5)


def ranged() -> Board:
    """Some agents reach little or nothing, and begin idle."""
    return layout(*(random_instance(RANGED, seed) for seed in range(4)))


def delayed() -> Board:
    return layout(*(random_instance(SWIFT, seed) for seed in range(4)), hours=2.0)


def from_idle() -> Board:
    board = dense()
    return replace(board, start=torch.full_like(board.start, 6))


BOARDS: dict[str, Callable[[], Board]] = {one.__name__: one for one in (dense, near, ranged, delayed, from_idle)}


@pytest.fixture(params=list(BOARDS))
def board(request: pytest.FixtureRequest) -> Board:
    return BOARDS[request.param]()


@pytest.fixture
def network() -> ActorCritic:
    """A network that knows nothing, and does not stop early."""
    torch.manual_seed(1)
    network = ActorCritic(NetworkSize(16, 16, 4)).requires_grad_(False)
    network.reserve[-1].bias.fill_(-1.0)
    return network


def assert_scored_anew(network: ActorCritic, scores: LocalScores, board: Board, state: State) -> None:
    """Every open bid, reserve and value are what scoring everything says."""
    anew, kept = network(board, state), scores.all(state)
    can = action_mask(board, state, Rules(returning=True))
    torch.testing.assert_close(kept.bids[can], anew.bids[can], atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(kept.reserve, anew.reserve, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize(
    ("rules", "anew"), [(Rules(), 0.5), (Rules(most_moves=1), 1.0), (Rules(turn=TurnRule.SIMULTANEOUS), 0.0)]
)
def test_incremental_scores_match_full_scores(
    board: Board, network: ActorCritic, rules: Rules, anew: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After every step of random play all open bids equal those scored anew, while games end and are dropped."""
    monkeypatch.setattr(rollout, "RESCORE_ALL", anew)
    generator, state = torch.Generator().manual_seed(0), reset(board)
    scores = LocalScores(network, board, state, lambda: False)
    for number in range(8):
        assert_scored_anew(network, scores, board, state)
        _, slot = sample_actions(board, state, scores.all(state), rules, 2.0, generator)
        state = step_and_score(board, state, slot, scores)
        if number == 4:
            going = torch.tensor([0, 2])
            board, state = board[going], state[going]
            scores.keep(board, going)
    assert_scored_anew(network, scores, board, state)


def test_scores_do_not_depend_on_chunks(board: Board, network: ActorCritic, monkeypatch: pytest.MonkeyPatch) -> None:
    """Scored in chunks of agents, the first scores are the same, and stop requests are checked in between."""
    state = reset(board)
    monkeypatch.setattr(rollout, "SCORE_CHUNK", 100)
    chunked = LocalScores(network, board, state, lambda: False).local
    torch.testing.assert_close(chunked, network.pairs(observe_pairs(board, state)), atol=1e-5, rtol=1e-5)
    asked: list[int] = []
    LocalScores(network, board, state, lambda: asked.append(1) is None and len(asked) > 2)
    assert len(asked) == 3


def rank(score: Evaluation, hours: float = 1.0) -> tuple[int, float, float]:
    """What positions are compared by, from the scores of the evaluator."""
    return len(score.unserved_tasks), max(0.0, 1 - hours / max(score.served_makespan, 1e-9)), score.distance


def test_best_position_matches_the_evaluator(network: ActorCritic) -> None:
    """`play` returns the best of all positions as scored by `evaluate`."""
    instances = [paper_like(12, 4, 50, seed) for seed in range(5)]
    board = layout(*instances)
    best = play(network, board, steps=20, temperature=1.0, generator=torch.Generator().manual_seed(2))
    generator, state = torch.Generator().manual_seed(2), reset(board)
    met = [[rank(evaluate(one, plan_of(board, state, game)))] for game, one in enumerate(instances)]
    rows = torch.arange(5)  # games are dropped when half of them have ended, which changes what is drawn
    region = board
    for _ in range(20):
        if 2 * int((~state.done).sum()) <= len(rows):
            going = torch.nonzero(~state.done)[:, 0]
            rows, region, state = rows[going], region[going], state[going]
        if not len(rows):
            break
        _, slot = sample_actions(region, state, network(region, state), temperature=1.0, generator=generator)
        state = step(region, state, slot)
        for place, game in enumerate(rows.tolist()):
            met[game].append(rank(evaluate(instances[game], plan_of(region, state, place))))
    for game, one in enumerate(instances):
        state = replace(reset(board), slot=best.slot)
        score = evaluate(one, plan_of(board, state, game))
        assert score.violations == ()
        fewest, shortfall, _ = min((few, round(short, 5), far) for few, short, far in met[game])
        least = min(far for few, short, far in met[game] if (few, round(short, 5)) == (fewest, shortfall))
        assert rank(score) == pytest.approx((fewest, shortfall, least), abs=2e-5)
        mean = score.distance * board.scale[game].item() / one.n
        assert best.distance[game].item() == pytest.approx(mean, rel=1e-4)
        assert (best.unserved[game].item(), best.shortfall[game].item()) == pytest.approx(rank(score)[:2], abs=1e-5)


def test_batched_games_end_as_single_ones(board: Board, network: ActorCritic) -> None:
    """Games of different lengths, dropped as they end, find the same positions as single games."""
    energy_weights = torch.tensor([0.0, 0.5, 2.0, 8.0])
    board = replace(board, energy_weight=energy_weights)
    together = play(network, board, steps=30)
    for game in range(4):
        alone = play(network, board[torch.tensor([game])], steps=30)
        for name in ("unserved", "shortfall", "distance"):
            assert getattr(alone, name).item() == pytest.approx(getattr(together, name)[game].item(), abs=1e-4)


@pytest.mark.parametrize("total", [False, True])
def test_never_worse_than_the_start(board: Board, network: ActorCritic, total: bool) -> None:
    """More steps never lead to a worse best position."""
    bests = [
        play(network, board, steps=steps, temperature=2.0, generator=torch.Generator().manual_seed(0), total=total)
        for steps in (0, 1, 4, 16)
    ]
    for earlier, later in pairwise(bests):
        assert not earlier.better_than(later).any()
    assert bests[-1].better_than(bests[0]).any()


def test_zero_steps_return_the_start(board: Board) -> None:
    """Without a step the initial position is returned."""
    start = play(ActorCritic(NetworkSize(8, 8, 2)), board, steps=0)
    assert torch.equal(start.slot, board.start)
    assert torch.equal(start.distance, position(board, reset(board)).distance)


def test_total_and_maximum_shortfall_match_hand_calculation() -> None:
    """Needs 4 and 2, groups of 3 and 3: the largest relative shortfall is a quarter, the total a sixth."""
    instance = Instance(ability=[3, 3], workload=[4, 2])
    board = replace(layout(instance), start=torch.tensor([[0, 1]]))
    worst, total = (position(board, reset(board), total).shortfall.item() for total in (False, True))
    assert (worst, total) == pytest.approx((1 / 4, 1 / 6))


def test_comparison_of_positions_is_lexicographic() -> None:
    """Fewer unserved, then less shortfall, then less distance; differences within single precision are ties."""

    def best(unserved: int, shortfall: float, distance: float) -> Best:
        return Best(torch.zeros(1, 1), *(torch.tensor([float(value)]) for value in (unserved, shortfall, distance)))

    here = best(1, 0.2, 1.0)
    better = [best(0, 0.9, 9.0), best(1, 0.1, 9.0), best(1, 0.2, 0.9), best(1, 0.200001, 0.9)]
    assert all(bool(one.better_than(here)) and not bool(here.better_than(one)) for one in better)
    same = [best(1, 0.200001, 1.0), best(1, 0.2, 1.000001), here]
    assert not any(bool(one.better_than(here)) or bool(here.better_than(one)) for one in same)


def test_play_stops_on_request(board: Board, network: ActorCritic) -> None:
    """Stopped at once, it returns the initial position; stopped later, it has made the steps before the request."""
    assert torch.equal(play(network, board, steps=30, should_stop=lambda: True).slot, board.start)
    asked: list[int] = []

    def third_time() -> bool:
        asked.append(1)
        return len(asked) > 3

    stopped = play(network, board, steps=30, should_stop=third_time)
    assert len(asked) == 4
    short = play(network, board, steps=3)
    assert np.array_equal(stopped.slot.numpy(), short.slot.numpy())
