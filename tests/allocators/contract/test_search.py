"""Budget, clock and best so far."""

import threading
import time

import pytest

from alloc.allocators import Budget, Improvement, MakespanTolerance, Search, StopReason
from alloc.allocators.contract.search import STANDS
from alloc.problems import Allocation, InputError, Instance, Objective


@pytest.fixture
def instance() -> Instance:
    """Abilities 3, 2, 1 for workloads 4 and 2: T = 1 is possible; flying costs."""
    return Instance(ability=[3, 2, 1], workload=[4, 2], task_position=[[0, 0], [1, 0]], start_task=[0, 0, 0])


def search(instance: Instance, objective: Objective = Objective.MAKESPAN, **limits: float | None) -> Search:
    return Search(instance, objective, Budget(**{"time_limit_s": None, **limits}))


@pytest.mark.parametrize("field", ["time_limit_s", "iterations", "target_gap"])
def test_negative_budgets_are_refused(field: str) -> None:
    """Negative, NaN and infinite budgets are refused; zero and no limit are valid."""
    for wrong in (-1, float("nan"), float("inf")):
        with pytest.raises(InputError):
            Budget(**{field: wrong})
    Budget(**{field: 0})
    Budget(**{field: None})


def test_best_plan_is_kept(instance: Instance) -> None:
    """A better plan replaces the best one, is traced and reported; a worse one is only scored."""
    told: list[Improvement] = []
    run = Search(instance, Objective.MAKESPAN, Budget(None), on_improvement=told.append)
    one, worse, two = Allocation([0, 1, -1]), Allocation([-1, 1, 0]), Allocation([0, 1, 0])
    for allocation in (one, worse, two, one):
        run.submit(allocation)
    assert [step.allocation for step in told] == [one, two]
    assert run.trace == [step.figures for step in told]
    assert run.best is told[-1]
    assert run.best.evaluation.makespan == 1.0
    assert run.gap == 0.0


def test_stop_reasons(instance: Instance) -> None:
    """Each limit ends a run with its own reason; without limits, a run continues until optimality is proven."""
    assert search(instance).stop_reason() is None
    assert search(instance, time_limit_s=0).stop_reason() is StopReason.TIME_LIMIT
    counted = search(instance, iterations=2)
    assert counted.stop_reason() is None
    counted.iteration = 2
    assert counted.stop_reason() is StopReason.ITERATIONS
    near = search(instance, target_gap=0.6)
    near.submit(Allocation([0, 1, -1]))  # T = 4/3: a gap of a quarter
    assert near.stop_reason() is StopReason.TARGET_GAP
    proven = search(instance)
    proven.submit(Allocation([0, 1, 0]))
    assert proven.stop_reason() is StopReason.PROVEN
    assert proven.should_stop()


def test_run_continues_while_energy_may_fall(instance: Instance) -> None:
    """At the least makespan, a run continues while the energy may decrease, that is unless it is 0."""
    run = search(instance, Objective.MAKESPAN_ENERGY)
    run.submit(Allocation([0, 1, 0]))
    assert run.stop_reason() is None
    still = search(Instance(ability=[3, 2, 1], workload=[4, 2]), Objective.MAKESPAN_ENERGY)
    still.submit(Allocation([0, 1, 0]))
    assert still.stop_reason() is StopReason.PROVEN


def test_clock_starts_with_the_run_and_an_event_ends_it(instance: Instance) -> None:
    """The clock starts with the run; an event from outside ends it at once."""
    stop = threading.Event()
    run = Search(instance, Objective.MAKESPAN, Budget(60), stop=stop)
    time.sleep(0.02)
    assert 0.02 <= run.elapsed_s <= 60
    assert run.remaining_s <= 60 - 0.02
    assert search(instance).remaining_s == float("inf")
    stop.set()
    assert run.interrupted
    assert run.stop_reason() is StopReason.INTERRUPTED


def test_bounds_never_decrease(instance: Instance) -> None:
    """A weaker bound changes nothing, and an unserved task keeps the gap at 1."""
    run = search(instance)
    run.raise_bound(0.5)
    assert run.lower_bound == 1.0
    run.raise_bound(1.25)
    assert run.lower_bound == 1.25
    run.submit(Allocation([0, -1, -1]))
    assert run.gap == 1.0


