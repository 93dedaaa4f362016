"""Rewards, compared with hand calculation and brute force."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch
from boards import layout, plan_of, state_of
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import instances
from tiny_instances import tiny_instance

from alloc.problems import Allocation, Instance, evaluate
from alloc.problems.game import (
    PAPER,
    PLANNING,
    Board,
    Reward,
    Rules,
    State,
    action_mask,
    apply_moves,
    coverage,
    difference_rewards,
    grant_bids,
    group_ability,
    marginal_contributions,
    mean_distance,
    potential,
    relative_makespan,
    reset,
    step,
    utility,
)
from alloc.problems.game.reward import LARGEST_EXPONENT

RULES = (
    PLANNING,
    PAPER,
    Rules(reward=Reward.COVERAGE),
    Rules(flying=True, returning=True),
    Rules(most_moves=1),
)


def somewhere(board: Board, state: State, rules: Rules, seed: int) -> torch.Tensor:
    """Return open slots, or those where agents are, at random."""
    can = action_mask(board, state, rules).scatter(2, state.slot[..., None], True)
    draws = torch.rand(board.shape, generator=torch.Generator().manual_seed(seed))
    return draws.masked_fill(~can, -1.0).argmax(2)


def test_potential_matches_hand_calculation(board: Board) -> None:
    """With shortfalls of 1.5 of 2 and 0 of 1 mean abilities, the potential is -4 * 1.5/3 - 2 * 0.75/2 - 0.75."""
    group = torch.tensor([[0.5, 2.5, 0.0]])
    assert potential(board, group).item() == pytest.approx(-2 - 0.75 - 0.75)
    assert potential(board, torch.tensor([[2.0, 1.0, 0.0]])).item() == 0


def test_coverage_matches_hand_calculation(board: Board) -> None:
    """(3) in the instance's units: -(0.5^(1 - 4) + 0.5^(5 - 2)) / 2 for groups of 1 and 5."""
    assert coverage(board, torch.tensor([[0.5, 2.5, 0.0]])).item() == pytest.approx(-(8 + 1 / 8) / 2)


def test_rewards_accept_leading_axes(board: Board) -> None:
    """Leading axes are further states of the same games."""
    group = torch.tensor([[[0.5, 2.5, 0.0]], [[2.0, 1.0, 0.0]]])
    for reward in (potential, coverage):
        each = torch.stack([reward(board, one) for one in group])
        assert torch.equal(reward(board, group), each)


def test_utility_matches_hand_calculation(board: Board) -> None:
    """The weight of energy is 0.5 per mean distance of an agent, (0 + 0.1 + 0.8) * 1.65 / 3 here."""
    state = state_of(board, np.array([0, 1, 1]))
    assert utility(board, state).item() == pytest.approx(-3.5 - 0.5 * 0.9 * 1.65 / 3)


def test_coverage_matches_the_evaluator() -> None:
    """With equal priorities and positive workloads, (3) over the number of tasks equals the evaluator's reward."""
    for seed in range(30):
        instance = tiny_instance(seed)
        if instance.has_travel_time or (instance.workload == 0).any():
            continue
        board = layout(instance)
        state = reset(board)
        expected = evaluate(instance, plan_of(board, state)).reward / instance.m
        assert coverage(board, state.group).item() == pytest.approx(expected, rel=1e-4)


def test_coverage_is_continued_along_its_tangent() -> None:
    """Beyond `LARGEST_EXPONENT` (3) is continued smoothly, keeps falling, and never overflows."""
    board = layout(Instance(ability=[1], workload=[1], tau=0.5))
    limit = LARGEST_EXPONENT / np.log(2)  # mean abilities short at which the exponent is reached

    def short_of(shortfall: float) -> float:
        return coverage(board, board.need - torch.tensor([[shortfall, 0.0]])).item()

    top = np.exp(LARGEST_EXPONENT)
    assert short_of(limit) == pytest.approx(-top, rel=1e-4)
    assert short_of(limit - 1) == pytest.approx(-top / 2, rel=1e-4)
    assert short_of(limit + 1) == pytest.approx(-top * (1 + np.log(2)), rel=1e-4)
    shortfalls = [short_of(limit * factor) for factor in (0.99, 1.0, 1.01, 2, 10, 1e3, 1e6)]
    assert shortfalls == sorted(shortfalls, reverse=True)
    assert len(set(shortfalls)) == len(shortfalls)
    assert np.isfinite(short_of(1e9))


