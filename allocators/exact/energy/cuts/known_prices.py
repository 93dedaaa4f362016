"""Earlier prices and penalties: a better plan uses no group that is too expensive at any of them."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from alloc.allocators.exact.energy.energy_model import EnergyModel, Mask
from alloc.allocators.exact.knapsack import WholeArray
from alloc.problems.instance import FloatArray, IntArray

MAX_KNOWN, MAX_CELLS = 40, 2_000_000
"""Limits on the number of prices kept, and on the cells of all their tables."""


@dataclass(frozen=True, eq=False)
class Prices:
    """Costs of groups at some prices and penalties.

    Attributes
    ----------
    paid : ndarray, shape (t, k)
        Cost of an agent of each class on each task, including its price and the cuts of clusters.
    penalty : ndarray, shape (c,)
        Penalty of each cut.
    value : float
        The lower bound.
    least : ndarray, shape (t,)
        Lower bound on the cost of any group of each task.
    """

    paid: FloatArray
    penalty: FloatArray
    value: float
    least: FloatArray


class KnownPrices:
    """The last prices and penalties at which cuts were separated."""

    def __init__(self) -> None:
        self._known: list[Prices] = []

    def note(self, model: EnergyModel, paid: FloatArray, penalty: FloatArray, value: float, least: FloatArray) -> None:
        """Record prices, given the cost of an agent of each pair at them, shape (p,)."""
        table = np.full((len(model.need), len(model.count)), np.inf)
        table[model.task_of_pair, model.class_of_pair] = paid
        self._known.append(Prices(table, penalty.copy(), value, least.copy()))
        del self._known[: -min(MAX_KNOWN, max(1, MAX_CELLS // table.size))]

    def within(
        self, model: EnergyModel, cost: float, task: WholeArray, group: csr_array, used: FloatArray, sets: IntArray
    ) -> Mask:
        """Return which groups a plan that costs less than `cost` can use, shape (g,).

        Parameters
        ----------
        task : ndarray of int, shape (g,)
        group : csr_array, shape (g, p)
            Agents of each pair.
        used : ndarray, shape (g, c)
            Coefficient of each group in each cut.
        sets : ndarray of int
            The cuts over classes, whose penalties are not part of the costs of pairs.
        """
        can = np.ones(len(task), dtype=bool)
        for known in self._known:
            on = sets[sets < len(known.penalty)]
            paid = group @ known.paid[model.task_of_pair, model.class_of_pair] + used[:, on] @ known.penalty[on]
            can &= known.value + paid - known.least[task] <= cost * (1 + 1e-9)
        return can
