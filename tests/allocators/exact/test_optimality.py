import numpy as np
import pytest
from oracle import brute_force, least_energy_within
from tiny_instances import tiny_instance

from alloc.allocators import Allocator, Status, StopReason, load, solve
from alloc.problems import Instance, fewest_unserved
from alloc.problems.generate import paper, paper_like


@pytest.fixture(params=["cpsat", "milp"], scope="module")
def exact(request: pytest.FixtureRequest) -> Allocator:
    """Return each exact method."""
    return load(request.param)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Use 60 tiny instances, each with one of the objectives; with --draws, that many with both."""
    if "objective" in metafunc.fixturenames:
        draws = metafunc.config.getoption("--draws")
        cases = [
            pytest.param(seed, goal, marks=[pytest.mark.slow] * (seed >= 24))
            for seed in range(draws or 60)
            for goal in ("makespan", "makespan-energy")
            if draws or (goal == "makespan") == (seed % 3 == 0)
        ]
        metafunc.parametrize(("seed", "objective"), cases)


def test_optimum_matches_brute_force(exact, seed, objective):
    """On tiny instances of every kind, the answer is optimal, or the best partial plan, and proven."""
    instance = tiny_instance(seed)
    best = brute_force(instance)
    result = solve(instance, exact, objective=objective, time_limit_s=60)
    assert result.evaluation is not None
    assert not result.evaluation.violations
    assert result.status is (Status.INFEASIBLE if best.unserved else Status.OPTIMAL)
    assert len(result.evaluation.unserved_tasks) == best.unserved == fewest_unserved(instance)
    assert result.evaluation.served_makespan == pytest.approx(best.makespan, rel=1e-6)
    if objective == "makespan-energy":
        assert result.evaluation.energy == pytest.approx(best.energy, rel=1e-6)


@pytest.mark.parametrize("scenario", [1, 2, 3, 4])
def test_paper_scenarios_are_proven(exact, scenario):
    """T = 1 is proven in each of the paper's scenarios."""
    result = solve(paper(scenario, 7), exact, time_limit_s=30)
    assert (result.status, result.makespan, result.stop_reason) == (Status.OPTIMAL, 1.0, StopReason.PROVEN)


@pytest.mark.parametrize("name", ["cpsat", "milp"])
def test_solver_alone_proves_a_paper_scenario(name):
    """Without the descent, the solver finds the plan with T = 1."""
    exact = type(load(name))(descent=False)
    result = solve(paper(1, 3), exact, time_limit_s=30)
    assert (result.status, result.makespan) == (Status.OPTIMAL, 1.0)
    assert len(result.trace) > 1


@pytest.mark.parametrize("slack", [0.1, 0.5, 3.0])
def test_makespan_slack_is_fully_used(exact, slack):
    """The energy is the least of all plans within the slack, as found by brute force."""
    instance = paper_like(6, 3, 24, 4)
    able = least_energy_within(instance, brute_force(instance).makespan * (1 + slack))
    result = solve(instance, exact, objective="makespan-energy", makespan_slack=slack, time_limit_s=60)
    assert result.status is Status.OPTIMAL
    assert result.energy == pytest.approx(able, rel=1e-6)


def test_makespan_limit_is_fully_used(exact):
    """With a feasible makespan limit, only the energy is minimised; an infeasible one changes nothing."""
    instance = paper_like(6, 3, 24, 4)
    best = brute_force(instance)
    result = solve(instance, exact, objective="makespan-energy", makespan_limit=2.5 * best.makespan, time_limit_s=60)
    assert (result.status, result.makespan_limit) == (Status.OPTIMAL, 2.5 * best.makespan)
    assert result.energy == pytest.approx(least_energy_within(instance, 2.5 * best.makespan), rel=1e-6)
    strict = solve(instance, exact, objective="makespan-energy", makespan_limit=0.5 * best.makespan, time_limit_s=60)
    assert strict.status is Status.OPTIMAL
    assert (strict.makespan, strict.energy) == pytest.approx((best.makespan, best.energy), rel=1e-6)


def test_makespans_a_millionth_apart_are_distinguished(exact):
    """Of two splits that differ by 1.5e-6 relative, the better one is found."""
    instance = Instance(ability=[1.0, 1.0000015, 0.5, 0.4999985], workload=[1.5, 1.5])
    result = solve(instance, exact, time_limit_s=30)
    best = brute_force(instance)
    assert result.makespan == pytest.approx(best.makespan, rel=1e-9)
    assert result.status is Status.OPTIMAL


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_units_do_not_matter(exact, scale):
    """Workloads in units a billion times as large or small give the same plan, with scaled hours."""
    rng = np.random.default_rng(5)
    ability, workload = rng.uniform(1, 3, 6), rng.uniform(1, 5, 2)
    plain = solve(Instance(ability=ability, workload=workload), exact, time_limit_s=30)
    other = solve(Instance(ability=ability, workload=workload * scale), exact, time_limit_s=30)
    assert other.status is Status.OPTIMAL
    assert plain.makespan is not None
    assert other.makespan == pytest.approx(plain.makespan * scale, rel=1e-8)


def test_shortage_is_explained(exact):
    """With one agent for three tasks, two of them, already one too many, are named in plain words."""
    instance = Instance(ability=[1, 1], workload=[1, 1, 1, 1], allowed_tasks=[[0, 1, 2], [3]])
    result = solve(instance, exact)
    assert result.status is Status.INFEASIBLE
    assert result.lower_bound is None
    assert any("only 1 agent can take any of the 2 tasks" in note for note in result.notes)


def test_without_workload_all_agents_are_idle(exact):
    """If no task has workload, the idle plan is returned at once."""
    instance = Instance(
        ability=[1, 2], workload=[0, 0], agent_position=[[0, 0], [1, 1]], task_position=[[2, 2], [3, 3]]
    )
    result = solve(instance, exact, objective="makespan-energy")
    assert (result.status, result.makespan, result.energy) == (Status.OPTIMAL, 0.0, 0.0)


def test_solvers_share_a_process():
    """OR-Tools and HiGHS can be called alternately in one process."""
    instance = tiny_instance(3)
    answers = [solve(instance, name).evaluation.served_makespan for name in ("cpsat", "milp", "cpsat", "milp")]
    assert answers == pytest.approx([answers[0]] * 4, rel=1e-6)
