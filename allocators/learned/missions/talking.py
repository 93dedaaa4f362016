"""When an agent sends: seldom, and sooner where it has news; compiled."""

from alloc.allocators.runtime.compiled import compiled
from alloc.problems.fields import IntArray

PERIODS = 10
"""Radio periods that an agent saves up for each message; it begins with none."""

MOST_SAVED = 3 * PERIODS
"""Periods that it saves at the most."""

RESERVE = PERIODS
"""Periods that stay saved for news where it sends without any, so that others know that it is there."""


@compiled
def is_to_send(
    saved: IntArray, counted: IntArray, news: IntArray, told: IntArray, row: int, tick: int, tasks: int
) -> bool:
    """Whether an agent sends now; what is remembered of that is brought up to date.

    Parameters
    ----------
    saved, counted, news, told : ndarray of int, shape (agents,)
        Periods saved up to the tick that was counted last; whether its order has changed since its last message, and
        how many open tasks it knew then.
    row : int
        Of the agent in these.
    tick : int
        Periods since hour 0.
    tasks : int
        Open tasks that it knows.
    """
    saved[row] = min(MOST_SAVED, saved[row] + tick - counted[row])
    counted[row] = tick
    has_news = news[row] != 0 or tasks != told[row]
    if saved[row] < PERIODS + (0 if has_news else RESERVE):
        return False
    saved[row] -= PERIODS
    news[row], told[row] = 0, tasks
    return True
