"""The population: fitness (12), and breeding by DEAP's operators."""

import copy
import random
from collections.abc import Callable
from typing import Any

import pytest
import torch
from deap import tools

from alloc.allocators.learned.algorithms.gappo import _Genome, _with_generator, breed, fitness
from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, PpoParameters
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.allocators.learned.network.actor_critic import NetworkSize
from alloc.allocators.learned.network.state_dict import StateDict

SMALL = NetworkSize(pair_width=4, task_width=4, heads=1)


def members(count: int) -> list[StateDict]:
    """States of learners with different weights and learning rates."""
    return [
        Ppo(SMALL, PpoParameters(learning_rate=1e-3 * (number + 1)), seed=number).state_dict()
        for number in range(count)
    ]


def weights(member: StateDict) -> torch.Tensor:
    return torch.cat([weight.flatten() for weight in member["network"].values()])


def rate(member: StateDict) -> float:
    return float(member["optimiser"]["param_groups"][0]["lr"])


def test_fitness_matches_hand_calculation() -> None:
    """(12): each term is relative to the largest of the population; the cost is subtracted."""
    parameters = BreedingParameters(return_weight=1.0, entropy_weight=0.5, cost_weight=0.25)
    got = fitness([2.0, 4.0], [1.0, 0.5], [100, 50], parameters)
    assert got == pytest.approx([0.5 + 0.5 - 0.25, 1.0 + 0.25 - 0.125])


def test_elite_passes_unchanged() -> None:
    """The two fittest members are in the next generation unchanged."""
    before = members(4)
    after = breed(before, [0.1, 0.9, 0.5, 0.2], BreedingParameters(), seed=1)
    assert len(after) == 4
    assert after[0] is before[1]
    assert after[1] is before[2]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_small_populations_breed(count: int) -> None:
    """Two members have a child, however large the elite; a single member stays unchanged."""
    before = members(count)
    after = breed(before, list(range(count)), BreedingParameters(elite=5, mutation_probability=1.0), seed=1)
    assert len(after) == count
    assert sum(not any(member is old for old in before) for member in after) == min(1, count - 1)
    assert after[0] is before[-1]


def test_children_without_mutation_lie_between_their_parents() -> None:
    """Crossover blends weights, so that each lies between those of both parents."""
    before = members(3)
    parameters = BreedingParameters(elite=1, crossover_probability=1.0, mutation_probability=0.0)
    everyone = torch.stack([weights(member) for member in before])
    for child in breed(before, [1.0, 2.0, 3.0], parameters, seed=3)[1:]:
        assert (weights(child) >= everyone.amin(0) - 1e-6).all()
        assert (weights(child) <= everyone.amax(0) + 1e-6).all()


def test_mutation_changes_some_weights_and_the_step_size_a_little() -> None:
    """About a tenth of the weights and the learning rate (by a quarter) change; the parent is not modified."""
    before = members(2)
    kept = [weights(member).clone() for member in before]
    rates = [rate(member) for member in before]
    parameters = BreedingParameters(elite=1, crossover_probability=0.0, mutation_probability=1.0)
    child = breed(before, [5.0, 0.0], parameters, seed=5)[1]
    changed = min((weights(child) != old).float().mean().item() for old in kept)
    assert 0.02 < changed < 0.3
    assert min(abs(rate(child) / old - factor) for old in rates for factor in (0.8, 1.25)) < 1e-9
    assert all(torch.equal(weights(member), old) for member, old in zip(before, kept, strict=True))
    assert [rate(member) for member in before] == rates


def test_children_are_loadable_states() -> None:
    """A child has its parent's optimiser and its own weights, and shares no storage with the parent."""
    before = members(2)
    child = breed(before, [1.0, 0.0], BreedingParameters(elite=1, mutation_probability=1.0), seed=0)[1]
    learner = Ppo(SMALL)
    learner.load_state_dict(child)
    assert torch.equal(weights(learner.state_dict()), weights(child))
    assert learner.learning_rate == rate(child)
    held = {weight.untyped_storage().data_ptr() for member in before for weight in member["network"].values()}
    assert not held & {weight.untyped_storage().data_ptr() for weight in child["network"].values()}


def test_breeding_is_seeded_and_leaves_the_global_generator_alone() -> None:
    """The same seed gives the same children, and Python's global generator is not used."""
    random.seed(42)
    expected = random.Random(42).random()
    one = breed(members(4), [1.0, 2.0, 3.0, 4.0], BreedingParameters(), seed=7)
    other = breed(members(4), [1.0, 2.0, 3.0, 4.0], BreedingParameters(), seed=7)
    assert all(torch.equal(weights(a), weights(b)) for a, b in zip(one, other, strict=True))
    assert random.random() == expected


def test_operators_match_deap_with_their_own_generator(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the same seed the outcome equals that of DEAP's operators, without the global generator."""
    parents = [_Genome([float(number), -1.0, 2.5], number, float(number % 3)) for number in range(5)]

    def bred(select: Callable[..., Any], mate: Callable[..., Any], mutate: Callable[..., Any]) -> list[list[float]]:
        one, other = mate(*(copy.deepcopy(genome) for genome in select(parents, 2, tournsize=2)), alpha=0.0)
        return [list(mutate(genome, 0.0, 1.0, 0.5)[0]) for genome in (one, other)]

    operators = (tools.selTournament, tools.cxBlend, tools.mutGaussian)
    random.seed(7)
    expected = bred(*operators)
    for name in ("random", "choice", "gauss"):
        monkeypatch.setattr(random, name, None)
    rng = random.Random(7)
    assert bred(*(_with_generator(rng, operator) for operator in operators)) == expected
