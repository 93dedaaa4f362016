"""The evaluator: hand-computed values, and invariants."""

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracle import brute_force
from strategies import allocated, instances, rebuilt

from alloc.problems import (
    Allocation,
    InputError,
    Instance,
    Objective,
    energy_lower_bound,
    evaluate,
    makespan_lower_bound,
)
from alloc.problems.evaluation import completion_time

NAN = float("nan")


def test_scores_match_hand_calculation(line: Instance) -> None:
    """Agents of 2 and 1 do 6 in 2 h without flying; that of 4, on its own task, does 4 in 1 h; the rest is idle."""
    score = evaluate(line, Allocation([0, 0, 1, -1]))
    assert score.completion_time.tolist() == [2.0, 1.0, 0.0]
    assert score.group_ability.tolist() == [3.0, 4.0, 0.0]
    assert score.coverage.tolist() == [-3.0, 0.0, 0.0]
    assert (score.makespan, score.served_makespan, score.unserved_tasks) == (2.0, 2.0, ())
    assert (score.distance, score.energy, score.battery_remaining_percent) == (0.0, 0.0, 100.0)
    assert score.reward == pytest.approx(-(0.5**-3) - 1 - 1)
    assert not score.reward_saturated


def test_flights_match_hand_calculation(line: Instance) -> None:
    """Distances 3 (agent 1), 3 (agent 3, from task 2 back to task 1), 0 (agent 4, whose place is unknown)."""
    score = evaluate(line, Allocation([1, -1, 0, 0]))
    assert score.distance == pytest.approx(6.0)
    assert score.energy == pytest.approx(12.0)
    # agent 1 used 6 of 20; agents 2 and 4 nothing; agent 3 has no battery and does not count
    assert score.battery_remaining_percent == pytest.approx((70 + 100 + 100) / 3)
    assert score.completion_time.tolist() == pytest.approx([6 / 7, 2.0, 0.0])


def test_violations_match_hand_calculation(line: Instance) -> None:
    """Agent 2 has 5 units for a flight of 3 at 2 each: neither its ability nor its flight counts."""
    score = evaluate(line, Allocation([0, 1, -1, -1]))
    assert [(v.agent, v.task) for v in score.violations] == [(1, 1)]
    assert "energy 6 exceeds the battery 5" in score.violations[0].reason
    assert score.unserved_tasks == (1,)
    assert (score.makespan, score.served_makespan, score.energy) == (None, 3.0, 0.0)
    assert score.completion_time[1] == np.inf


@pytest.mark.parametrize(
    ("limits", "reason"),
    [
        ({"allowed_tasks": [[1]]}, "may not do"),
        ({"communication_range": [1.5]}, "exceeds the range 1.5"),
        ({"battery": [1.5]}, "exceeds the battery 1.5"),
        # within the tolerance of the range, so that the battery alone is the reason
        ({"battery": [1.5], "communication_range": [2 - 5e-10]}, "exceeds the battery 1.5"),
    ],
)
def test_reasons_of_violations(limits: dict, reason: str) -> None:
    """Each violated rule has its reason."""
    instance = Instance(ability=[1], workload=[1, 1], agent_position=[[0, 0]], task_position=[[2, 0], [0, 0]], **limits)
    assert reason in evaluate(instance, Allocation([0])).violations[0].reason
    assert not evaluate(instance, Allocation([1])).violations


def test_finite_speeds_match_hand_calculation() -> None:
    """2 per hour from the start and 3 per hour from hour 2 do 10 by hour 3.2; later arrivals add nothing."""
    instance = Instance(
        ability=[2, 3, 50],
        workload=[10],
        task_position=[[0, 0]],
        agent_position=[[0, 0], [4, 0], [9, 0]],
        speed=[1, 2, 1],
    )
    assert evaluate(instance, Allocation([0, 0, 0])).makespan == pytest.approx(3.2)
    assert evaluate(instance, Allocation([0, 0, -1])).makespan == pytest.approx(3.2)
    assert evaluate(instance, Allocation([-1, 0, -1])).makespan == pytest.approx(2 + 10 / 3)


@given(st.lists(st.tuples(st.floats(0.1, 9), st.floats(0, 9)), min_size=1, max_size=6), st.floats(0.1, 50))
def test_work_done_by_the_completion_time_is_the_workload(group: list[tuple[float, float]], workload: float) -> None:
    """At the returned hour, the work done by all agents that have arrived is the workload."""
    ability, arrival = np.array(group).T
    hour = completion_time(workload, ability, arrival)
    assert (ability * np.maximum(0.0, hour - arrival)).sum() == pytest.approx(workload, rel=1e-9)


def test_no_workload() -> None:
    """Without workload the makespan is 0, no agent is needed, and nothing is unserved."""
    score = evaluate(Instance(ability=[1], workload=[0, 0]), Allocation([-1]))
    assert (score.makespan, score.unserved_tasks, score.battery_remaining_percent) == (0.0, (), None)


def test_reward_saturates() -> None:
    """A shortfall of 5000 overflows: the reward is the most negative float and marked as saturated."""
    score = evaluate(Instance(ability=[1], workload=[5000], tau=0.5), Allocation([0]))
    assert (score.reward, score.reward_saturated) == (-sys.float_info.max, True)
    sum_only = evaluate(Instance(ability=[1], workload=[1024.9, 1024.9, 1024.9]), Allocation([-1]))
    assert np.isfinite(sum_only.reward)
    assert sum_only.reward_saturated


