"""When an agent sends: every radio period, or seldom, and then sooner where it has news; compiled."""

from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import IntArray

MOST_SAVED = 3
"""Messages for which an agent saves up periods at the most."""


@compiled_in_place
def is_to_send(periods: int, saved: IntArray, counted: IntArray, news: IntArray, row: int, tick: int) -> bool:
    """Return whether an agent sends now; what is remembered of that is brought up to date.

    Parameters
    ----------
    periods : int
        Radio periods that an agent saves up for each message; 1 to send every period. One message is kept back for when
        it has news.
    saved, counted, news : ndarray of int, shape (agents,)
        Periods saved up to the tick that was counted last, at first those of as many messages as it can save up for;
        whether its order has changed since its last message.
    row : int
        Of the agent in these.
    tick : int
        Periods since hour 0.
    """
    if periods == 1:
        return True
    saved[row] = min(MOST_SAVED * periods, saved[row] + tick - counted[row])
    counted[row] = tick
    if saved[row] < (1 if news[row] else 2) * periods:
        return False
    saved[row] -= periods
    news[row] = 0
    return True
