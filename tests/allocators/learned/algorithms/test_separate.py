"""Populations with one network per member: the order of members, shared weights, and breeding."""

import copy

import torch

from alloc.allocators.learned.algorithms.genes import GeneticPpo
from alloc.allocators.learned.algorithms.hyperparameters import GappoParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob
from alloc.allocators.learned.algorithms.separate import SeparateMembers
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.training.curriculum import Curriculum

SMALL = NetworkSize(pair_width=4, task_width=4, heads=1)
GAMES = Curriculum(("paper",), initial_tasks=(3, 3), tasks=(3, 3), max_agents=10, max_pairs=100, games=(2, 2))


def weights(network: ActorCritic) -> torch.Tensor:
    return torch.cat([weight.detach().flatten() for weight in network.parameters()])


def job(seed: int, decisions: int = 1) -> TrainingJob:
    return TrainingJob(seed, decisions, GAMES)


def test_only_the_active_member_learns() -> None:
    """The active member's update keeps the weights of the others, and fills the common buffer."""
    parameters = GappoParameters(genes=3, gene_sigma=0.1)
    learner, shared = SeparateMembers(SMALL, parameters, seed=4), GeneticPpo(SMALL, parameters, seed=4)
    assert shared.train_on(job(1)).decisions == learner.train_on(job(1)).decisions
    before = GeneticPpo(SMALL, parameters, seed=4).policies()
    same = [weights(one).equal(weights(other)) for one, other in zip(learner.policies(), before, strict=True)]
    assert same == [False, True, True]
    assert [len(member.replay) for member in learner.members] == [len(learner.replay)] * 3
    assert len(learner.replay) > 0


def test_fittest_member_comes_first() -> None:
    """After a generation the policy is the member with the highest returns, with all of its weights."""
    learner = SeparateMembers(SMALL, GappoParameters(genes=2, breeding_interval=2, gene_sigma=0.1), seed=4)
    learner.train_on(job(1))
    learner.since[0] = learner.since[0]._replace(reward=-9.0)
    worst = weights(learner.policies()[0])
    learner.train_on(job(2))
    assert learner.since == []
    assert not weights(learner.policy).allclose(worst, atol=0.05)
    assert learner.policies()[0] is learner.policy


def test_restored_population_continues_identically() -> None:
    """Weights, learning rates, the buffer and the returns since the last generation are the state."""
    parameters = GappoParameters(genes=2, breeding_interval=4, gene_sigma=0.1)
    whole, half = SeparateMembers(SMALL, parameters, seed=5), SeparateMembers(SMALL, parameters, seed=0)
    whole.train_on(job(1))
    half.load_state_dict(copy.deepcopy(whole.state_dict()))
    assert whole.train_on(job(2, 200)) == half.train_on(job(2, 200))
    assert weights(whole.policy).equal(weights(half.policy))
