"""Prices and penalties met before: a better plan has no group that costs too much at any of them."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from alloc.allocators.exact.energy.energy_model import EnergyModel, Mask
from alloc.allocators.exact.knapsack import WholeArray
from alloc.problems.instance import FloatArray, IntArray

MOST_KNOWN, MOST_CELLS = 40, 2_000_000
"""Prices kept, and cells of all their tables, at the most."""


@dataclass(frozen=True, eq=False)
class Prices:
    """What groups cost at some prices and penalties.

    Attributes
    ----------
    paid : ndarray, shape (t, k)
        What an agent of each class costs on each task with its price and the cuts of clusters.
    penalty : ndarray, shape (c,)
        Of each cut.
    value : float
        The bound.
    least : ndarray, shape (t,)
        What any group of each task costs at least.
    """

    paid: FloatArray
    penalty: FloatArray
    value: float
    least: FloatArray


class KnownPrices:
    """The last prices and penalties at which cuts were sought."""

    def __init__(self) -> None:
        self._known: list[Prices] = []

    def note(self, model: EnergyModel, paid: FloatArray, penalty: FloatArray, value: float, least: FloatArray) -> None:
        """Keep prices, given what an agent of each pair costs at them, shape (p,)."""
        table = np.full((len(model.need), len(model.count)), np.inf)
        table[model.task_of_pair, model.class_of_pair] = paid
        self._known.append(Prices(table, penalty.copy(), value, least.copy()))
        del self._known[: -min(MOST_KNOWN, max(1, MOST_CELLS // table.size))]

    def within(
        self, model: EnergyModel, cost: float, task: WholeArray, group: csr_array, used: FloatArray, sets: IntArray
    ) -> Mask:
        """Return which groups a plan that costs less than `cost` can have, shape (g,).

        Parameters
        ----------
        task : ndarray of int, shape (g,)
        group : csr_array, shape (g, p)
            Agents of each pair.
        used : ndarray, shape (g, c)
            What each group uses of each cut.
        sets : ndarray of int
            The cuts over classes, whose penalties no pair pays.
        """
        can = np.ones(len(task), dtype=bool)
        for known in self._known:
            on = sets[sets < len(known.penalty)]
            paid = group @ known.paid[model.task_of_pair, model.class_of_pair] + used[:, on] @ known.penalty[on]
            can &= known.value + paid - known.least[task] <= cost * (1 + 1e-9)
        return can
