"""Instances as boards of games."""

import warnings

import numpy as np
import pytest
import torch
from boards import EXTREMES, layout, state_of
from hypothesis import given
from hypothesis import strategies as st
from oracle import reachable
from strategies import instances

from alloc.problems import IDLE, Allocation, Family, Instance, evaluate, paper_like, random_instance
from alloc.problems.game import Board, current_tasks, group_ability, make_board, reset


def fields(board: Board) -> dict[str, torch.Tensor]:
    return {name: getattr(board, name) for name in Board.__dataclass_fields__}


def test_units_match_hand_calculation(board: Board) -> None:
    """Abilities and needs are relative to the mean ability, here 2; reachable distances have a mean of 0.66."""
    assert board.ability.tolist() == [[0.5, 1.0, 1.5]]
    assert board.need.tolist() == [[2.0, 1.0, 0.0]]
    # legal: 0; 0.9 and 0.1; 0.2 and 0.8: a mean of 0.4, which becomes 0.66
    assert board.scale.item() == pytest.approx(1.65)
    torch.testing.assert_close(board.distance[0], 1.65 * torch.tensor([[0, 1, 0], [0.9, 0.1, 0], [0.2, 0.8, 0]]))
    torch.testing.assert_close(board.task_distance[0], 1.65 * torch.tensor([[0.0, 1, 0], [1, 0, 0], [0, 0, 0]]))
    assert board.log_tau.item() == pytest.approx(2 * np.log(0.5))


def test_reference_makespan_determines_the_needs(pair: Instance) -> None:
    """Twice the hours need half the ability."""
    assert layout(pair, hours=2.0).need.tolist() == [[1.0, 0.5, 0.0]]


def test_supply_and_reachable_share_match_hand_calculation(board: Board) -> None:
    """All 3 mean abilities reach the first task, which needs 2; 2.5 reach the second, which needs 1."""
    assert board.supply_ratio[0, :2].tolist() == pytest.approx([np.log(1.5) / 2 - 1, np.log(2.5) / 2 - 1])
    assert board.reachable_share[0].tolist() == pytest.approx([2 / 3, 1, 1])


def test_weights_are_priorities_relative_to_their_mean() -> None:
    """Tasks without workload do not count; without priorities, all weights are equal."""
    tasks = {"ability": [1], "workload": [1, 1, 0]}
    assert layout(Instance(**tasks, priority=[1, 3, 7])).weight.tolist() == [[0.5, 1.5, 0.0, 0.0]]
    assert layout(Instance(**tasks, priority=[0, 0, 7])).weight.tolist() == [[1.0, 1.0, 0.0, 0.0]]
    assert layout(Instance(**tasks, priority=[1e308, 1e308, 1e308])).weight.tolist() == [[1.0, 1.0, 0.0, 0.0]]


def test_agents_start_at_the_nearest_task_in_reach(board: Board) -> None:
    """Without a start task, an agent starts at the nearest task."""
    assert board.start.tolist() == [[0, 1, 0]]


def test_start_task_takes_precedence() -> None:
    """A start task counts unless the agent cannot take it; agents that can take no task are idle."""
    instance = Instance(
        ability=[1, 1, 1],
        workload=[1, 1],
        task_position=[[0, 0], [1, 0]],
        start_task=[1, 1, 0],
        allowed_tasks=[None, [0], []],
    )
    assert layout(instance).start.tolist() == [[1, 0, 2]]


def test_plan_takes_precedence_over_start_tasks(pair: Instance) -> None:
    """A plan precedes the start; agents whose task in it is out of reach start as without it."""
    assert layout(pair, plan=np.array([1, 0, IDLE])).start.tolist() == [[0, 0, 2]]


def test_ties_are_broken_by_the_generator() -> None:
    """Agents between equally near tasks are distributed over them, depending on the seed."""
    instance = Instance(ability=np.ones(40), workload=np.ones(4))
    starts = [layout(instance, seed=seed).start for seed in (0, 0, 1)]
    assert torch.equal(starts[0], starts[1])
    assert not torch.equal(starts[0], starts[2])
    assert set(starts[0].flatten().tolist()) == {0, 1, 2, 3}


