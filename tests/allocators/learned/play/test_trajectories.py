"""Trajectories: advantages match their definition, and games are recorded as played."""

from math import prod

import numpy as np
import pytest
import torch
from boards import layout, plan_of

from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.play.action_sampling import log_probabilities
from alloc.allocators.learned.play.trajectories import Trajectories, advantages, collect
from alloc.problems import evaluate
from alloc.problems.game import PAPER, PLANNING, Board, Rules, State, TurnRule, apply_moves, reset, step, utility
from alloc.problems.generate import paper_like

ALL_RULES = {
    "planning": PLANNING,
    "one move": Rules(most_moves=1),
    "at once": Rules(turn=TurnRule.SIMULTANEOUS),
    "paper": PAPER,
}
GAMES = 6


@pytest.fixture
def board() -> Board:
    return layout(*(paper_like(8, 3, 36, seed) for seed in range(GAMES)))


@pytest.fixture
def network() -> ActorCritic:
    torch.manual_seed(0)
    return ActorCritic(NetworkSize(8, 8, 2))


def play(network: ActorCritic, board: Board, steps: int, rules: Rules = PLANNING, seed: int = 0) -> Trajectories:
    return collect(network, board, steps, torch.Generator().manual_seed(seed), rules, reward_scale=5.0)


def next_state(played: Trajectories, rules: Rules) -> State:
    """Play the recorded actions again; return the last state."""
    state = reset(played.board)
    for actions in played.actions:
        if rules.turn == TurnRule.SIMULTANEOUS:
            slot = torch.where(actions < 0, state.slot, actions % played.board.shape[2])
        else:
            slot = apply_moves(played.board, state, actions)
        state = step(played.board, state, slot)
    return state


def by_definition(
    reward: list[float], value: list[float], last: float, discount: float, gae_lambda: float, cut: list[float]
) -> list[float]:
    """The double sum of (9) over the errors (10), as the paper writes it, with V-trace's cuts of the traces."""
    following = [*value[1:], last]
    error = [r + discount * later - now for r, now, later in zip(reward, value, following, strict=True)]
    steps = len(error)
    return [
        sum((discount * gae_lambda) ** (k - t) * prod(cut[t + 1 : k + 1]) * error[k] for k in range(t, steps))
        for t in range(steps)
    ]


def test_advantages_match_hand_calculation() -> None:
    """gamma = 0.5, lambda = 0.5: errors 1 + 2 - 2 = 1, 2 + 4 - 4 = 2 and 0 + 8 - 8 = 0, backwards 0, 2, 1 + 2 / 4."""
    reward, value = torch.tensor([[1.0], [2.0], [0.0]]), torch.tensor([[2.0], [4.0], [8.0]])
    got = advantages(reward, value, torch.ones(3, 1, dtype=torch.bool), torch.tensor([16.0]), 0.5, 0.5)
    assert got[:, 0].tolist() == [1.5, 2.0, 0.0]


@pytest.mark.parametrize("gae_lambda", [0.0, 0.8, 1.0])
def test_advantages_match_the_definition(gae_lambda: float) -> None:
    """Batched games of all lengths: some that end, and one that is truncated and bootstrapped."""
    generator = torch.Generator().manual_seed(0)
    steps = 6
    reward, value = torch.randn(2, steps, steps, generator=generator).unbind()
    last, importance_ratio = torch.randn(steps, generator=generator), 2 * torch.rand(steps, steps, generator=generator)
    alive = torch.arange(steps)[:, None] <= torch.arange(steps)  # game b lasts b + 1 steps
    last[:-1] = 0.0
    for given in (None, importance_ratio):
        got = advantages(reward, value, alive, last, 0.9, gae_lambda, given)
        for game in range(steps):
            length = game + 1
            cut = [1.0] * length if given is None else given[:length, game].clamp(max=1.0).tolist()
            rewards, values = reward[:length, game].tolist(), value[:length, game].tolist()
            expected = by_definition(rewards, values, last[game].item(), 0.9, gae_lambda, cut)
            assert got[:length, game].tolist() == pytest.approx(expected, abs=1e-5)
            assert (got[length:, game] == 0).all()


def test_no_return_beyond_the_end_of_a_game() -> None:
    """The step that ends a game is not affected by later rewards or values."""
    reward = torch.tensor([[1.0], [2.0], [99.0]])
    value = torch.tensor([[0.5], [0.25], [77.0]])
    alive = torch.tensor([[True], [True], [False]])
    got = advantages(reward, value, alive, torch.tensor([0.0]), 1.0, 1.0)
    assert got[:, 0].tolist() == pytest.approx([1 + 2 - 0.5, 2 - 0.25, 0.0])