@given(instances(), st.integers(0, 99), st.sampled_from(RULES))
def test_marginal_contributions_sum_to_the_increase_of_utility(instance: Instance, seed: int, rules: Rules) -> None:
    """They sum to the increase of utility, and each equals that of granting its bid alone."""
    board = layout(instance)
    state, generator = reset(board), torch.Generator().manual_seed(seed)
    bids = torch.randn(board.shape, generator=generator).masked_fill(~action_mask(board, state, rules), -torch.inf)
    granted = grant_bids(board, state, bids, torch.tensor([-1.0]), rules.most_moves)
    brought = marginal_contributions(board, state, granted, rules)
    after = step(board, state, apply_moves(board, state, granted))
    rise = utility(board, after, rules) - utility(board, state, rules)
    size = 1e-5 * (1 + abs(utility(board, state, rules).item()) + abs(utility(board, after, rules).item()))
    assert brought.sum().item() == pytest.approx(rise.item(), abs=size)
    so_far = utility(board, state, rules)
    for number in range(granted.shape[1]):
        region = step(board, state, apply_moves(board, state, granted[:, : number + 1]))
        now = utility(board, region, rules)
        assert brought[0, number].item() == pytest.approx((now - so_far).item(), abs=size)
        so_far = now


def test_reserve_and_padding_contribute_nothing(board: Board) -> None:
    """The contribution of the reserve and of padding is 0, at any position."""
    state = reset(board)
    brought = marginal_contributions(board, state, torch.tensor([[9, -1]]))
    assert brought.tolist() == [[0, 0]]


@given(instances(), st.integers(0, 99), st.sampled_from(RULES))
def test_difference_rewards_match_brute_force(instance: Instance, seed: int, rules: Rules) -> None:
    """An agent's reward is the utility of the joint action minus that if it alone had stayed."""
    board = layout(instance)
    state = step(board, reset(board), somewhere(board, reset(board), rules, seed))
    slot = somewhere(board, state, rules, seed + 1)
    slot = torch.where(state.done[:, None], state.slot, slot)
    rewards = difference_rewards(board, state, slot, rules)
    after = utility(board, step(board, state, slot), rules)
    for agent in range(instance.n):
        stayed = slot.clone()
        stayed[0, agent] = state.slot[0, agent]
        expected = after - utility(board, step(board, state, stayed), rules)
        size = 1e-5 * (1 + 2 * abs(after.item()) + abs(expected.item()))
        assert rewards[0, agent].item() == pytest.approx(expected.item(), abs=size)


@given(instances(speeds=False), st.floats(0.1, 10), st.integers(0, 99))
def test_makespan_matches_the_evaluator(instance: Instance, hours: float, seed: int) -> None:
    """Times the reference, it is the makespan of the served tasks; the number of unserved tasks is equal."""
    board = layout(instance, hours=hours)
    state = step(board, reset(board), somewhere(board, reset(board), PLANNING, seed))
    time, unserved = relative_makespan(board, state.group)
    expected = evaluate(instance, plan_of(board, state))
    assert time.item() * hours == pytest.approx(expected.served_makespan, rel=1e-5)
    assert unserved.item() == len(expected.unserved_tasks)


@given(instances(), st.floats(0.1, 10), st.integers(0, 99))
def test_needs_are_met_iff_makespan_is_within_the_reference(instance: Instance, hours: float, seed: int) -> None:
    """Also with travel times, all needs are met if and only if the makespan is at most T_ref."""
    board = layout(instance, hours=hours)
    state = step(board, reset(board), somewhere(board, reset(board), PLANNING, seed))
    score = evaluate(instance, plan_of(board, state))
    makespan = np.inf if score.makespan is None else score.makespan
    assume(abs(makespan - hours) > 1e-4 * hours)  # single precision
    assert (potential(board, state.group).item() > -1e-5) == (makespan <= hours)


def test_last_term_of_the_potential_is_the_makespan() -> None:
    """1 - T_ref / T: groups of 3 and 1 for 2 and 2 at T_ref = 1 take 2 h."""
    board = layout(Instance(ability=[2, 1, 1], workload=[2, 2], start_task=[0, 0, 1]))
    assert relative_makespan(board, reset(board).group)[0].item() == 2
    # short: 0 of 2 and 1 of 2, in mean abilities of 4/3; total 1 of 4, on average 1/4, at worst 1/2
    assert potential(board, reset(board).group).item() == pytest.approx(-4 / 4 - 2 / 4 - 1 / 2)