def test_warm_start_is_the_first_incumbent(instance: Instance) -> None:
    """A warm start is the first best."""
    start = Allocation([0, 1, 0])
    run = Search(instance, Objective.MAKESPAN, Budget(), start=start)
    assert run.best is not None
    assert run.best.allocation == start


def test_cheapest_plan_within_slack_is_best(instance: Instance) -> None:
    """Within the slack the cheapest plan is the best, even if a faster one follows."""
    run = Search(instance, Objective.MAKESPAN_ENERGY, Budget(None), tolerance=MakespanTolerance(slack=0.4))
    slow, middle, fast = Allocation([0, 1, -1]), Allocation([0, 0, 1]), Allocation([0, 1, 0])
    for allocation, best in ((slow, slow), (middle, slow), (fast, slow)):
        run.submit(allocation)  # T = 4/3, 2 and 1 for energy 1
        assert run.best is not None
        assert run.best.allocation == best
    assert run.fastest is not None
    assert run.fastest.allocation == fast
    assert run.makespan_limit == pytest.approx(1.4)


def test_second_best_returns_when_the_cheapest_leaves_the_slack() -> None:
    """If the cheapest plan leaves the slack, the second cheapest is the best, not merely the fastest."""
    instance = Instance(ability=[4, 2, 1], workload=[4], task_position=[[3, 0]], agent_position=[[0, 0]] * 2 + [[2, 0]])
    run = Search(instance, Objective.MAKESPAN_ENERGY, Budget(None), tolerance=MakespanTolerance(slack=0.5))
    for plan in ([-1, -1, 0], [-1, 0, -1], [0, -1, -1], [0, 0, 0], [0, -1, 0]):
        run.submit(Allocation(plan))  # T = 4, 2, 1, 4/7, 0.8
    assert [point.makespan for point in run.trace] == pytest.approx([4, 2, 1, 4 / 7, 0.8])
    assert [point.energy for point in run.trace] == [1, 3, 3, 7, 4]
    times = [step.time_s for step in run.trace]
    assert times == sorted(times)


def test_below_the_makespan_limit_energy_decides(instance: Instance) -> None:
    """Up to the limit only the energy counts; beyond it, the makespan."""
    run = Search(instance, Objective.MAKESPAN_ENERGY, Budget(None), tolerance=MakespanTolerance(limit=1.5))
    far, cheap = Allocation([1, 0, 0]), Allocation([0, 1, -1])
    run.submit(far)  # T = 4/3 for energy 1
    assert run.fast_enough
    assert run.makespan_limit == 1.5
    run.submit(cheap)
    assert run.best is not None
    assert run.best.evaluation.energy == 1.0


@pytest.mark.parametrize("wrong", [{"slack": -0.1}, {"slack": float("nan")}, {"limit": 0.0}, {"limit": float("inf")}])
def test_slack_and_limit_are_validated(wrong: dict[str, float]) -> None:
    """Slack must be finite and not negative, a limit finite and positive."""
    with pytest.raises(InputError):
        MakespanTolerance(**wrong)


def test_failing_stage_keeps_the_incumbent(instance: Instance, caplog: pytest.LogCaptureFixture) -> None:
    """With an incumbent, the exception of a stage is logged and noted; without one it is raised."""
    run = Search(instance, Objective.MAKESPAN, Budget())
    with pytest.raises(ZeroDivisionError), run.improving("polishing"):
        raise ZeroDivisionError
    run.submit(Allocation.idle(instance))
    with run.improving("polishing"):
        raise ZeroDivisionError("by nought")
    assert run.notes == [f"polishing failed (ZeroDivisionError: by nought); {STANDS}"]
    assert [record.name for record in caplog.records] == ["alloc"]


def test_callback_exceptions_propagate_through_every_stage(instance: Instance) -> None:
    """An exception of a callback ends the run, even in a stage whose failures are tolerated."""

    def enough(_: object) -> None:
        raise ZeroDivisionError

    run = Search(instance, Objective.MAKESPAN, Budget(), on_improvement=enough)
    with pytest.raises(ZeroDivisionError), run.improving("polishing"):
        run.submit(Allocation.idle(instance))
    with pytest.raises(KeyboardInterrupt), Search(instance, Objective.MAKESPAN, Budget()).improving("polishing"):
        raise KeyboardInterrupt
