"""The rules of the game, compared with hand calculation."""

import numpy as np
import pytest
import torch
from boards import layout
from hypothesis import given
from hypothesis import strategies as st
from strategies import instances

from alloc.problems import Family, Instance, paper_like, random_instance
from alloc.problems.game import (
    PAPER,
    PLANNING,
    Board,
    Rules,
    State,
    action_mask,
    apply_moves,
    battery_left,
    current_tasks,
    grant_bids,
    hop_distance,
    mean_distance,
    reset,
    step,
    sum_by_place,
)
from alloc.problems.game.rules import TOLERANCE

FLYING = Rules(flying=True)


def go(board: Board, state: State, *slots: int) -> State:
    return step(board, state, torch.tensor([slots]))


def played(board: Board, rules: Rules, seed: int, steps: int = 5) -> list[State]:
    """Return the states of a game in which each agent goes somewhere at random, or stays."""
    generator, states = torch.Generator().manual_seed(seed), [reset(board)]
    for _ in range(steps):
        can = action_mask(board, states[-1], rules).scatter(2, states[-1].slot[..., None], True)
        draws = torch.rand(board.shape, generator=generator).masked_fill(~can, -1.0)
        states.append(step(board, states[-1], draws.argmax(2)))
    return states


def greedy_matching(board: Board, state: State, bids: np.ndarray, reserve: float, most: int | None) -> list[int]:
    """Grant bids in one game as the words say: from the best down, the first of equals first, none on a used task."""
    n, c = bids.shape
    goal, task, idle = board.candidates[0].tolist(), current_tasks(board, state)[0].tolist(), board.places - 1
    used, gone, granted = set[int](), set[int](), list[int]()
    for _, action in sorted((-bid, number) for number, bid in enumerate(bids.ravel().tolist())):
        agent, slot = divmod(action, c)
        bid = bids[agent, slot]
        if bid == -np.inf or bid < reserve or (most is not None and len(granted) == most):
            break
        ends = {task[agent], goal[agent][slot]} - {idle}
        if agent in gone or ends & used:
            continue
        used |= ends
        gone.add(agent)
        granted.append(action)
    return granted if most is not None and len(granted) == most else [*granted, n * c]


@pytest.mark.parametrize("most", [None, 1, 3])
@pytest.mark.parametrize("reserve", [-np.inf, 0.0, 2.0, 9.0])
@pytest.mark.parametrize("ties", [False, True])
def test_grants_are_a_greedy_matching(most: int | None, reserve: float, ties: bool) -> None:
    """Bids are granted in decreasing order unless they share a task with a granted one; ties in order of agents."""
    for seed in range(8):
        rng = np.random.default_rng([seed, ties])
        family = Family(agents=9, tasks=4, starts="own", communication_range=(0.4, 1.5))
        board = layout(random_instance(family, seed))
        state = played(board, PLANNING, seed)[seed % 3]
        bids = rng.integers(-2, 5, (9, 5)).astype(float) if ties else rng.normal(1, 2, (9, 5))
        bids[~action_mask(board, state)[0].numpy()] = -np.inf
        tensor = torch.tensor(bids, dtype=torch.float32)
        granted = grant_bids(board, state, tensor[None], torch.tensor([reserve], dtype=torch.float32), most)[0].tolist()
        assert granted == greedy_matching(board, state, tensor.numpy(), reserve, most)


def test_batched_games_grant_as_single_ones() -> None:
    """Other games have no effect; games that end sooner are padded with -1."""
    games = [paper_like(8, 4, 30, seed) for seed in range(4)]
    board, generator = layout(*games), torch.Generator().manual_seed(3)
    state = reset(board)
    state = State(
        state.slot, state.group, state.visited, torch.tensor([False, True, False, False]), state.location, state.flown
    )
    bids = torch.randn(board.shape, generator=generator).masked_fill(~action_mask(board, state), -torch.inf)
    reserve = torch.tensor([-1.0, 0.0, 0.5, 9.0])
    together = grant_bids(board, state, bids.clone(), reserve)
    assert (together[1] == -1).all()
    for number in (0, 2, 3):
        row = torch.tensor([number])
        alone = grant_bids(board[row], state[row], bids[row], reserve[row])[0].tolist()
        assert together[number].tolist() == alone + [-1] * (together.shape[1] - len(alone))