def best_groups(instance: Instance) -> tuple[set[tuple[float, ...]], set[tuple[float, ...]]]:
    """Return the group abilities of the best of all plans: by (3), and by the makespan with all tasks served."""
    plans = itertools.product(range(instance.m), repeat=instance.n)
    plan_of_group = {tuple(np.bincount(plan, instance.ability, instance.m).tolist()): plan for plan in plans}
    scores = {group: evaluate(instance, Allocation(plan)) for group, plan in plan_of_group.items()}
    reward = max(score.reward for score in scores.values())
    makespan = min(score.makespan for score in scores.values() if score.makespan is not None)
    return (
        {group for group, score in scores.items() if score.reward == pytest.approx(reward)},
        {group for group, score in scores.items() if score.makespan == pytest.approx(makespan)},
    )


def test_coverage_and_makespan_agree_at_balanced_load() -> None:
    """If total ability equals total load and divides without remainder, both have the same unique best plan."""
    by_coverage, by_makespan = best_groups(Instance(ability=[2] * 5, workload=[8, 2]))
    assert by_coverage == by_makespan == {(8.0, 2.0)}


def test_coverage_and_makespan_differ_at_other_loads() -> None:
    """Loads of 8 and 2: (3) equalises the slack W - h, the makespan the ratio h / W, with too little and with too much.

    Of 20, (3) gives 13 and 7, or as near as agents of 2 come; the makespan gives 16 and 4. Of 5, the makespan serves
    both with 4 and 1; (3) leaves the small task alone.
    """
    ample = best_groups(Instance(ability=[2] * 10, workload=[8, 2]))
    assert ample == ({(12.0, 8.0), (14.0, 6.0)}, {(16.0, 4.0)})
    scarce = best_groups(Instance(ability=[1] * 5, workload=[8, 2]))
    assert scarce == ({(5.0, 0.0)}, {(4.0, 1.0)})


@pytest.mark.parametrize("reward", list(Reward))
def test_reward_ranks_plans_by_the_objective(reward: Reward) -> None:
    """At balanced load the utility is maximal at the same plan for both rewards."""
    board = layout(Instance(ability=[3, 1, 1, 1], workload=[4, 2]), energy_weight=0.0)
    slots = torch.tensor(list(itertools.product(range(2), repeat=4)))
    boards = board[torch.zeros(len(slots), dtype=torch.int64)]
    gain = potential if reward == Reward.MAKESPAN else coverage
    value = gain(boards, group_ability(boards, slots))
    group = group_ability(boards, slots)[value == value.max()] * 1.5
    assert {tuple(row) for row in group[:, :2].tolist()} == {(4.0, 2.0)}


@pytest.mark.parametrize("reward", list(Reward))
def test_higher_priority_gives_higher_utility(reward: Reward) -> None:
    """Of two equal tasks without agents, an agent adds more utility at the one of higher priority."""
    for priority in ([1, 3], [3, 1]):
        instance = Instance(ability=[1, 1], workload=[2, 2], priority=priority)
        board = layout(instance, plan=np.array([-1, -1]))
        rules = Rules(reward=reward)
        bids = torch.tensor([[0 * 3 + 0], [0 * 3 + 1]])
        brought = [marginal_contributions(board, reset(board), bid[None], rules).item() for bid in bids]
        assert (brought[0] > brought[1]) == (priority[0] > priority[1])
        assert min(brought) > 0


@pytest.mark.parametrize("reward", list(Reward))
def test_equal_priorities_have_no_effect(pair: Instance, reward: Reward) -> None:
    """Any common priority leaves all rewards unchanged."""
    rules = Rules(reward=reward)
    one, other = (layout(instance) for instance in (pair, replace(pair, priority=[5, 5])))
    assert utility(one, reset(one), rules).item() == utility(other, reset(other), rules).item()


def test_energy_is_weighted(route: Instance) -> None:
    """A flight of 3 by one of two agents lowers the utility by the energy weight times 1.5, in scaled units."""
    board = layout(route, energy_weight=0.25)
    unit = board.scale.item()
    bid = torch.tensor([[1]])
    free = layout(route, energy_weight=0.0)
    for rules in (PLANNING, Rules(flying=True)):
        paid = marginal_contributions(board, reset(board), bid, rules) - marginal_contributions(
            free, reset(free), bid, rules
        )
        assert paid.item() == pytest.approx(-0.25 * 3 * unit / 2, rel=1e-4)
    assert mean_distance(board, reset(board)).item() == 0
