"""Sampling of actions: probabilities match plain Python, and frequencies match probabilities."""

from collections import Counter
from dataclasses import replace
from itertools import product
from math import exp, log

import pytest
import torch
from boards import layout
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import instances

from alloc.allocators.learned.network.actor_critic import Scores
from alloc.allocators.learned.play.action_sampling import log_probabilities, sample_actions
from alloc.problems import Instance
from alloc.problems.game import (
    PAPER,
    PLANNING,
    Board,
    Rules,
    State,
    TurnRule,
    action_mask,
    apply_moves,
    current_tasks,
    reset,
    step,
)

ONE_MOVE = Rules(most_moves=1)
AT_ONCE = Rules(turn=TurnRule.SIMULTANEOUS)
Chances = dict[tuple[int, ...], float]


@pytest.fixture
def board() -> Board:
    """Four agents and three tasks; one agent has two of the tasks in reach, one begins idle."""
    instance = Instance(
        ability=[1, 2, 3, 2],
        workload=[3, 2, 3],
        task_position=[[0, 0], [1, 0], [2, 0]],
        agent_position=[[0, 0], [0.9, 0], [0.2, 0], [2, 0]],
        communication_range=[1.0, 5, 5, 5],
    )
    laid = layout(instance)
    return replace(laid, start=torch.tensor([[0, 1, 0, 3]]))


def scores_of(board: Board, seed: int = 0, spread: float = 1.0) -> Scores:
    """Scores without a network: what is drawn does not depend on where they come from."""
    generator = torch.Generator().manual_seed(seed)
    reserve = spread * torch.randn(len(board.energy_weight), generator=generator)
    return Scores(
        spread * torch.randn(board.shape, generator=generator), reserve, torch.zeros(len(board.energy_weight))
    )


def rounds(board: Board, state: State, scores: Scores, most: int | None) -> Chances:
    """Probability of every possible round of one game: a product of softmaxes over what may still be granted."""
    _, n, c = board.shape
    goal, task, idle = board.candidates[0].tolist(), current_tasks(board, state)[0].tolist(), board.places - 1
    bids, reserve = scores.bids[0].tolist(), float(scores.reserve[0])
    may = action_mask(board, state)[0]
    found: Chances = {}

    def go_on(chance: float, granted: tuple[int, ...], used: set[int], gone: set[int]) -> None:
        if len(granted) == most:
            found[granted] = chance
            return
        weight = {n * c: exp(reserve)}
        for agent, slot in product(range(n), range(c)):
            if may[agent, slot] and agent not in gone and not {task[agent], goal[agent][slot]} & used:
                weight[agent * c + slot] = exp(bids[agent][slot])
        for action, share in weight.items():
            likely = chance * share / sum(weight.values())
            if action == n * c:
                found[(*granted, action)] = likely
            else:
                agent, slot = divmod(action, c)
                ends = {task[agent], goal[agent][slot]} - {idle}
                go_on(likely, (*granted, action), used | ends, gone | {agent})

    go_on(1.0, (), set(), set())
    return found


def choices(board: Board, state: State, scores: Scores) -> Chances:
    """Probability of everything that agents who choose at once may do: each draws from a softmax, staying scores 0."""
    _, n, c = board.shape
    may, bids = action_mask(board, state)[0], scores.bids[0].tolist()
    stays = state.slot[0].tolist()
    shares = []
    for agent in range(n):
        weight = {s: exp(bids[agent][s]) for s in range(c) if may[agent, s]} | {stays[agent]: 1.0}
        shares.append({agent * c + slot: value / sum(weight.values()) for slot, value in weight.items()})
    found: Chances = {}
    for some in product(*(share.items() for share in shares)):
        chance = 1.0
        for _, share in some:
            chance *= share
        found[tuple(action for action, _ in some)] = chance
    return found


def chances(board: Board, state: State, scores: Scores, rules: Rules) -> Chances:
    if rules.turn == TurnRule.SIMULTANEOUS:
        return choices(board, state, scores)
    return rounds(board, state, scores, rules.most_moves)


every_turn = pytest.mark.parametrize("rules", [PLANNING, ONE_MOVE, AT_ONCE], ids=["rounds", "one move", "at once"])


@every_turn
def test_probabilities_match_plain_python(board: Board, rules: Rules) -> None:
    """Each possible round has the product of softmaxes as its probability, and these sum to 1."""
    state, scores = reset(board), scores_of(board)
    expected = chances(board, state, scores, rules)
    assert sum(expected.values()) == pytest.approx(1)
    width = max(map(len, expected))
    actions = torch.tensor([[*one, *[-1] * (width - len(one))] for one in expected])
    many = board[torch.zeros(len(actions), dtype=torch.int64)]
    wide = Scores(*(one.expand(len(actions), *one.shape[1:]) for one in scores))
    got, _ = log_probabilities(many, reset(many), wide, actions, rules)
    assert got.sum(1).tolist() == pytest.approx([log(chance) for chance in expected.values()], abs=1e-4)
    assert float(got.sum(1).exp().sum()) == pytest.approx(1, abs=1e-5)
    assert (got[actions < 0] == 0).all()


