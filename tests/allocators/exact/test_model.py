import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import tiny_instance

from alloc.allocators.exact.cpsat import integer_costs, integer_weights
from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.model import Model
from alloc.allocators.exact.solver_model import SolverLimits, SolverModel
from alloc.problems import Allocation, Instance, agent_classes, evaluate, fewest_unserved

SERVED = [
    seed for seed in range(60) if tiny_instance(seed).workload.any() and fewest_unserved(tiny_instance(seed)) == 0
]


def model_of(instance: Instance, *, by_place: bool = False) -> Model:
    return Model.build(instance, agent_classes(instance, by_place=by_place), int((instance.workload > 0).sum()))


def meets(demand: Demand, counts: np.ndarray) -> bool:
    done = np.bincount(demand.task_of_pair, weights=demand.weight * counts, minlength=len(demand.need))
    return bool((done >= demand.need).all())


@pytest.mark.parametrize("seed", SERVED)
def test_plan_meets_the_demand_from_its_makespan_on(seed):
    """A plan meets the demand at T if and only if its makespan by the evaluator is at most T."""
    instance = tiny_instance(seed)
    plan = Allocation(brute_force(instance).plan)
    makespan = evaluate(instance, plan).makespan
    assert makespan is not None
    model = model_of(instance)
    for factor, expected in ((1.0, True), (1 + 1e-6, True), (1 - 1e-6, False)):
        demand = model.at(makespan * factor)
        assert meets(demand, model.counts(demand, plan)) is expected


@pytest.mark.parametrize("seed", SERVED)
def test_rounding_keeps_every_plan(seed):
    """Plans that meet the demand also meet it in CP-SAT's integers, with no sum near 2^63."""
    instance = tiny_instance(seed)
    best = brute_force(instance)
    model = model_of(instance)
    demand = model.at(best.makespan)
    weight, need = integer_weights(demand)
    done = np.zeros(len(need), dtype=np.int64)
    np.add.at(done, demand.task_of_pair, weight * model.counts(demand, Allocation(best.plan)))
    assert (done >= need).all()
    assert sum(int(w) * int(most) for w, most in zip(weight, demand.max_count, strict=True)) < 2**62


@pytest.mark.parametrize(
    ("ability", "unit"),
    [([2, 4, 6], 2.0), ([0.5, 1.25], 0.25), ([0.1, 0.2, 0.3], 0.1), ([1, np.pi], None), ([1e9, 1e9 + 0.001], None)],
)
def test_common_unit_of_abilities_is_found(ability, unit):
    """Integers and short decimals have a common unit; other numbers, and those with too many digits, have none."""
    found = model_of(Instance(ability=ability, workload=[1])).unit
    assert found is None if unit is None else found == pytest.approx(unit, rel=1e-12)


def test_next_makespan_after_an_excluded_one():
    """With whole abilities and a workload of 12, nothing lies between 12 / 5 and 12 / 4."""
    model = model_of(Instance(ability=[1, 2, 3], workload=[12]))
    assert model.next_makespan(12 / 5) == pytest.approx(3.0, rel=1e-9)
    assert model.next_makespan(2.7) == pytest.approx(3.0, rel=1e-9)


def test_travel_reduces_the_weight():
    """An agent that arrives after half of the time does half of the work; one that arrives too late is of no use."""
    instance = Instance(
        ability=[1, 1, 1],
        workload=[4],
        agent_position=[[0, 0], [2, 0], [9, 0]],
        task_position=[[0, 0]],
        speed=[1, 1, 1],
    )
    assert sorted(model_of(instance).at(4.0).weight.tolist()) == [0.5, 1.0]


def test_all_agents_work_if_no_ability_is_spare():
    """If the demand takes all ability, all agents must work, and no task may get more than its need."""
    demand = model_of(Instance(ability=[1, 1, 2], workload=[2, 2])).at(1.0)
    assert demand.spare == 0
    assert demand.max_weight.tolist() == [2, 2]
    assert demand.min_agents.tolist() == demand.count.tolist()


def test_agents_without_reachable_tasks_are_not_counted():
    """The strongest agent may take no task: it counts neither as ability nor as an agent that must work."""
    demand = model_of(Instance(ability=[5, 1, 1], workload=[1, 1], allowed_tasks=[[], None, None])).at(1.0)
    assert demand.spare == 0
    assert demand.min_agents.tolist() == [2, 0]


def test_times_below_the_lower_bound_are_trivially_infeasible():
    """Below the lower bound, no solver needs to be called."""
    model = model_of(Instance(ability=[1, 1, 2], workload=[2, 2]))
    assert model.at(0.9).trivially_infeasible
    assert not model.at(1.0).trivially_infeasible


def test_costs_are_rounded_down():
    """A bound in CP-SAT's integers is a bound on the true cost, and loses less than 1e-9 of it."""
    demand = model_of(Instance(ability=[1, 2, 3], workload=[3, 3])).at(1.0)
    pairs, rng = len(demand.class_of_pair), np.random.default_rng(0)
    cost, hint = rng.random(pairs), np.ones(pairs, dtype=np.intp)
    model = SolverModel(demand, cost, hint, SolverLimits(seconds=1, threads=1, seed=0, repeatable=False))
    whole, scale = integer_costs(model)
    assert whole @ hint / scale <= cost @ hint
    assert whole @ hint / scale == pytest.approx(cost @ hint, rel=1e-9)
