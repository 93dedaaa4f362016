import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import seeds_where, tiny_instance

from alloc.allocators.exact.makespan.repartition.search import RepartitionSearch
from alloc.allocators.exact.model import Model
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.problems import Instance, agent_classes, evaluate, fewest_unserved, machine_covering, serve_all


def some_can_be_served(instance: Instance) -> bool:
    return int((instance.workload > 0).sum()) > fewest_unserved(instance)


@pytest.mark.parametrize("seed", seeds_where(some_can_be_served, 30))
def test_optimum_of_tiny_instances_is_found(seed):
    """On tiny instances of every kind, the optimum is found; tasks that can be served are."""
    instance = tiny_instance(seed)
    best = brute_force(instance)
    start = serve_all(instance, greedy(instance))
    serve = int((instance.workload > 0).sum()) - best.unserved
    search = RepartitionSearch(Model.build(instance, agent_classes(instance, by_place=False), serve), seed)
    search.start(start)
    _, plan = search.run(best.makespan * (1 + 1e-9), lambda: False, max_steps=500)
    score = evaluate(instance, plan)
    assert not score.violations
    assert len(score.unserved_tasks) == best.unserved
    if best.unserved == 0:  # else it does not choose which tasks are left
        assert score.makespan == pytest.approx(best.makespan, rel=1e-8)


def test_found_plans_have_the_target_makespan():
    """The evaluator confirms the makespan of plans reported as found."""
    instance = machine_covering(40, 10, 1, 100, 0, equal=False)
    model = Model.build(instance, agent_classes(instance, by_place=False), 10)
    search = RepartitionSearch(model, 0)
    search.start(greedy(instance))
    time = float(instance.workload.sum() / instance.ability.sum()) * 1.01
    found, plan = search.run(time, lambda: False, max_steps=10_000)
    assert found
    assert evaluate(instance, plan).makespan <= time * (1 + 1e-9)


def test_same_seed_gives_same_plan():
    """Random numbers depend only on the seed."""
    instance = machine_covering(30, 10, 100, 800, 1)
    plans = []
    for _ in range(2):
        search = RepartitionSearch(Model.build(instance, agent_classes(instance, by_place=False), 10), 3)
        search.start(greedy(instance))
        plans.append(search.run(1e-9 + 2.0, lambda: False, max_steps=300)[1])
    assert np.array_equal(plans[0].task_of_agent, plans[1].task_of_agent)