def test_large_surplus_gives_zero_reward_without_warning() -> None:
    """tau to a large power is 0."""
    assert evaluate(Instance(ability=[1e6], workload=[1]), Allocation([0])).reward == 0.0


def test_served_tasks_have_finite_completion_times() -> None:
    """Completion times of served tasks are finite for all valid abilities and speeds."""
    slow = Instance(ability=[1e-60], workload=[1e60])
    assert evaluate(slow, Allocation([0])).makespan == pytest.approx(1e120)
    far = Instance(ability=[1], workload=[1], agent_position=[[0, 0]], task_position=[[1e60, 0]], speed=[1e-60])
    assert evaluate(far, Allocation([0])).makespan == pytest.approx(1e120)


@pytest.mark.parametrize("tasks", [[0], [0, 0, 0], [0, 3], [-2, 0]])
def test_wrong_shapes_and_indices_are_errors(tasks: list[int]) -> None:
    """A wrong number of agents, or an invalid task, is an error."""
    with pytest.raises(InputError):
        evaluate(Instance(ability=[1, 1], workload=[1, 1, 1]), Allocation(tasks))


def test_comparison_is_lexicographic() -> None:
    """Unserved tasks take precedence over makespan, and makespan over energy; differences of 1e-9 are ties."""
    instance = Instance(
        ability=[2, 2, 1],
        workload=[4, 2],
        task_position=[[0, 0], [1, 0]],
        start_task=[0, 1, 0],
    )
    home, swapped, one = (evaluate(instance, Allocation(t)) for t in ([0, 1, 0], [1, 0, 0], [0, 0, 0]))
    plain, energy = Objective.MAKESPAN, Objective.MAKESPAN_ENERGY
    assert one.served_makespan < home.served_makespan
    assert home.is_better_than(one, plain)
    assert not home.is_better_than(swapped, plain)
    assert home.is_better_than(swapped, energy)
    assert not swapped.is_better_than(home, energy)
    nearly = Instance(ability=[2, 2 * (1 + 1e-10)], workload=[4])
    assert not evaluate(nearly, Allocation([-1, 0])).is_better_than(evaluate(nearly, Allocation([0, -1])), plain)


@given(allocated(), st.randoms(use_true_random=False))
def test_scores_are_permutation_invariant(case: tuple[Instance, Allocation], random: object) -> None:
    """Permuted agents and tasks have the same scores."""
    instance, allocation = case
    rng = np.random.default_rng(random.getrandbits(32))
    agents, tasks = rng.permutation(instance.n), rng.permutation(instance.m)
    place = np.append(np.argsort(tasks), -1)
    other = evaluate(rebuilt(instance, agents, tasks), Allocation(place[allocation.task_of_agent[agents]]))
    score = evaluate(instance, allocation)
    assert other.key(Objective.MAKESPAN_ENERGY) == pytest.approx(score.key(Objective.MAKESPAN_ENERGY))
    assert other.reward == pytest.approx(score.reward)
    assert len(other.violations) == len(score.violations)


@given(allocated(speeds=False), st.sampled_from([0.25, 3.0, 1e6]))
def test_scaling_workloads_scales_times(case: tuple[Instance, Allocation], scale: float) -> None:
    """Without travel times, c times the workloads take c times as long, with the same energy."""
    instance, allocation = case
    score = evaluate(instance, allocation)
    scaled = evaluate(rebuilt(instance, np.arange(instance.n), np.arange(instance.m), scale), allocation)
    assert scaled.completion_time == pytest.approx(scale * score.completion_time)
    assert scaled.energy == pytest.approx(score.energy)


@given(instances(most_agents=4, most_tasks=3))
def test_scores_match_brute_force(instance: Instance) -> None:
    """The optimal plan of brute force has the scores that brute force computed from the definitions."""
    best = brute_force(instance)
    score = evaluate(instance, Allocation(best.plan))
    assert not score.violations
    assert (len(score.unserved_tasks), score.served_makespan) == pytest.approx((best.unserved, best.makespan))
    assert score.energy == pytest.approx(best.energy)


def test_scores_are_read_only(line: Instance) -> None:
    """Arrays of an evaluation are read-only."""
    score = evaluate(line, Allocation.idle(line))
    with pytest.raises(ValueError, match="read-only"):
        score.completion_time[0] = 0


@pytest.mark.parametrize(
    "fields",
    [
        {"agent_position": [[1e50, 0], [0, 0]], "task_position": [[-1e50, 0], [0, 1]]},
        {"agent_position": [[1e60, 1e60], [0, 0]], "task_position": [[-1e60, 0], [0, 1]], "speed": [1e-60, 1]},
        {"agent_position": [[100, 0], [0, 0]], "task_position": [[0, 0], [0, 1]], "energy_per_distance": 1e60},
    ],
)
def test_scores_and_bounds_stay_finite(fields: dict) -> None:
    """Extreme distances and energies give finite values without warnings."""
    instance = Instance(ability=[1, 2], workload=[1, 2], **fields)
    score = evaluate(instance, Allocation([0, 1]))
    assert score.makespan is not None
    for value in (score.makespan, score.distance, score.energy, makespan_lower_bound(instance)):
        assert 0 < value <= sys.float_info.max
    assert np.isfinite(instance.reach.distance).all()
    bound = energy_lower_bound(instance, score.makespan)
    assert bound is None or 0 <= bound <= score.energy