def test_game_ends_without_open_bids(board: Board) -> None:
    """Without open bids the game ends for any reserve: no masked bid is ever granted."""
    bids = torch.full(board.shape, -torch.inf)
    assert grant_bids(board, reset(board), bids, torch.tensor([-torch.inf])).tolist() == [[9]]


def test_bids_are_not_modified(board: Board) -> None:
    """Granting does not modify the bids."""
    bids = torch.arange(9.0).view(1, 3, 3)
    before = bids.clone()
    grant_bids(board, reset(board), bids, torch.tensor([0.0]))
    assert torch.equal(bids, before)


def test_several_agents_may_become_idle_at_once() -> None:
    """Idleness is not a task: any number of agents can become idle in one step."""
    board = layout(Instance(ability=[1, 1, 1], workload=[1, 1, 1], start_task=[0, 1, 2]))
    bids = torch.full(board.shape, -torch.inf)
    bids[0, :, 3] = torch.tensor([3.0, 2.0, 1.0])
    granted = grant_bids(board, reset(board), bids, torch.tensor([0.0]))
    assert granted.tolist() == [[3, 7, 11, 12]]
    after = step(board, reset(board), apply_moves(board, reset(board), granted))
    assert after.group.tolist() == [[0, 0, 0, 3]]


def test_most_moves_limits_the_granted_bids(board: Board) -> None:
    """With `most_moves` 1 only the best bid is granted, and the reserve is listed only if it is the best."""
    bids = torch.full(board.shape, -torch.inf)
    bids[0, 2, 1], bids[0, 0, 2] = 2.0, 1.0
    assert grant_bids(board, reset(board), bids, torch.tensor([0.0]), 1).tolist() == [[7]]
    assert grant_bids(board, reset(board), bids, torch.tensor([3.0]), 1).tolist() == [[9]]


def test_sums_by_place_match_hand_calculation() -> None:
    """Two games of three agents with two figures each: values at a place are summed, 0 without agents."""
    values = torch.tensor([[[1.0, 10.0], [2.0, 20.0], [4.0, 40.0]], [[1.0, 0.5], [1.0, 0.5], [1.0, 0.5]]])
    sums = sum_by_place(values, torch.tensor([[0, 2, 0], [1, 1, 1]]), 3)
    assert sums.tolist() == [[[5.0, 50.0], [0.0, 0.0], [2.0, 20.0]], [[0.0, 0.0], [3.0, 1.5], [0.0, 0.0]]]


def test_step_updates_group_abilities(board: Board) -> None:
    """A move transfers the agent's ability from one task to the other, and changes nothing else."""
    state = reset(board)
    assert state.group.tolist() == [[2.0, 1.0, 0.0]]
    after = go(board, state, 0, 1, 1)
    assert after.group.tolist() == [[0.5, 2.5, 0.0]]
    assert after.visited[0].tolist() == [[False] * 3, [False] * 3, [True, False, False]]
    assert not after.done.any()


def test_game_without_moves_ends(board: Board) -> None:
    """After it has ended, nothing changes and no bid is open."""
    ended = go(board, reset(board), *board.start[0].tolist())
    assert ended.done.all()
    assert not action_mask(board, ended).any()
    assert current_tasks(board, go(board, ended, 2, 2, 2)).tolist() == [[0, 1, 0]]


def test_open_bids_match_hand_calculation(board: Board) -> None:
    """Agents may go to reachable tasks except their own, and become idle."""
    assert action_mask(board, reset(board))[0].tolist() == [
        [False, False, True],
        [True, False, True],
        [False, True, True],
    ]


def test_agents_do_not_return_to_a_place(board: Board) -> None:
    """Agents do not return to places that they have left, idleness included, unless the rules allow it."""
    there = go(board, reset(board), 2, 1, 1)
    back = go(board, there, 2, 1, 2)
    assert action_mask(board, back)[0].tolist() == [[False] * 3, [True, False, True], [False] * 3]
    free = action_mask(board, back, Rules(returning=True))
    assert free[0].tolist() == [[True, False, False], [True, False, True], [True, True, False]]


def test_only_the_final_task_costs_energy(board: Board) -> None:
    """Returning costs nothing: the energy is that of a direct flight to the final task (19)."""
    start = reset(board)
    there = go(board, start, 0, 1, 1)
    assert mean_distance(board, start).item() == pytest.approx(1.65 * (0 + 0.1 + 0.2) / 3)
    assert mean_distance(board, there).item() == pytest.approx(1.65 * (0 + 0.1 + 0.8) / 3)
    assert mean_distance(board, go(board, there, 0, 1, 0)).item() == mean_distance(board, start).item()


