"""`solve_async`: awaited runs give the answers of `solve`, and cancelled ones leave nothing behind."""

import asyncio
import random
import threading
import time

import pytest

from alloc.allocators import (
    Allocator,
    InputError,
    Method,
    Proposal,
    Result,
    Search,
    StopReason,
    load,
    registry,
    solve,
    solve_async,
)
from alloc.problems import Instance, paper_like
from alloc.problems.generate import paper

HARD = paper_like(60, 25, 400, seed=1)
"""Too few agents per task for any method to prove the least energy soon."""

LATEST_S = 5.0
"""Seconds by the clock after which a cancelled run has ended even on a busy machine: it must not sleep, either."""


def test_answer_matches_solve() -> None:
    """Two parallel runs give the results of `solve` without blocking the event loop."""

    async def both() -> list[Result]:
        runs = (solve_async(HARD, "ga", iterations=3, time_limit_s=None, seed=seed) for seed in (0, 1))
        return list(await asyncio.gather(*runs))

    for seed, result in enumerate(asyncio.run(both())):
        assert result.allocation == solve(HARD, "ga", iterations=3, time_limit_s=None, seed=seed).allocation


def test_errors_match_solve() -> None:
    """What `solve` raises is raised where the run is awaited."""
    with pytest.raises(InputError, match="there is no method"):
        asyncio.run(solve_async(HARD, "nothing"))


class Exhausted(Allocator):
    """Asks an empty iterator for its next item."""

    method = Method(name="exhausted", summary="")

    def allocate(self, search: Search) -> Proposal:
        return next(iter(()))


def test_stop_iteration_is_raised() -> None:
    """StopIteration, which futures cannot hold, does not leave the caller waiting forever."""
    with pytest.raises(RuntimeError, match="StopIteration") as raised:
        asyncio.run(asyncio.wait_for(solve_async(HARD, Exhausted(), time_limit_s=1), 20))
    assert isinstance(raised.value.__cause__, StopIteration)


def test_improvements_are_reported_in_the_event_loop() -> None:
    """The callback runs in the thread of the event loop; an exception from it ends the run and propagates."""
    seen: list[threading.Thread] = []
    asyncio.run(solve_async(HARD, "local-search", on_improvement=lambda _: seen.append(threading.current_thread()),
                            iterations=5, time_limit_s=None))  # fmt: skip
    assert set(seen) == {threading.current_thread()}

    def enough(_: object) -> None:
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        asyncio.run(solve_async(HARD, "local-search", objective="makespan-energy", on_improvement=enough))


def test_an_exception_from_the_last_improvement_is_not_lost() -> None:
    """An exception from a callback is raised even if the run has already ended."""

    def enough(_: object) -> None:
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        asyncio.run(solve_async(HARD, "greedy", iterations=1, on_improvement=enough))


def test_event_ends_a_run_with_an_answer() -> None:
    """Unlike cancellation, a stop event returns the best allocation so far."""
    stop = threading.Event()
    threading.Timer(0.05, stop.set).start()
    result = asyncio.run(solve_async(HARD, "local-search", objective="makespan-energy", stop=stop, time_limit_s=60))
    assert result.stop_reason is StopReason.INTERRUPTED
    assert result.allocation is not None


async def cancelled_after(instance: Instance, method: object, seconds: float, objective: str) -> float | None:
    """Return how long a run took to end once it was cancelled; None if it had ended before."""
    run = asyncio.create_task(solve_async(instance, method, objective=objective, time_limit_s=60, threads=2))
    await asyncio.sleep(seconds)
    begin, begin_s = time.process_time(), time.monotonic()
    run.cancel()
    try:
        await run
    except asyncio.CancelledError:
        assert time.monotonic() - begin_s < LATEST_S
        return time.process_time() - begin
    return None


def require_ended(before: int) -> None:
    """Wait until no more threads run than `before`: on a busy machine native solvers stop later than their runs."""
    limit = time.monotonic() + LATEST_S
    while threading.active_count() > before:
        assert time.monotonic() < limit, threading.enumerate()
        time.sleep(0.01)


@pytest.mark.parametrize("name", list(registry.BUILT_IN))
def test_cancelled_runs_leave_no_thread(name: str) -> None:
    """Every method ends soon after it is cancelled, and as many threads as before run then.

    Processor time is measured, of which a busy machine takes none; ten times what is promised fails for sure.
    """
    method, before, cancelled = load(name), threading.active_count(), 0
    for seconds in (0.0, 0.03, 0.1):
        late = asyncio.run(cancelled_after(HARD, method, seconds, "makespan-energy"))
        assert late is None or late < 0.5
        cancelled += late is not None
        require_ended(before)
    assert cancelled


@pytest.mark.slow
def test_runs_cancelled_at_random_times_leave_no_thread() -> None:
    """All methods, cancelled at 200 random times on an instance of the paper's size, end and leave no thread."""
    rng, before = random.Random(1), threading.active_count()
    methods = [load(name) for name in registry.BUILT_IN]
    times = []
    for number in range(200):
        objective = rng.choice(["makespan", "makespan-energy"])
        run = cancelled_after(paper(1, seed=number), rng.choice(methods), rng.uniform(0, 0.3), objective)
        late = asyncio.run(run)
        times += [] if late is None else [late]
        require_ended(before)
    assert len(times) >= 50
    assert sorted(times)[-4] < 0.1
