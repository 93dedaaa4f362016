"""Regions of an instance as games."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from boards import layout
from strategies import rebuilt

from alloc.problems import IDLE, Family, random_instance
from alloc.problems.game import Board, mean_distance, observe_agents, observe_pairs, observe_tasks, reset, utility
from alloc.problems.game.board import AGENT_FIELDS
from alloc.problems.game.regions import lay_out_regions


@pytest.mark.parametrize("speed", [None, (0.5, 2.0)])
@pytest.mark.parametrize("dimensions", [2, 3])
def test_region_matches_the_board_of_its_own_instance(speed, dimensions: int) -> None:
    """Each game on a region equals that of the instance with only these agents and tasks, except for batteries."""
    family = Family(
        agents=14, tasks=6, starts="own", communication_range=(0.4, 1.5), speed=speed, priority=(1, 3),
        dimensions=dimensions, battery=None,
    )  # fmt: skip
    instance = random_instance(family, 5)
    plan = np.where(instance.reach.mask[instance.reach.origin, np.arange(14) % 6], np.arange(14) % 6, IDLE)
    tasks = np.array([[0, 1, 2], [3, 5, 4]])
    agents = [np.flatnonzero(np.isin(plan, some)) for some in tasks]
    regions = lay_out_regions(instance, 4.0, plan, tasks, agents, energy_weight=0.5)
    for number in range(2):
        size, place = len(agents[number]), np.full(instance.m + 1, -1)
        place[tasks[number]] = np.arange(3)
        game = rebuilt(instance, agents[number], tasks[number])
        game = replace(game, priority=instance.priority[tasks[number]])
        alone = layout(game, hours=4.0, plan=place[plan[agents[number]]])
        region = regions.board[torch.tensor([number])]
        for name in Board.__dataclass_fields__:
            value, expected = getattr(region, name), getattr(alone, name)
            if name in AGENT_FIELDS:
                value = value[:, :size]
            torch.testing.assert_close(value, expected, msg=lambda text, name=name: f"{name}: {text}")
        torch.testing.assert_close(observe_pairs(region, reset(region))[:, :size], observe_pairs(alone, reset(alone)))


def test_padding_agents_can_only_be_idle() -> None:
    """Regions with fewer agents are padded with agents without ability that can only be idle."""
    instance = random_instance(Family(agents=5, tasks=4), 1)
    plan = np.array([0, 0, 0, 2, IDLE])
    regions = lay_out_regions(instance, 1.0, plan, np.array([[0, 1], [2, 3]]), [np.array([0, 1, 2]), np.array([3])])
    assert regions.agents.tolist() == [[0, 1, 2], [3, -1, -1]]
    assert regions.board.ability[1, 1:].tolist() == [0, 0]
    assert regions.board.legal[1, 1:].tolist() == [[False, False, True]] * 2
    assert bool(torch.isfinite(observe_pairs(regions.board, reset(regions.board))).all())


def test_merge_applies_accepted_games() -> None:
    """Agents of accepted regions move to their slots; the others stay."""
    instance = random_instance(Family(agents=5, tasks=4), 1)
    plan = np.array([0, 0, 1, 2, IDLE])
    regions = lay_out_regions(instance, 1.0, plan, np.array([[0, 1], [2, 3]]), [np.array([0, 1, 2]), np.array([3])])
    slots = np.array([[1, 0, 0], [1, 2, 2]])
    assert regions.merge(plan, slots, np.array([True, False])).tolist() == [1, 0, 0, 2, IDLE]
    assert regions.merge(plan, slots, np.array([False, True])).tolist() == [0, 0, 1, 3, IDLE]
    both = regions.merge(plan, np.array([[2, 0, 1], [0, 2, 2]]), np.array([True, True]))
    assert both.tolist() == [IDLE, 0, 1, 2, IDLE]


def test_padding_does_not_change_a_region() -> None:
    """Padding agents are neither counted nor observed: observations and rewards equal those of the region alone."""
    instance = random_instance(Family(agents=40, tasks=6), 2)
    plan = np.array([0, 1, 2, *[3, 4, 5] * 12, IDLE])
    tasks, agents = np.array([[0, 1, 2], [3, 4, 5]]), [np.array([0, 1, 2, 39]), np.arange(3, 39)]
    both = lay_out_regions(instance, 1.0, plan, tasks, agents).board[torch.tensor([0])]
    alone = lay_out_regions(instance, 1.0, plan, tasks[:1], agents[:1]).board
    assert both.shape[1] == 9 * alone.shape[1]
    there, here = reset(both), reset(alone)
    torch.testing.assert_close(observe_tasks(both, there), observe_tasks(alone, here))
    torch.testing.assert_close(observe_agents(both, there)[:, :4], observe_agents(alone, here))
    torch.testing.assert_close(mean_distance(both, there), mean_distance(alone, here))
    torch.testing.assert_close(utility(both, there), utility(alone, here))