@every_turn
def test_sample_frequencies_match_probabilities(board: Board, rules: Rules) -> None:
    """Chi-square of 20,000 samples with a fixed seed is within four standard deviations of its mean."""
    draws = 20_000
    state, scores = reset(board), scores_of(board, 3)
    expected = chances(board, state, scores, rules)
    many = board[torch.zeros(draws, dtype=torch.int64)]
    wide = Scores(*(one.expand(draws, *one.shape[1:]) for one in scores))
    actions, _ = sample_actions(many, reset(many), wide, rules, 1.0, torch.Generator().manual_seed(7))
    seen = Counter(tuple(action for action in row if action >= 0) for row in actions.tolist())
    assert set(seen) <= set(expected)
    usual = {one for one, chance in expected.items() if chance * draws >= 10}
    rare = draws * sum(chance for one, chance in expected.items() if one not in usual)
    cells = [(seen[one], draws * expected[one]) for one in usual]
    cells.append((sum(count for one, count in seen.items() if one not in usual), rare + 1e-9))
    chi_square, freedom = sum((a - b) ** 2 / b for a, b in cells), len(cells) - 1
    assert len(usual) > 5
    assert abs(chi_square - freedom) < 4 * (2 * freedom) ** 0.5


@pytest.mark.parametrize("temperature", [0.5, 2.0])
def test_temperature_divides_the_scores(board: Board, temperature: float) -> None:
    """Sampling at a temperature equals sampling at 1 with scores divided by it."""
    state, scores = reset(board), scores_of(board)
    other = Scores(scores.bids / temperature, scores.reserve / temperature, scores.value)
    for rules in (PLANNING, AT_ONCE):
        one, two = (
            sample_actions(board, state, some, rules, degrees, torch.Generator().manual_seed(1))[0]
            for some, degrees in ((scores, temperature), (other, 1.0))
        )
        assert torch.equal(one, two)


@pytest.mark.parametrize("seed", range(5))
def test_zero_temperature_takes_the_best_action(board: Board, seed: int) -> None:
    """At temperature 0 bids are granted in decreasing order; with simultaneous choices each agent takes its best."""
    state, scores = reset(board), scores_of(board, seed)
    _, n, c = board.shape
    expected: list[int] = []
    left = rounds(board, state, scores, None)
    everything = [*scores.bids.flatten().tolist(), float(scores.reserve)]
    while not expected or expected[-1] != n * c:
        able = {one[len(expected)] for one in left if list(one[: len(expected)]) == expected}
        expected.append(max(able, key=everything.__getitem__))
    actions, slot = sample_actions(board, state, scores)
    assert actions[0].tolist() == expected
    assert torch.equal(slot, apply_moves(board, state, actions))
    actions, slot = sample_actions(board, state, scores, AT_ONCE)
    assert tuple(actions[0].tolist()) == max(choices(board, state, scores).items(), key=lambda item: item[1])[0]
    assert torch.equal(slot[0], actions[0] % c)


@settings(max_examples=40)
@given(
    instance=instances(),
    seed=st.integers(0, 99),
    rules=st.sampled_from([PLANNING, ONE_MOVE, AT_ONCE, PAPER, Rules(flying=True)]),
    spread=st.sampled_from([1.0, 300.0]),
)
def test_sampled_actions_have_finite_log_probabilities(
    instance: Instance, seed: int, rules: Rules, spread: float
) -> None:
    """Every sampled action of running and ended games has a finite log-probability of at most 0."""
    board = layout(instance, instance, instance)
    state, generator = reset(board), torch.Generator().manual_seed(seed)
    state.done[1] = True
    for number in range(4):
        scores = scores_of(board, seed + number, spread)
        actions, slot = sample_actions(board, state, scores, rules, 1.0, generator)
        got, entropy = log_probabilities(board, state, scores, actions, rules)
        assert got.isfinite().all()
        assert (got <= 1e-4).all()
        assert entropy.isfinite().all()
        assert (entropy >= -1e-5 * spread).all()
        assert (actions[1] == -1).all()
        state = step(board, state, slot)


def test_entropy_matches_plain_python(board: Board) -> None:
    """Entropy is that of the first grant of a round, or the mean over agents with simultaneous choices."""
    state, scores = reset(board), scores_of(board)
    first = rounds(board, state, scores, 1).values()
    actions, _ = sample_actions(board, state, scores)
    _, entropy = log_probabilities(board, state, scores, actions)
    assert entropy.item() == pytest.approx(-sum(p * log(p) for p in first), abs=1e-5)
    everything = choices(board, state, scores).values()
    _, entropy = log_probabilities(board, state, scores, actions=torch.zeros(1, 4, dtype=torch.long), rules=AT_ONCE)
    assert 4 * entropy.item() == pytest.approx(-sum(p * log(p) for p in everything), abs=1e-5)


def test_log_probabilities_have_gradients(board: Board) -> None:
    """Raising the score of a granted bid raises its probability; masked bids have no gradient."""
    scores = scores_of(board)
    bids, reserve = scores.bids.clone().requires_grad_(), scores.reserve.clone().requires_grad_()
    actions, _ = sample_actions(board, reset(board), scores, PLANNING, 1.0, torch.Generator().manual_seed(0))
    got, entropy = log_probabilities(board, reset(board), Scores(bids, reserve, scores.value), actions)
    (got.sum() + entropy.sum()).backward()
    assert bids.grad is not None
    assert bids.grad.isfinite().all()
    assert (bids.grad[~action_mask(board, reset(board))] == 0).all()
    (slope,) = torch.autograd.grad(
        log_probabilities(board, reset(board), Scores(bids, reserve, scores.value), actions)[0][0, 0], bids
    )
    assert slope.flatten()[actions[0, 0]] > 0