def test_travel_time_reduces_ability() -> None:
    """An agent that flies for half of the reference makespan contributes half its ability; after all of it, nothing."""
    instance = Instance(
        ability=[2, 2],
        workload=[1, 1, 1],
        task_position=[[1, 0], [2, 0], [5, 0]],
        agent_position=[[0, 0], [0, 0]],
        speed=[0.5, np.inf],
    )
    board = layout(instance, hours=4.0)
    assert board.contribution[0].tolist() == [[0.5, 0, 0, 1], [1, 1, 1, 1]]
    assert board.legal[0].tolist() == [[True, False, False, True], [True, True, True, True]]


@given(instances(speeds=False))
def test_legal_actions_match_reach(instance: Instance) -> None:
    """Without travel times an agent may go to reachable tasks with workload, and be idle."""
    board = layout(instance)
    expected = reachable(instance)[1] & (instance.workload > 0)
    assert np.array_equal(board.legal[0, :, :-1].numpy(), expected)
    assert bool(board.legal[..., -1].all())
    assert bool(board.legal.gather(2, board.start[..., None]).all())


@given(instances(speeds=False), st.randoms(use_true_random=False))
def test_group_abilities_match_the_evaluator(instance: Instance, random) -> None:
    """Groups of a board, times the mean ability, are the W_j of `evaluate`."""
    board = layout(instance)
    options = [[-1, *np.flatnonzero(row).tolist()] for row in board.legal[0, :, :-1].numpy()]
    plan = np.array([random.choice(row) for row in options])
    state = state_of(board, plan)
    expected = evaluate(instance, Allocation(plan)).group_ability
    np.testing.assert_allclose(state.group[0, :-1].numpy() * instance.ability.mean(), expected, rtol=1e-5)
    assert torch.equal(group_ability(board, state.slot), state.group)


def test_games_are_selected_by_index() -> None:
    """Games are selected in the given order, also repeatedly."""
    games = [paper_like(8, 3, 30, seed) for seed in range(3)]
    chosen = layout(*games)[torch.tensor([2, 0, 2])]
    for name, value in fields(layout(games[2], games[0], games[2])).items():
        assert torch.equal(value, getattr(chosen, name)), name


def test_boards_of_several_instances_match_single_boards() -> None:
    """Batched games have the same layout as single ones."""
    games = [paper_like(8, 3, 30, seed) for seed in range(3)]
    together = layout(*games)
    for number, game in enumerate(games):
        for name, value in fields(layout(game)).items():
            assert torch.equal(getattr(together, name)[number : number + 1], value), name


def test_units_do_not_matter() -> None:
    """Other units of work, time and distance give the same game, except for tau and the scale."""
    one = random_instance(Family(agents=9, tasks=4, starts="own", communication_range=(0.5, 1.0), battery=(2, 5)), 3)
    other = Instance(
        ability=one.ability * 10,
        workload=one.workload * 30,
        task_position=one.task_position * 7,
        agent_position=one.agent_position * 7,
        communication_range=one.communication_range * 7,
        battery=one.battery * 7,
        energy_per_distance=one.energy_per_distance,
    )
    for name, value in fields(layout(other, hours=3.0)).items():
        if name not in ("log_tau", "scale"):
            torch.testing.assert_close(value, getattr(layout(one), name), msg=name)


@pytest.mark.parametrize("name", EXTREMES)
@pytest.mark.parametrize("hours", [0.0, 1e-300, 1.0, 1e300])
@pytest.mark.parametrize("near", [None, 1])
def test_layout_is_always_finite(name: str, hours: float, near: int | None) -> None:
    """For extreme numbers, no field of a board is NaN, and only the endurance is infinite; there are no warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        board = layout(EXTREMES[name], hours=hours, near=near)
    for field, value in fields(board).items():
        assert not value.is_floating_point() or bool(torch.isfinite(value).all() | (field == "endurance")), field
    assert not bool(board.endurance.isnan().any())
    assert bool((current_tasks(board, reset(board)) < board.places).all())


def test_large_mean_ability_keeps_log_tau() -> None:
    """0.5^500 is 0 in single precision, but its logarithm is not."""
    assert layout(Instance(ability=[500], workload=[1])).log_tau.item() == pytest.approx(500 * np.log(0.5))


def test_number_of_reference_makespans_must_match(pair: Instance) -> None:
    """There must be a reference makespan for each instance."""
    with pytest.raises(ValueError, match="shorter"):
        make_board([pair, pair], [1.0], [0.5, 0.5], np.random.default_rng(0))
