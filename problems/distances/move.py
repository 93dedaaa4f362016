"""Price of moving agents away from their current tasks."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alloc.problems.fields import FloatArray, IntArray, ReadOnly


@dataclass(frozen=True, eq=False)
class Move(ReadOnly):
    """Price of assigning agents to other tasks than their current ones.

    Attributes
    ----------
    task : ndarray of int, shape (origins,)
        Current task of the agents of each origin, -1 for idle.
    price : ndarray, shape (origins,)
        Price in units of cost.
    energy_weight : float
        1 if the energy of flights is part of the cost, 0 if only moves are.
    """

    task: IntArray
    price: FloatArray
    energy_weight: float

    def of(self, origin: IntArray, task: IntArray) -> FloatArray:
        """Return the price of each origin for its task; both broadcast."""
        moved: NDArray[np.bool_] = self.task[origin] != task
        return self.price[origin] * moved
