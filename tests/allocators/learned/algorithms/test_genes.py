"""Populations in one network: what a gene adds, the order of members, and breeding of genes."""

import copy

import numpy as np
import torch

from alloc.allocators.learned.algorithms.genes import Genes, GeneticPpo
from alloc.allocators.learned.algorithms.hyperparameters import GappoParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, initialised
from alloc.allocators.learned.training.curriculum import Curriculum

SMALL = NetworkSize(pair_width=4, task_width=4, heads=1)
GAMES = Curriculum(("paper",), initial_tasks=(3, 3), tasks=(3, 3), max_agents=10, max_pairs=100, games=(2, 2))


def weights(network: ActorCritic) -> torch.Tensor:
    return torch.cat([weight.detach().flatten() for weight in network.parameters()])


def job(seed: int = 1, decisions: int = 60) -> TrainingJob:
    return TrainingJob(seed, decisions, GAMES)


def test_gene_changes_only_biases_and_is_reversible() -> None:
    """A gene adds only to one-dimensional parameters; expressing the first member restores the first weights."""
    (network,) = initialised(SMALL, 3, 1)
    before = copy.deepcopy(network)
    genes = Genes(network, 3, 0.1, seed=1)
    genes.express(2)
    changed = {name for name, weight in network.named_parameters() if not weight.equal(before.state_dict()[name])}
    assert changed == {name for name, weight in before.named_parameters() if weight.dim() == 1}
    genes.express(0)
    torch.testing.assert_close(weights(network), weights(before))


def test_single_member_learns_exactly_as_ppo() -> None:
    """With one gene the weights equal those of `Ppo` bit by bit."""
    parameters = GappoParameters(genes=1)
    one, other = GeneticPpo(SMALL, parameters, seed=2), Ppo(SMALL, parameters, seed=2)
    assert one.train_on(job()) == other.train_on(job())
    assert weights(one.policy).equal(weights(other.policy))


def test_members_take_turns_and_breed() -> None:
    """Three members share decisions, replay and weights; after a generation the fittest gene comes first."""
    learner = GeneticPpo(SMALL, GappoParameters(genes=3, breeding_interval=3, gene_sigma=0.1), seed=4)
    first = learner.genes.vectors.clone()
    shown: list[int] = []
    plain = learner.genes.express
    learner.genes.express = lambda member: (shown.append(member), plain(member))[1]  # type: ignore[method-assign]
    for seed in range(3):
        learner.train_on(job(seed, decisions=1))
    assert shown[::2] == [0, 1, 2]
    assert learner.since == []
    assert len(learner.replay.state_dict()) == 3
    kept = [bool((learner.genes.vectors == gene).all(1).any()) for gene in first]
    assert sum(kept) >= 2  # the elite


def test_genes_are_constant_without_generations() -> None:
    """With an interval of 0 members take turns, but are not bred."""
    learner = GeneticPpo(SMALL, GappoParameters(genes=2, breeding_interval=0, gene_sigma=0.1), seed=4)
    first = learner.genes.vectors.clone()
    for seed in range(3):
        learner.train_on(job(seed, decisions=1))
    assert learner.genes.vectors.equal(first)
    assert len(learner.since) == 1


def test_fittest_member_is_the_policy() -> None:
    """After a generation the member with the highest returns is expressed, and is the first policy."""
    learner = GeneticPpo(SMALL, GappoParameters(genes=2, breeding_interval=2, gene_sigma=0.1), seed=4)
    best = learner.genes.vectors[1].clone()
    learner.train_on(job(1, decisions=1))
    learner.since[0] = learner.since[0]._replace(reward=-9.0)
    learner.train_on(job(2, decisions=1))
    assert learner.genes.vectors[0].equal(best)
    assert weights(learner.policies()[0]).allclose(weights(learner.policy), atol=1e-6)
    assert not weights(learner.policies()[1]).allclose(weights(learner.policy), atol=1e-4)


def test_restored_population_continues_identically() -> None:
    """Genes and the returns since the last generation are part of the state."""
    parameters = GappoParameters(genes=2, breeding_interval=4, gene_sigma=0.1)
    whole = GeneticPpo(SMALL, parameters, seed=5)
    whole.train_on(job(1, decisions=1))
    half = GeneticPpo(SMALL, parameters, seed=0)
    half.load_state_dict(copy.deepcopy(whole.state_dict()))
    ends = [one.train_on(job(2, decisions=200)) for one in (whole, half)]
    assert ends[0] == ends[1]
    assert np.array_equal(weights(whole.policy).numpy(), weights(half.policy).numpy())
