import numpy as np
import pytest

from alloc.allocators.exact.makespan.descent import descend
from alloc.allocators.exact.model import Model
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.problems import Instance, agent_classes, evaluate
from alloc.problems.generate import paper


def start(instance: Instance, time: float):
    model = Model.build(instance, agent_classes(instance, by_place=False), instance.m)
    counts = model.classes.tally(greedy(instance))
    return model, model.shares(time), counts, model.classes.count - counts.sum(axis=1)


@pytest.mark.parametrize("scenario", [1, 2, 3, 4])
def test_paper_scenarios_need_no_solver(scenario):
    """From the greedy plan, the descent reaches T = 1 in each of the paper's scenarios."""
    instance = paper(scenario, 11)
    model, share, counts, free = start(instance, 1.0)
    assert evaluate(instance, model.classes.spread(counts)).makespan > 1
    found, reached = descend(share, counts, free, np.random.default_rng(0), kicks=20)
    assert reached
    assert evaluate(instance, model.classes.spread(found)).makespan == 1.0


@pytest.mark.parametrize("seed", range(10))
def test_classes_and_reach_are_respected(seed):
    """The descent never exceeds a class, never assigns agents out of reach, and keeps served tasks served."""
    rng = np.random.default_rng(seed)
    instance = Instance(
        ability=rng.uniform(1, 9, 12),
        workload=rng.uniform(5, 20, 4),
        agent_position=rng.random((12, 3)),
        task_position=rng.random((4, 3)),
        communication_range=np.full(12, 0.8),
    )
    model, share, counts, free = start(instance, 1.0)
    found, _ = descend(share, counts, free, rng, kicks=10)
    assert (found >= 0).all()
    assert (found.sum(axis=1) <= model.classes.count).all()
    assert not found[~model.classes.mask].any()
    assert found.any(axis=0)[counts.any(axis=0)].all()


def test_shortfall_never_grows():
    """If the target makespan is infeasible, the shortfall is at most that of the start."""
    rng = np.random.default_rng(3)
    instance = Instance(ability=rng.uniform(1, 9, 9), workload=rng.uniform(5, 20, 4))
    time = float(instance.workload.sum() / instance.ability.sum())
    _, share, counts, free = start(instance, time)
    found, reached = descend(share, counts, free, rng, kicks=5)

    def shortage(table):
        return float(np.square(np.maximum(0, 1 - (share * table).sum(axis=0))).sum())

    assert not reached
    assert shortage(found) <= shortage(counts)


def test_stops_on_request():
    """A run that is over changes nothing."""
    _, share, counts, free = start(paper(1, 0), 1.0)
    found, reached = descend(share, counts, free, np.random.default_rng(0), kicks=5, should_stop=lambda: True)
    assert not reached
    assert np.array_equal(found, counts)
