import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import all_can_be_served, seeds_where, tiny_instance

from alloc.allocators.exact.energy.primal_dual import REPEATABLE_SLICES, PrimalDual
from alloc.allocators.exact.model import Model
from alloc.problems import Allocation, Instance, agent_classes, evaluate
from alloc.problems.generate import paper_like


def primal_dual(instance: Instance, plan: Allocation, makespan: float, seed: int = 0) -> PrimalDual:
    """Return both sides for a plan and a makespan that it meets."""
    model = Model.build(instance, agent_classes(instance, by_place=True), int((instance.workload > 0).sum()))
    return PrimalDual(instance, model, model.at(makespan), plan, seed, 10.0)


def narrowed(sides: PrimalDual, instance: Instance, plan: Allocation) -> Allocation:
    """Run both sides to the end."""
    for number in range(REPEATABLE_SLICES):
        plan = sides.repeat(number) or plan
        sides.note_plan(plan, evaluate(instance, plan).distance)
    return plan


def at_home(agents: int, tasks: int, seed: int) -> tuple[Instance, Allocation]:
    """Return an instance like the paper's, with a plan for T = 1 far from the least energy."""
    rng = np.random.default_rng(seed)
    plan = np.concatenate([np.arange(tasks), rng.integers(0, tasks, agents - tasks)])
    ability = rng.integers(1, 11, agents)
    places = rng.random((tasks, 3))
    instance = Instance(
        ability=ability,
        workload=np.bincount(plan, ability, tasks),
        task_position=places,
        start_task=rng.integers(0, tasks, agents),
    )
    return instance, Allocation(plan)


@pytest.mark.parametrize("seed", seeds_where(all_can_be_served, 30))
def test_bound_never_exceeds_the_optimum_of_brute_force(seed):
    """On tiny instances of every kind, the bound is valid, and plans have the reported cost."""
    instance = tiny_instance(seed)
    best = brute_force(instance)
    assert not best.unserved
    sides = primal_dual(instance, Allocation(best.plan), best.makespan)
    for number in range(5):
        assert sides.repeat(number) is None  # nothing is better than the best
    assert sides.bound * instance.energy_per_distance <= best.energy * (1 + 1e-9)


@pytest.mark.parametrize("slack", [1.0, 1.3])
def test_gap_is_closed_to_a_few_percent(slack):
    """On an instance like the paper's, for T >= 1, the gap is closed to some percent."""
    instance, plan = at_home(40, 8, 1)
    sides = primal_dual(instance, plan, slack)
    before = evaluate(instance, plan)
    plan = narrowed(sides, instance, plan)
    after = evaluate(instance, plan)
    assert after.served_makespan <= slack * (1 + 1e-9)
    assert not after.unserved_tasks
    assert after.energy < 0.5 * before.energy
    assert 0.9 * after.distance <= sides.bound <= after.distance * (1 + 1e-9)


def test_pairs_of_the_best_plan_are_kept():
    """The pairs left for the solver contain the incumbent plan, and are far fewer."""
    instance, plan = at_home(60, 10, 2)
    model = Model.build(instance, agent_classes(instance, by_place=True), instance.m)
    demand = model.at(1.0)
    sides = PrimalDual(instance, model, demand, plan, 0, 10.0)
    plan = narrowed(sides, instance, plan)
    used = np.flatnonzero(model.counts(demand, plan))
    assert set(used) <= set(sides.keep.tolist())
    assert len(sides.keep) < 0.5 * len(demand.class_of_pair)


def test_same_seed_gives_same_plans():
    """With effort counted in rounds, plans and bounds are reproducible."""
    instance = paper_like(60, 10, 240, 0)
    plan = Allocation(np.arange(60) % 10)
    limit = evaluate(instance, plan).served_makespan
    ends = []
    for _ in range(2):
        sides, last = primal_dual(instance, plan, limit), plan
        for number in range(3):
            last = sides.repeat(number) or last
        ends.append((last.task_of_agent.tolist(), sides.bound))
    assert ends[0] == ends[1]


def test_reach_is_respected():
    """Agents are assigned only to tasks that they can take."""
    rng = np.random.default_rng(3)
    places = rng.random((6, 2))
    plan = np.arange(30) % 6
    lists = [sorted({int(plan[i]), int(rng.integers(6)), int(rng.integers(6))}) for i in range(30)]
    instance = Instance(
        ability=rng.integers(1, 6, 30),
        workload=np.full(6, 10.0),
        agent_position=rng.random((30, 2)),
        task_position=places,
        allowed_tasks=lists,
    )
    limit = evaluate(instance, Allocation(plan)).served_makespan
    sides = primal_dual(instance, Allocation(plan), limit)
    found = sides.repeat(0)
    assert found is not None
    score = evaluate(instance, found)
    assert not score.violations
    assert score.served_makespan <= limit * (1 + 1e-9)
