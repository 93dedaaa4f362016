"""Validation: the figures are those of `evaluate` for the plans of the policy."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from boards import plan_of

from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.allocators.learned.training.curriculum import Curriculum, with_reference
from alloc.allocators.learned.training.families import RECIPES
from alloc.allocators.learned.training.validation import (
    DISTANCE_WEIGHT,
    games_on,
    hold_out,
    validate,
    validation_boards,
)
from alloc.problems import InputError, Instance, evaluate
from alloc.problems.game import PLANNING, make_board, reset, step
from alloc.problems.generate import paper_like


@pytest.fixture
def network() -> ActorCritic:
    torch.manual_seed(3)
    return ActorCritic(NetworkSize(8, 8, 2))


def test_makespan_and_cost_match_the_best_plan_of_the_game(network: ActorCritic) -> None:
    """T, distance and cost equal the evaluator's for the cheapest plan along the game."""
    instance = paper_like(10, 3, 44, 1)
    curriculum, (board,) = games_on([instance], Curriculum())
    got = validate(network, [board], PLANNING, curriculum)
    scale = 0.66 / instance.reach.rows(instance.reach.origin)[0].mean()
    state, costs = reset(board), []
    while not state.done.all():
        _, slot = sample_actions(board, state, network(board, state))
        state = step(board, state, slot)
        score = evaluate(instance, plan_of(board, state))
        time = score.served_makespan / curriculum.instances[0].reference_h
        distance = score.distance * scale / instance.n
        unserved = len(score.unserved_tasks)
        costs.append((1 - 1 / time + unserved + DISTANCE_WEIGHT * distance, unserved, time, distance))
    assert (got.cost, got.unserved, got.time, got.distance) == pytest.approx(min(costs), rel=1e-4)
    assert got.others_time == got.time


def test_cost_of_a_bad_game_is_capped(network: ActorCritic) -> None:
    """However far above its reference, a makespan costs no more than an unserved task."""
    instances = [paper_like(10, 3, 44, 1)] * 2
    references = [one.reference_h for one in with_reference(instances)]
    boards = [make_board(instances, references, [1.0] * 2, np.random.default_rng(0))]
    hard = replace(boards[0], need=boards[0].need * torch.tensor([[1.0], [1e6]]))
    costs = [validate(network, [board], PLANNING, Curriculum()).cost for board in (boards[0], hard)]
    assert 0 < costs[1] - costs[0] < 0.6


def test_unserved_tasks_are_reported_as_part_of_the_cost(network: ActorCritic) -> None:
    """The mean number of unserved tasks is reported; the rest of the cost is small."""
    served, unserved = paper_like(10, 3, 44, 1), Instance(ability=[1], workload=[1, 1, 1], allowed_tasks=[[]])
    curriculum, boards = games_on([served, unserved], Curriculum())
    got = validate(network, boards, PLANNING, curriculum)
    assert got.unserved == 1.5
    assert 0 <= got.cost - got.unserved < 1


def test_a_fifth_of_own_instances_is_held_out() -> None:
    """With five or more instances, validation uses a fixed subset that is not trained on."""
    instances = [paper_like(10, 3, 44, seed) for seed in range(10)]
    train, held = hold_out(instances)
    assert (len(train), len(held)) == (8, 2)
    assert sorted([*train, *held], key=instances.index) == instances
    assert held != instances[-2:]
    assert hold_out(instances) == (train, held)
    curriculum, boards = games_on(instances, Curriculum())
    assert [one.instance for one in curriculum.instances] == train
    assert [board.shape[0] for board in boards] == [2]
    few, (board,) = games_on(instances[:3], Curriculum())
    assert len(few.instances) == board.shape[0] == 3


def test_instances_without_work_are_left_out(network: ActorCritic) -> None:
    """Instances without work cannot distinguish networks."""
    idle = Instance(ability=[1, 2], workload=[0, 0])
    busy = [paper_like(10, 3, 44, seed) for seed in range(6)]
    train, held = hold_out([idle, *busy, idle, idle, idle])
    assert (len(train), len(held)) == (5, 1)
    assert idle not in train + held
    curriculum, boards = games_on([*busy, *[idle] * 4], Curriculum())
    assert validate(network, boards, PLANNING, curriculum).cost > 0
    with pytest.raises(InputError, match="no work to do in any instance"):
        hold_out([idle, idle])


def test_validation_games_are_fixed() -> None:
    """Paper-like games of scenario 1's size come first, followed by two of every family."""
    boards, again = (validation_boards(Curriculum()) for _ in range(2))
    assert [board.shape[:2] for board in boards] == [(12, 100), (2 * len(RECIPES), 60)]
    assert all(torch.equal(one.need, two.need) for one, two in zip(boards, again, strict=True))
    assert np.allclose(boards[0].need.sum(1), 100)
    assert len(validation_boards(Curriculum(("paper",)))) == 1
    assert validation_boards(Curriculum(("travel", "depots")))[1].shape[0] == 4
