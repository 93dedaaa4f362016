"""Operators of the genetic algorithm, and the matrix that it works on."""

import numpy as np
import pytest

from alloc.allocators.heuristic.genetic.encoding import Encoding
from alloc.allocators.heuristic.genetic.list_schedules import list_schedules
from alloc.allocators.heuristic.genetic.mutation import MutationParameters, draw_saving_move, mutate
from alloc.allocators.heuristic.genetic.operators import cross_groups, tournament
from alloc.problems import Allocation, Instance, evaluate


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


@pytest.fixture
def instance() -> Instance:
    """Twelve agents, six tasks of which one needs nothing, lists of tasks, places."""
    rng = np.random.default_rng(3)
    return Instance(
        ability=rng.integers(1, 10, 12),
        workload=[9, 0, 14, 5, 20, 7],
        task_position=rng.random((6, 3)),
        agent_position=rng.random((12, 3)),
        allowed_tasks=[None if i % 3 else [i % 6, (i + 2) % 6, (i + 3) % 6] for i in range(12)],
        energy_per_distance=6.0,
    )


def some_genes(encoding: Encoding, rows: int, rng: np.random.Generator) -> np.ndarray:
    """Rows of a valid population, some agents idle."""
    genes = rng.integers(0, encoding.idle + 1, size=(rows, encoding.n)).astype(np.int32)
    return np.where(encoding.allows(np.arange(encoding.n), genes), genes, encoding.idle).astype(np.int32)


def test_objectives_agree_with_the_evaluator(instance: Instance, rng: np.random.Generator) -> None:
    """The objectives of a population equal those of `evaluate` row by row."""
    encoding = Encoding(instance)
    genes = some_genes(encoding, 50, rng)
    objectives = encoding.objectives(genes, target_makespan=1.0)
    for row, (unserved, makespan, energy) in enumerate(
        zip(objectives.unserved, objectives.makespan, objectives.energy, strict=True)
    ):
        score = evaluate(instance, encoding.decode(genes[row]))
        assert not score.violations
        assert (len(score.unserved_tasks), score.served_makespan, score.energy) == pytest.approx(
            (unserved, makespan, energy)
        )


def test_shortfall_matches_hand_calculation() -> None:
    """Groups of 3 and 2 for workloads 6 and 2 have half of the first task as shortfall at T = 1, and none at T = 2."""
    encoding = Encoding(Instance(ability=[3, 2], workload=[6, 2]))
    genes = np.array([[0, 1]], dtype=np.int32)
    assert encoding.objectives(genes, 1.0).shortfall == pytest.approx([0.5])
    assert encoding.objectives(genes, 2.0).shortfall == pytest.approx([0.0])


def test_decoding_inverts_encoding(instance: Instance) -> None:
    """Encoding keeps what is useful; agents on tasks that are not allowed or without workload become idle."""
    encoding = Encoding(instance)
    allocation = Allocation([1, 2, -1, 3, 4, 5, 2, 3, 4, 5, 0, 2])
    back = encoding.decode(encoding.encode(allocation))
    assert back == Allocation([-1, 2, -1, 3, 4, 5, 2, 3, 4, 5, 0, 2])
    assert encoding.encode(Allocation([4] * 12))[0] == encoding.idle  # agent 0 may do 0, 2 and 3 alone


def test_children_inherit_whole_groups(rng: np.random.Generator) -> None:
    """Every gene of a child is a parent's, and some groups equal those of the second parent."""
    one, other = (rng.integers(0, 5, size=(40, 20)).astype(np.int32) for _ in range(2))
    child = cross_groups(one, other, np.full(40, 0.4), rng)
    assert ((child == one) | (child == other)).all()
    whole = [[((child[r] == j) == (other[r] == j)).all() for j in range(5)] for r in range(40)]
    assert np.mean(whole) > 0.4
    assert (child != one).any(axis=1).mean() > 0.5


def test_crossover_share_of_none_and_all(rng: np.random.Generator) -> None:
    """A child without transferred groups equals its first parent; with all of them, its second."""
    one, other = (rng.integers(0, 5, size=(9, 20)).astype(np.int32) for _ in range(2))
    assert (cross_groups(one, other, np.zeros(9), rng) == one).all()
    assert (cross_groups(one, other, np.ones(9), rng) == other).all()