def test_traces_are_truncated_as_in_v_trace() -> None:
    """Value plus advantage is V-trace's target v_s (Espeholt et al. 2018, (1)), with rho and c truncated at 1."""
    generator = torch.Generator().manual_seed(1)
    reward, value = torch.randn(2, 5, 1, generator=generator).unbind()
    importance_ratio = torch.tensor([0.5, 3.0, 0.2, 1.0, 0.7])[:, None]
    got = advantages(reward, value, torch.ones(5, 1, dtype=torch.bool), torch.tensor([0.3]), 0.9, 1.0, importance_ratio)
    target = value + importance_ratio.clamp(max=1.0) * got
    following = torch.cat([value[1:], torch.tensor([[0.3]])])
    cut = importance_ratio.clamp(max=1.0)
    error = cut * (reward + 0.9 * following - value)
    for s in range(5):
        v = value[s] + sum(0.9 ** (t - s) * cut[s:t].prod() * error[t] for t in range(s, 5))
        assert target[s].item() == pytest.approx(v.item(), abs=1e-5)


@pytest.mark.parametrize("rules", ALL_RULES.values(), ids=list(ALL_RULES))
def test_rewards_sum_to_the_increase_of_utility(board: Board, network: ActorCritic, rules: Rules) -> None:
    """The recorded actions increase the utility by the sum of the rewards."""
    played = play(network, board, 5, rules)
    rise = utility(board, next_state(played, rules), rules) - utility(board, reset(board), rules)
    torch.testing.assert_close(played.reward.sum(0), 5 * rise, atol=1e-4, rtol=1e-4)


def test_increase_of_utility_matches_the_evaluator(network: ActorCritic) -> None:
    """With energy alone, the reward of a game is the distance saved, as measured by the evaluator."""
    instance = paper_like(8, 3, 36, 0)
    board = layout(instance, hours=1e6, energy_weight=2.0)  # needs of next to nothing: all but energy is met
    played = play(network, board, 4)
    first, last = (evaluate(instance, plan_of(board, state)) for state in (reset(board), next_state(played, PLANNING)))
    saved = (first.distance - last.distance) * board.scale.item() / 8
    served = len(first.unserved_tasks) == len(last.unserved_tasks) == 0
    assert served
    assert played.reward.sum().item() == pytest.approx(5 * 2.0 * saved, abs=1e-4)


@pytest.mark.parametrize("rules", ALL_RULES.values(), ids=list(ALL_RULES))
def test_values_and_probabilities_match_the_network(board: Board, network: ActorCritic, rules: Rules) -> None:
    """Evaluated again on the recorded states, the network gives the recorded outputs."""
    played = play(network, board, 5, rules)
    for t, actions in enumerate(played.actions):
        state = played.state[torch.tensor(t)]
        with torch.no_grad():
            scores = network(board, state)
        again, _ = log_probabilities(board, state, scores, actions, rules)
        torch.testing.assert_close(again, played.log_probability[t])
        torch.testing.assert_close(scores.value * played.alive[t], played.value[t])


def test_truncated_game_is_bootstrapped(board: Board, network: ActorCritic) -> None:
    """After one step the network's value stands for the rest, except in games that have ended."""
    with torch.no_grad():
        network.reserve[-1].bias.fill_(3.0)  # as likely as some 20 bids: about every other game stops at once
    played = play(network, board, 1, seed=3)
    state = next_state(played, PLANNING)
    assert 0 < int(state.done.sum()) < GAMES
    with torch.no_grad():
        value = network(board, state).value
    torch.testing.assert_close(played.last_value, torch.where(state.done, 0.0, value))


def test_ended_games_are_not_counted(board: Board, network: ActorCritic) -> None:
    """Decisions and evaluations count only running games, and ended games do not change."""
    played = play(network, board, 50)
    assert bool(next_state(played, PLANNING).done.all())
    assert not bool(played.alive.all())
    assert len(played.reward) < 50, "no steps are taken when all games have ended"
    over = ~played.alive
    assert (played.actions[over] == -1).all()
    assert (played.reward[over] == 0).all()
    assert (played.value[over] == 0).all()
    assert (played.log_probability[over] == 0).all()
    assert played.evaluations == sum(not done for row in played.state.done.tolist() for done in row)
    assert played.decisions == sum(action >= 0 for action in played.actions.flatten().tolist())


def test_play_continues_from_a_state(board: Board, network: ActorCritic) -> None:
    """Two segments with one generator equal one long game."""
    one, generator = play(network, board, 4), torch.Generator().manual_seed(0)
    first = collect(network, board, 2, generator, reward_scale=5.0)
    second = collect(network, board, 2, generator, reward_scale=5.0, state=next_state(first, PLANNING))
    assert torch.equal(torch.cat([first.state.slot, second.state.slot]), one.state.slot)
    torch.testing.assert_close(torch.cat([first.reward, second.reward]), one.reward)
    torch.testing.assert_close(torch.cat([first.value, second.value]), one.value)


def test_same_generator_plays_the_same_games(board: Board, network: ActorCritic) -> None:
    """Games depend on the given generator and not on torch's global one."""
    one, other = play(network, board, 4), play(network, board, 4, seed=1)
    torch.manual_seed(999)
    again = play(network, board, 4)
    assert torch.equal(one.actions, again.actions)
    assert not np.array_equal(one.state.slot[-1].numpy(), other.state.slot[-1].numpy())
