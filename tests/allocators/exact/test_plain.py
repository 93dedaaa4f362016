"""The plain model, solved by the solvers alone."""

import numpy as np
import pytest
from oracle import brute_force, least_energy_within
from tiny_instances import tiny_instance

from alloc.allocators import Milp, RefusedError, Status, StopReason, load, solve
from alloc.allocators.exact.plain.cpsat import PlainCpSat
from alloc.allocators.exact.solver_model import SolverLimits
from alloc.problems import Instance, Objective
from alloc.problems.generate import paper_like
from alloc.problems.models.programme import build_programme


@pytest.mark.parametrize("name", ["milp", "cpsat"])
@pytest.mark.parametrize("seed", range(6))
def test_optimum_matches_brute_force(name, seed):
    """The solver alone proves the least makespan, then the least energy at it, for any abilities."""
    instance = tiny_instance(seed)
    if instance.has_travel_time:
        instance = Instance(ability=instance.ability, workload=instance.workload)
    result = solve(instance, name, objective="makespan-energy", parameters={"plain": True})
    best = brute_force(instance)
    assert result.unserved_count == best.unserved
    assert result.served_makespan == pytest.approx(best.makespan, rel=2e-6)
    if result.status is Status.OPTIMAL:
        assert result.energy == pytest.approx(least_energy_within(instance, result.makespan), rel=2e-6, abs=1e-9)
    else:
        assert result.status is Status.INFEASIBLE


@pytest.mark.parametrize("name", ["milp", "cpsat"])
def test_time_limit_ends_the_solver(name):
    """The plain model of a large instance is far from solved in 0.1 s, and the run ends then."""
    result = solve(paper_like(300, 30, 1200, seed=1), load(name, plain=True), time_limit_s=0.1)
    assert result.stop_reason is StopReason.TIME_LIMIT
    assert result.runtime_s < 5
    assert result.parameters == {"plain": True}


def test_a_solver_stopped_at_once_proves_nothing():
    """CP-SAT's initial bound of 0 is not taken as a proof of infeasibility."""
    instance = paper_like(100, 20, 400, seed=1)
    programme = build_programme(instance, by_class=False, objective=Objective.MAKESPAN)
    limits = SolverLimits(threads=1, seed=0, seconds=1e-3, repeatable=False)
    answer = PlainCpSat(programme, limits).solve(lambda pairs: None)
    assert (answer.pairs, answer.bound) == (None, None)


def test_instances_without_a_plain_model_are_refused():
    """Finite speeds, and more pairs than fit a model, are refused beforehand."""
    with pytest.raises(RefusedError, match="finite speeds"):
        solve(Instance(ability=[1.0], workload=[1.0], speed=[1.0]), Milp(plain=True))
    wide = Instance(ability=np.ones(20_000), workload=np.ones(200))
    with pytest.raises(RefusedError, match="pairs of agent and task"):
        solve(wide, Milp(plain=True))


def test_instance_without_work_has_the_idle_plan():
    """An instance without work has the idle plan."""
    assert solve(Instance(ability=[1.0], workload=[0.0]), Milp(plain=True)).makespan == 0
