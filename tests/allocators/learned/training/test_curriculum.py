"""The curriculum: games of every kind are valid, grow with progress, and are reproducible by seed."""

from dataclasses import fields, replace

import numpy as np
import pytest
import torch

from alloc.allocators.learned.play.reference import reference_makespan
from alloc.allocators.learned.training.curriculum import Curriculum, with_reference
from alloc.allocators.learned.training.families import FAMILIES, RECIPES, draw_instance
from alloc.problems import makespan_lower_bound
from alloc.problems.game import Board
from alloc.problems.generate import paper_like

SMALL = Curriculum(max_pairs=1500, games=(2, 6))


def drawn(curriculum: Curriculum, seed: int = 0, progress: float = 1.0) -> Board:
    return curriculum.draw(np.random.default_rng(seed), progress)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_gives_playable_games(family: str) -> None:
    """All numbers are finite, some task needs work, and some agent can move."""
    for seed in range(3):
        board = drawn(replace(SMALL, families=(family,)), seed)
        for field in fields(Board):
            if field.name != "endurance":
                assert torch.isfinite(getattr(board, field.name)).all(), field.name
        assert (board.need.sum(1) > 0).all()
        assert (board.legal[:, :, :-1].sum((1, 2)) > 0).all()


def test_same_generator_draws_the_same_games() -> None:
    """A board is a function of the generator and the progress."""
    one, two, other = drawn(SMALL, 7), drawn(SMALL, 7), drawn(SMALL, 8)
    assert all(torch.equal(getattr(one, field.name), getattr(two, field.name)) for field in fields(Board))
    assert one.ability.shape != other.ability.shape or not torch.equal(one.ability, other.ability)


def test_sizes_grow_with_progress() -> None:
    """Boards have the initial numbers of tasks at first, and all sizes at the end of the growth."""
    early = [drawn(replace(SMALL, families=("paper",)), seed, 0.0).places - 1 for seed in range(20)]
    late = [drawn(replace(SMALL, families=("paper",)), seed, 0.7).places - 1 for seed in range(20)]
    assert (min(early), max(early)) == SMALL.initial_tasks
    assert min(late) >= SMALL.tasks[0]
    assert SMALL.initial_tasks[1] < max(late) <= SMALL.tasks[1]


def test_boards_have_similar_sizes() -> None:
    """Many small games or few large ones: pairs are near the limit, and agents below theirs."""
    for seed in range(15):
        games, n, _ = (board := drawn(Curriculum(families=("paper",)), seed)).shape
        assert n <= 80
        assert 8 <= games <= 48
        assert games * n * board.places <= 12_000 or games == 8


def test_energy_weights_and_targets_have_their_distributions() -> None:
    """Energy weights are log-uniform; a share of the games has targets above the bound, with spare ability."""
    curriculum = Curriculum(
        families=("paper",), max_pairs=3000, energy_weight=(0.2, 3.0), relaxed_fraction=0.3, max_relaxation=1.3
    )
    boards = [drawn(curriculum, seed) for seed in range(40)]
    weight = torch.cat([board.energy_weight for board in boards])
    assert weight.min() >= 0.2
    assert weight.max() <= 3.0
    assert 0.6 < weight.median() < 1.0
    load = torch.cat([board.need.sum(1) / board.ability.sum(1) for board in boards])
    assert load.max() <= 1 + 1e-5
    assert 0.2 < (load < 0.99).float().mean() < 0.4
    assert load.min() > 1 / 1.31


def test_travel_reduces_ability() -> None:
    """With finite speeds agents contribute between half and nearly all of their ability, less with distance."""
    board = drawn(replace(SMALL, families=("travel",), relaxed_fraction=0.0))
    share = (board.contribution / board.ability[..., None])[:, :, :-1]
    assert 0.4 < share.mean() < 0.99
    assert share.min() < 0.9


def test_reference_makespan_is_the_best_bound() -> None:
    """With short communication ranges the bound of the linear programme may be the higher one."""
    rng = np.random.default_rng(0)
    instances = [draw_instance("short-range", 20, 5, seed, rng) for seed in range(6)]
    bounds = [makespan_lower_bound(instance) for instance in instances]
    references = [one.reference_h for one in with_reference(instances)]
    assert references == [reference_makespan(instance) for instance in instances]
    assert all(hours >= bound for hours, bound in zip(references, bounds, strict=True))
    assert references != bounds


def test_own_instances_replace_drawn_ones() -> None:
    """A board holds copies of given instances of equal size, with different energy weights."""
    given = tuple(with_reference([paper_like(12, 3, 50, seed) for seed in range(3)] + [paper_like(9, 2, 40, 5)]))
    curriculum = replace(SMALL, instances=given, relaxed_fraction=0.0)
    seen = {drawn(curriculum, seed).shape[1:] for seed in range(10)}
    assert seen == {(12, 4), (9, 3)}
    board = drawn(curriculum)
    assert len(board.energy_weight.unique()) == len(board.energy_weight)


def test_large_own_instances_use_sparse_candidates() -> None:
    """If a single game exceeds the pair limit of a board, agents bid only for nearby tasks."""
    board = drawn(replace(SMALL, instances=tuple(with_reference([paper_like(100, 20, 400, 1)]))))
    assert board.shape[0] == 1
    assert board.shape[2] < 21


def test_training_seeds_are_in_their_reserved_range(monkeypatch: pytest.MonkeyPatch) -> None:
    """Instances are drawn with seeds from 10^9 to below 2 * 10^9, which nothing else uses."""
    seeds = []
    module = "alloc.allocators.learned.training.families"
    monkeypatch.setattr(
        f"{module}.paper_like", lambda n, m, total, seed: seeds.append(seed) or paper_like(n, m, total, 1)
    )
    drawn(replace(SMALL, families=("paper",)))
    assert seeds
    assert all(10**9 <= seed < 2 * 10**9 for seed in seeds)


def test_game_length_grows_with_agents() -> None:
    """A game has enough rounds for its agents."""
    few, many = (drawn(replace(SMALL, instances=tuple(with_reference([paper_like(n, 3, 4 * n, 0)])))) for n in (12, 72))
    assert SMALL.max_steps(few) < SMALL.max_steps(many)
    assert set(RECIPES) < set(FAMILIES)
