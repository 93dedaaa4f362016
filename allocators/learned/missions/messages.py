"""Compiled rule for when an agent sends a message: in every radio period, or less often and sooner if it has news."""

from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import IntArray

MAX_SAVED = 3
"""Maximum number of messages for which an agent saves up radio periods."""


@compiled_in_place
def should_send(periods: int, saved: IntArray, counted: IntArray, news: IntArray, row: int, tick: int) -> bool:
    """Return whether an agent sends a message now, and update its state.

    Parameters
    ----------
    periods : int
        Number of radio periods that an agent saves up for each message; 1 to send in every period. One message is
        reserved for news.
    saved, counted, news : ndarray of int, shape (agents,)
        Periods saved up, initially for the maximum number of messages; tick until which they are counted; and whether
        the agent's order has changed since its last message.
    row : int
        Index of the agent in these arrays.
    tick : int
        Number of periods since hour 0.
    """
    if periods == 1:
        return True
    saved[row] = min(MAX_SAVED * periods, saved[row] + tick - counted[row])
    counted[row] = tick
    if saved[row] < (1 if news[row] else 2) * periods:
        return False
    saved[row] -= periods
    news[row] = 0
    return True
