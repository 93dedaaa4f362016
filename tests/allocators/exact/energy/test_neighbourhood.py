"""Neighbourhoods of a plan in which agents on whom it agrees with a mixture of groups stay."""

from dataclasses import replace

import numpy as np
import pytest

from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.exact.energy.neighbourhood import PAUSE, SIZES, InducedSearch, Size, induced_pairs
from alloc.allocators.exact.energy.state import EnergyState
from alloc.allocators.exact.milp import HighsSolver
from alloc.allocators.exact.model import Model
from alloc.problems import Allocation, Instance, Objective, agent_classes


class Sides:
    """Both sides of the gap, of which only the mixture counts."""

    closed = False

    def __init__(self, mixture):
        self.mixture = mixture

    def note_plan(self, plan, cost):
        pass


def crossed() -> EnergyState:
    """Four agents, two at each of two tasks that need two, of whom one of each task is sent to the other one."""
    places = np.array([[0.0, 0.0], [1.0, 0.0]])
    at = np.array([[0.0, 0.1], [0.0, 0.2], [1.0, 0.1], [1.0, 0.2]])
    instance = Instance(ability=np.ones(4), workload=np.full(2, 2.0), agent_position=at, task_position=places)
    search = Search(instance, Objective.MAKESPAN_ENERGY, Budget(60))
    search.submit(Allocation(np.array([0, 1, 0, 1])))
    model = Model.build(instance, agent_classes(instance, by_place=True), 2)
    return EnergyState.begin(search, model, model.at(1.0))


def with_mixture(state: EnergyState, table) -> EnergyState:
    """Set the mixture, given by classes and tasks."""
    mixed = np.asarray(table, dtype=float)[state.demand.class_of_pair, state.demand.task_of_pair]
    return replace(state, primal_dual=Sides(mixed))


def test_agents_with_equal_task_in_plan_and_mixture_are_fixed():
    """The pairs of the plan are always in; of other classes, so are those that the mixture has."""
    agent_class, plan = np.array([0, 0, 1, 1, 1, 2, 2]), np.array([1, 0, 1, 0, 0, 2, 0])
    mixed = np.array([0.95, 0.05, 0.3, 0.69, 0.01, 1.5, 0.5])
    inside = induced_pairs(agent_class, plan, mixed, Size(0.1, 0.02))
    assert inside.tolist() == [True, False, True, True, False, True, True]
    assert induced_pairs(agent_class, plan, mixed, Size(0.01, 0.02))[1]


@pytest.mark.parametrize(
    ("mixture", "cost"),
    [
        ([[1, 0], [0.5, 0.5], [0.5, 0.5], [0, 1]], 0.6),
        ([[1, 0], [0, 1], [0.5, 0.5], [0.5, 0.5]], 0.2 + 2 * np.hypot(1, 0.2)),
    ],
)
def test_best_plan_of_the_neighbourhood_is_found(mixture, cost):
    """Of the two agents that the mixture leaves open, each goes where both cost less; the two others stay."""
    state = with_mixture(crossed(), mixture)
    assert state.cost > cost + 0.05
    InducedSearch().turn(state, HighsSolver())
    assert state.cost == pytest.approx(cost)


def test_neighbourhoods_grow_and_pauses_lengthen_without_improvement():
    """A better plan makes pauses short again."""
    state, induced = with_mixture(crossed(), np.eye(2)[[0, 1, 0, 1]]), InducedSearch()
    assert not induced.is_due(state)
    for _ in range(2 * len(SIZES)):
        induced.turn(state, HighsSolver())
    assert induced._size == len(SIZES) - 1
    assert induced._pause == PAUSE * 2 ** (2 * len(SIZES))
    induced.turn(with_mixture(state, np.full((4, 2), 0.5)), HighsSolver())
    assert induced._pause == PAUSE
