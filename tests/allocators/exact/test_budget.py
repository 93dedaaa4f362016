import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from alloc.allocators import Allocator, Budget, RefusedError, StopReason, load, solve
from alloc.problems import Instance, Objective
from alloc.problems.generate import paper, paper_like

OVERHEAD_S = 0.5


def hard(n: int = 150, m: int = 50) -> Instance:
    """Return an instance with few agents per task and distinct abilities, which no solver proves within minutes."""
    rng = np.random.default_rng(0)
    return Instance(
        ability=rng.uniform(1, 1000, n),
        workload=rng.uniform(1, 1000, m),
        agent_position=rng.random((n, 3)),
        task_position=rng.random((m, 3)),
    )


@pytest.fixture(params=["cpsat", "milp"], scope="module")
def exact(request: pytest.FixtureRequest) -> Allocator:
    """Return each exact method."""
    return load(request.param)


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["makespan", "makespan-energy"])
def test_time_limit_is_respected_in_both_stages(exact, objective):
    """A run of one second ends in time with a plan and a bound, and the energy stage gets its share."""

    def run():
        begin = time.monotonic()
        result = solve(hard(), exact, objective=objective, time_limit_s=1.0)
        total_s = time.monotonic() - begin  # the linear programmes behind the bounds come on top
        return result, total_s < 1.1 + 2 * OVERHEAD_S and result.runtime_s < 1.1 + OVERHEAD_S

    result, in_time = run()
    assert in_time or run()[1]  # one more try, for a busy machine
    assert result.stop_reason is StopReason.TIME_LIMIT
    assert result.gap is not None
    assert result.gap < 0.02


@pytest.mark.slow
@pytest.mark.parametrize(("objective", "limit_s"), [("makespan", 60.0), ("makespan-energy", 2.0)])
def test_event_ends_a_run_in_native_code(exact, objective, limit_s):
    """Setting the event in the first or the second stage ends the run within a second."""
    delay = 0.5 if objective == "makespan" else 1.5  # the energy gets the last 0.8 s

    def late_s():
        stop = threading.Event()
        threading.Timer(delay, stop.set).start()
        begin = time.monotonic()
        result = solve(hard(), exact, objective=objective, time_limit_s=limit_s, stop=stop)
        assert result.stop_reason is StopReason.INTERRUPTED
        assert result.makespan is not None
        return time.monotonic() - begin - delay

    assert late_s() < 1.0 or late_s() < 1.0  # one more try, for a busy machine


PROGRAMME = """
import sys
sys.path.insert(0, {folder!r})
from test_budget import hard
from alloc.allocators import load, solve
exact, instance = load({method!r}), hard()
solve(instance, exact, time_limit_s=0.01)
for _ in range(2):
    print("READY", flush=True)
    result = solve(instance, exact, time_limit_s=60.0)
    print(result.stop_reason, result.makespan is not None, flush=True)
"""


@pytest.mark.slow
@pytest.mark.parametrize("method", ["cpsat", "milp"])
def test_signals_end_the_run_but_not_the_process(method):
    """After either signal, the best plan is returned soon, and the process continues and exits with status 0."""
    code = PROGRAMME.format(folder=__file__.rpartition("/")[0], method=method)
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for number in (signal.SIGINT, signal.SIGTERM):
            assert process.stdout.readline().strip() == "READY"
            time.sleep(0.8)
            process.send_signal(number)
            begin = time.monotonic()
            assert process.stdout.readline().split() == ["interrupted", "True"]
            assert time.monotonic() - begin < 1.5
        assert process.wait(timeout=10) == 0


def test_iteration_budget_is_reproducible(exact):
    """With a budget of iterations alone, the same seed gives the same answer after the same number of models."""
    instance = hard(14, 4)
    runs = [solve(instance, exact, time_limit_s=None, iterations=3, seed=5) for _ in range(2)]
    assert runs[0].allocation == runs[1].allocation
    assert runs[0].lower_bound == runs[1].lower_bound
    assert [step.makespan for step in runs[0].trace] == [step.makespan for step in runs[1].trace]


def test_zero_iterations_still_give_a_plan(exact):
    """Even if the solver may not be called at all, every task is served."""
    result = solve(paper(1, 0), exact, time_limit_s=None, iterations=0)
    assert result.makespan is not None
    assert result.stop_reason is StopReason.ITERATIONS


def test_zero_time_still_gives_a_plan(exact):
    """With a time limit of zero, every task is served at once."""
    result = solve(paper(1, 0), exact, time_limit_s=0)
    assert result.makespan is not None
    assert result.runtime_s < OVERHEAD_S


def test_warm_start_is_used(exact):
    """An optimal start is kept and proven."""
    best = solve(paper(1, 0), exact)
    again = solve(paper(1, 0), exact, start=best.allocation, objective="makespan")
    assert again.allocation == best.allocation
    assert str(again.status) == "optimal"


def test_target_gap_ends_the_run(exact):
    """A target gap of 5 % is reached by the first plans and ends the run."""
    result = solve(hard(), exact, target_gap=0.05, time_limit_s=30)
    assert result.stop_reason is StopReason.TARGET_GAP
    assert result.gap is not None
    assert result.gap <= 0.05


def test_callback_exceptions_reach_the_caller(exact):
    """Exceptions of `on_improvement` propagate through `solve`, even while a solver runs."""

    def refuse_energy(improvement):
        if len(seen) == 3:
            raise LookupError("enough")
        seen.append(improvement)

    seen: list[object] = []
    with pytest.raises(LookupError, match="enough"):
        solve(
            paper_like(50, 10, 200, 0),
            exact,
            objective="makespan-energy",
            time_limit_s=20,
            on_improvement=refuse_energy,
        )


def test_improvements_are_reported_from_the_calling_thread(exact):
    """Callbacks are made in the thread that called `solve`, although the solver runs in another."""
    threads = set()
    solve(
        paper(1, 0),
        exact,
        objective="makespan-energy",
        time_limit_s=0.5,
        on_improvement=lambda improvement: threads.add(threading.get_ident()),
    )
    assert threads == {threading.get_ident()}


def test_models_too_large_for_the_time_are_refused(exact):
    """The refusal names the size and the largest possible one in that time; with more time it is not refused."""
    instance = hard(1000, 150)
    with pytest.raises(RefusedError, match=r"it takes \d+ pairs of agent class and task within 0.1 s, this has 150000"):
        solve(instance, exact, time_limit_s=0.1)
    assert exact.refusal(instance, Objective.MAKESPAN, Budget(None)) is None


def test_one_object_serves_several_threads(exact):
    """Two threads share the allocator, and both prove their optimum."""
    results = {}

    def run(seed):
        results[seed] = solve(paper(1, seed), exact, objective="makespan", time_limit_s=20)

    threads = [threading.Thread(target=run, args=(seed,)) for seed in (1, 2, 3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [results[seed].makespan for seed in (1, 2, 3)] == [1.0] * 3