def test_hops_match_hand_calculation(route: Instance) -> None:
    """Agents at 0 fly to 3, 7 and 0: flights of 3, 4 and 7; becoming idle takes no flight."""
    board = layout(route)
    unit = board.scale.item()
    start = reset(board)
    assert (hop_distance(board, start)[0] / unit).tolist() == [pytest.approx([0, 3, 7, 0])] * 2
    there = go(board, start, 1, 0)
    assert (there.flown[0] / unit).tolist() == pytest.approx([3, 0])
    assert (hop_distance(board, there)[0] / unit).tolist() == [pytest.approx([3, 0, 4, 0]), pytest.approx([0, 3, 7, 0])]
    farther = go(board, there, 2, 3)
    assert (farther.flown[0] / unit).tolist() == pytest.approx([7, 0])
    assert farther.location.tolist() == [[2, 0]]
    rest = go(board, farther, 3, 1)
    assert (rest.flown[0] / unit).tolist() == pytest.approx([7, 3])
    assert rest.location.tolist() == [[2, 1]]
    assert mean_distance(board, rest, FLYING).item() / unit == pytest.approx(5)
    # batteries last for 11 and 7: 4 of 11 and 4 of 7 are left
    assert battery_left(board, rest).item() == pytest.approx((4 / 11 + 4 / 7) / 2)


def test_remaining_battery_limits_reach(route: Instance) -> None:
    """After flights of 3 and 4, 4 of 11 are left: enough for 4 back to 3, not for 7 back to 0."""
    board = layout(route)
    state = go(board, go(board, reset(board), 1, 1), 2, 2)
    free = Rules(flying=True, returning=True)
    assert action_mask(board, state, free)[0].tolist() == [[False, True, False, True], [False, False, False, True]]
    assert action_mask(board, state, Rules(returning=True)).all(2).logical_not().all()
    assert action_mask(board, state, Rules(returning=True))[0].sum().item() == 6


def test_first_flight_counts(board: Board) -> None:
    """An agent that starts away from its initial task pays for the flight; otherwise staying would be free."""
    state = reset(board)
    assert state.flown[0].tolist() == pytest.approx([0, 0.165, 0.33])
    assert state.location.tolist() == [[0, 1, 0]]


def test_idle_agents_stay_at_their_start() -> None:
    """An agent that is idle, as nothing is in its range, is at its start, from which distances count."""
    board = layout(Instance(ability=[1, 1], workload=[1], task_position=[[3, 0]], agent_position=[[0, 0], [3, 0]],
                            communication_range=[1, 1]))  # fmt: skip
    state = reset(board)
    assert state.location.tolist() == [[1, 0]]
    assert state.flown.tolist() == [[0, 0]]
    assert battery_left(board, state).item() == 1


def test_remaining_battery_ignores_unlimited_agents(route: Instance) -> None:
    """Agents without a battery do not count."""
    board = layout(Instance(ability=[1, 1], workload=[1, 1], task_position=[[0, 0], [1, 0]], start_task=[0, 0],
                            battery=[2, np.inf]))  # fmt: skip
    assert battery_left(board, go(board, reset(board), 1, 1)).item() == pytest.approx(0.5)


@given(instances(), st.integers(0, 99))
def test_hops_are_never_shorter_than_the_direct_flight(instance: Instance, seed: int) -> None:
    """If all positions are known, an episode costs at least as much as its plan; no battery is overdrawn."""
    board = layout(instance)
    last = played(board, PAPER, seed)[-1]
    if not np.isnan(instance.task_position).any():
        assert mean_distance(board, last, PAPER).item() >= mean_distance(board, last, PLANNING).item() - 1e-4
    assert (last.flown <= board.endurance + 2 * TOLERANCE).all()
    assert 0 <= battery_left(board, last).item() <= 1


@given(instances(), st.integers(0, 99), st.sampled_from([PAPER, PLANNING, FLYING]))
def test_games_are_reproducible(instance: Instance, seed: int, rules: Rules) -> None:
    """The same seed gives the same game, bit for bit; abilities are conserved."""
    one, other = (played(layout(instance), rules, seed)[-1] for _ in range(2))
    for name in State.__dataclass_fields__:
        assert torch.equal(getattr(one, name), getattr(other, name))
    assert torch.isfinite(one.group).all()
    assert (one.group >= 0).all()
