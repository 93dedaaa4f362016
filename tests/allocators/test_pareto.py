"""The front of makespan against energy."""

import threading

import numpy as np
import pytest
from oracle import brute_force, least_energy_within

from alloc.allocators import RefusedError, Result, Status
from alloc.allocators.pareto import pareto, slowest
from alloc.problems import Allocation, InputError, Instance, evaluate, paper_like


@pytest.fixture(scope="module")
def instance() -> Instance:
    """Six agents, three tasks: few enough to try everything."""
    return paper_like(6, 3, 24, 4)


def test_front_matches_brute_force(instance: Instance) -> None:
    """From the fastest to the cheapest, every point has the least energy within its makespan, and is proven."""
    best = brute_force(instance)
    front = pareto(instance, "milp", points=8, time_limit_s=30)
    assert front.complete
    assert front.points[0].makespan == pytest.approx(best.makespan, rel=1e-6)
    assert front.points[-1].energy == pytest.approx(least_energy_within(instance, slowest(instance)), abs=1e-9)
    assert len(front.points) >= 4
    for point in front.points:
        assert point.makespan is not None
        assert point.status is Status.OPTIMAL
        assert point.energy == pytest.approx(least_energy_within(instance, point.makespan), rel=1e-6, abs=1e-9)
    makespans, energies = zip(*((point.makespan, point.energy) for point in front.points), strict=True)
    assert list(makespans) == sorted(makespans)
    assert list(energies) == sorted(energies, reverse=True)


def test_front_can_be_continued(instance: Instance) -> None:
    """The makespans of the initial front are limits again, and no point gets worse."""
    first = pareto(instance, "milp", points=5, time_limit_s=30)
    known = [point.allocation for point in first.points if point.allocation is not None]
    again = pareto(instance, "milp", points=7, time_limit_s=30, starts=known)
    assert len(again.points) >= len(first.points)
    energies = [point.energy for point in again.points]
    assert energies[0] == pytest.approx(first.points[0].energy)
    for point in first.points:
        assert point.makespan is not None
        within = [other.energy for other in again.points if (other.makespan or 0) <= point.makespan * (1 + 1e-9)]
        assert min(within) <= point.energy * (1 + 1e-9)


def test_stopped_run_keeps_the_front_so_far(instance: Instance) -> None:
    """A stopped run has at least one point, and is marked as incomplete."""
    stop, seen = threading.Event(), []

    def second(result: Result) -> None:
        seen.append(result)
        if len(seen) == 2:
            stop.set()

    front = pareto(instance, "milp", points=9, time_limit_s=30, stop=stop, on_point=second)
    assert not front.complete
    assert len(front.points) == len(seen) == 2


def test_front_is_one_point_without_energy() -> None:
    """If flying costs nothing, the fastest allocation is the only point; also if a task stays unserved."""
    free = Instance(ability=[1, 2, 3], workload=[3, 3])
    assert [point.makespan for point in pareto(free, "milp").points] == [1.0]
    unserved = Instance(ability=[1], workload=[1, 1], task_position=[[0, 0], [1, 1]], agent_position=[[3, 3]])
    assert [point.makespan for point in pareto(unserved, "milp").points] == [None]
    nothing = Instance(ability=[1], workload=[0], task_position=[[0, 0]], agent_position=[[3, 3]])
    assert [point.energy for point in pareto(nothing, "milp").points] == [0.0]


def test_methods_without_slack_are_refused(instance: Instance) -> None:
    """A method that cannot trade time for energy is refused, and a front without points is an error."""
    with pytest.raises(RefusedError, match="slack"):
        pareto(instance, "ga", iterations=1, time_limit_s=None)
    with pytest.raises(InputError, match="points"):
        pareto(instance, points=0)


@pytest.mark.parametrize("seed", range(5))
def test_slowest_makespan_is_an_upper_bound(seed: int) -> None:
    """For any allocation, with and without speeds, the last task is done by then."""
    rng = np.random.default_rng(seed)
    instance = Instance(
        ability=rng.uniform(1, 5, 4),
        workload=rng.uniform(0, 9, 2),
        agent_position=rng.random((4, 2)),
        task_position=rng.random((2, 2)),
        speed=None if seed == 0 else rng.uniform(0.1, 2, 4),
    )
    for _ in range(30):
        makespan = evaluate(instance, Allocation(rng.integers(-1, 2, 4))).makespan
        assert makespan is None or makespan <= slowest(instance) * (1 + 1e-9)
