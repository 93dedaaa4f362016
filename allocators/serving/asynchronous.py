"""`solve` for programs with an event loop, as a coroutine that can be cancelled."""

import asyncio
import threading
from collections.abc import Callable
from typing import TypedDict, Unpack

from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.improvement import Improvement
from alloc.allocators.request import Start
from alloc.allocators.result import Result
from alloc.allocators.runtime.interrupts import Cancellation
from alloc.allocators.solve import solve
from alloc.problems import Instance, Objective
from alloc.problems.arguments import event, function

THREAD_NAME = "alloc-async"


class Arguments(TypedDict, total=False):
    """Further arguments of `solve`."""

    objective: Objective | str
    time_limit_s: float | None
    iterations: int | None
    target_gap: float | None
    seed: int
    start: Start | None
    threads: int | None
    makespan_slack: float
    makespan_limit: float | None
    move_price: float
    pins: dict[str, str | None] | None
    parameters: object


async def solve_async(
    instance: Instance,
    method: str | Allocator = "auto",
    *,
    on_improvement: Callable[[Improvement], None] | None = None,
    stop: threading.Event | None = None,
    **arguments: Unpack[Arguments],
) -> Result:
    """Allocate the agents of an instance to its tasks in a separate thread, without blocking the event loop.

    Cancelling the awaiting task ends the run at once: the method stops, including native solvers, and its thread has
    ended when `asyncio.CancelledError` is raised. Signals are left to the program.

    Parameters
    ----------
    instance : Instance
    method : str or Allocator
        Loading a method by name may take seconds, also without blocking the event loop; see `load`.
    on_improvement : callable, optional
        Called in the event loop with every improvement; an exception from it ends the run and propagates.
    stop : threading.Event, optional
        When set, ends the run as the time limit does, with a result.
    **arguments
        As in `solve`.

    Returns
    -------
    Result

    Raises
    ------
    InputError, RefusedError
        As `solve` does.
    RuntimeError
        If the method raises `StopIteration`, which an awaitable cannot raise.
    """
    loop = asyncio.get_running_loop()
    tell = function(on_improvement, "on_improvement")
    cancellation = Cancellation(event(stop, "stop"))
    done: asyncio.Future[Result] = loop.create_future()
    failures: list[BaseException] = []

    def told(improvement: Improvement) -> None:
        try:
            if tell is not None and not failures:
                tell(improvement)
        except BaseException as error:
            failures.append(error)
            cancellation.set()

    def report(improvement: Improvement) -> None:
        loop.call_soon_threadsafe(told, improvement)

    def work() -> None:
        try:
            result = solve(
                instance,
                method,
                on_improvement=None if tell is None else report,
                stop=cancellation,
                handle_signals=False,
                **arguments,
            )
            loop.call_soon_threadsafe(done.set_result, result)
        except StopIteration as error:  # asyncio futures cannot hold it, as it ends a coroutine
            failure = RuntimeError("the method raised StopIteration")
            failure.__cause__ = error
            loop.call_soon_threadsafe(done.set_exception, failure)
        except BaseException as error:
            loop.call_soon_threadsafe(done.set_exception, error)

    thread = threading.Thread(target=work, name=THREAD_NAME, daemon=True)
    thread.start()
    try:
        result = await asyncio.shield(done)
    except BaseException:
        cancellation.set()
        await _ended(done)
        if failures:
            raise failures[0] from None
        raise
    finally:
        thread.join()
    if failures:  # of the last callback, called after the run had ended
        raise failures[0]
    return result


async def _ended(done: "asyncio.Future[Result]") -> None:
    """Wait for the run to end, even if this is cancelled repeatedly."""
    while not done.done():
        try:
            await asyncio.wait([done])
        except asyncio.CancelledError:
            continue
    done.exception()  # marks the exception as retrieved
