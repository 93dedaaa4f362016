"""The price of moving an agent to another task than it has."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alloc.problems.fields import FloatArray, IntArray, ReadOnly


@dataclass(frozen=True, eq=False)
class Move(ReadOnly):
    """What an agent costs that gets another task than it has.

    Attributes
    ----------
    task : ndarray of int, shape (origins,)
        The task that the agents of each origin have, -1 where they are idle.
    price : ndarray, shape (origins,)
        In units of cost.
    energy_weight : float
        1 where the energy of flights is part of the cost, 0 where the moves alone are.
    """

    task: IntArray
    price: FloatArray
    energy_weight: float

    def of(self, origin: IntArray, task: IntArray) -> FloatArray:
        """Return what each of these origins pays for the task beside it; both broadcast."""
        moved: NDArray[np.bool_] = self.task[origin] != task
        return self.price[origin] * moved