@pytest.mark.parametrize("energy_counts", [False, True])
@pytest.mark.parametrize("pairs", [0.0, 1.0])
def test_mutation_respects_reach(
    instance: Instance, rng: np.random.Generator, energy_counts: bool, pairs: float
) -> None:
    """Mutations assign no agent beyond its reach, and change nearly every row."""
    encoding = Encoding(instance)
    genes = some_genes(encoding, 30, rng)
    before = genes.copy()
    for _ in range(10):
        mutate(genes, 1.0, encoding, rng, energy_counts=energy_counts, parameters=MutationParameters(pairs=pairs))
        assert encoding.allows(np.arange(encoding.n), genes).all()
        assert genes.min() >= 0
        assert genes.max() <= encoding.idle
    assert (genes != before).any(axis=1).mean() > 0.9


def test_mutation_moves_ability_to_shortfalls(rng: np.random.Generator) -> None:
    """One exchange without noise removes a shortfall that one exchange can remove: 5 and 3 for 4 and 4."""
    encoding = Encoding(Instance(ability=[3, 2, 2, 1], workload=[4, 4]))
    genes = np.repeat(np.array([[0, 0, 1, 1]], dtype=np.int32), 50, axis=0)
    parameters = MutationParameters(exchanges=1.0, uniform=0.0, temperature=0.0, pairs=0.0)
    mutate(genes, 1.0, encoding, rng, parameters=parameters)
    assert encoding.objectives(genes, 1.0).shortfall.max() == 0


def test_large_groups_are_sampled(rng: np.random.Generator) -> None:
    """In groups beyond the limit every member may still move."""
    encoding = Encoding(Instance(ability=np.ones(40), workload=[20, 20]))
    touched = np.zeros(40, dtype=bool)
    for _ in range(30):
        genes = np.repeat(np.repeat([[0, 1]], 20, axis=1).astype(np.int32), 20, axis=0)
        before = genes.copy()
        mutate(genes, 1.0, encoding, rng, parameters=MutationParameters(group_cap=4, pairs=0.0, uniform=1.0))
        touched |= (genes != before).any(axis=0)
    assert touched.all()


def test_tournament_prefers_the_first(rng: np.random.Generator) -> None:
    """Of 10, the best wins a tournament of three with probability 1 - 0.9^3 = 0.271, the worst hardly ever."""
    winners = tournament(10, 20_000, rng)
    assert np.mean(winners == 0) == pytest.approx(0.271, abs=0.02)
    assert np.mean(winners == 9) == pytest.approx(0.001, abs=0.002)


def test_randomised_list_schedule_without_noise_is_greedy(instance: Instance, rng: np.random.Generator) -> None:
    """Without noise agents are taken by decreasing ability, each for the lowest W / h: 3, 2, 2, 1 on 5 and 3."""
    encoding = Encoding(Instance(ability=[3, 2, 2, 1], workload=[5, 3]))
    rows = list_schedules(encoding, np.zeros(1), np.zeros(1), rng, lambda: False)
    assert rows.tolist() == [[0, 1, 0, 1]]
    noisy = list_schedules(Encoding(instance), np.full(20, 0.5), np.full(20, 1.0), rng, lambda: False)
    assert Encoding(instance).allows(np.arange(12), noisy).all()
    assert len(np.unique(noisy, axis=0)) > 10


def test_energy_saving_moves_reduce_the_distance() -> None:
    """If energy counts, the sampled agent is nearer to the sampled task than to its own, and can reach it."""
    rng = np.random.default_rng(4)
    instance = Instance(
        ability=np.ones(30),
        workload=np.ones(6),
        agent_position=rng.random((30, 2)),
        task_position=rng.random((6, 2)),
        communication_range=np.full(30, 0.9),
    )
    encoding = Encoding(instance)
    task = np.array([rng.choice(np.flatnonzero(row)) for row in instance.reach.mask[instance.reach.origin]])
    genes = np.tile(task.astype(np.int32), (50, 1))
    giver, to = draw_saving_move(genes, encoding, rng)
    away, new = encoding.cost(giver, task[giver]), encoding.cost(giver, to)
    nearest = np.where(instance.reach.mask, instance.reach.distance, np.inf).min(axis=1)[instance.reach.origin]
    could = nearest[giver] < away
    assert could.any()
    assert (new[could] < away[could]).all()
    assert encoding.allows(giver, to)[could].all()
