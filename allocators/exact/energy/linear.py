"""Initial prices of the Lagrangian relaxation by a linear programme of single agents."""

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array, vstack

from alloc.allocators.exact.demand import Demand
from alloc.problems.instance import FloatArray

MAX_PAIRS = 30_000
"""Number of pairs of class and task above which the programme takes too long."""


def class_prices(demand: Demand, cost: FloatArray, seconds: float) -> FloatArray:
    """Return the saving by one more agent of each class, shape (k,); zeros if the programme is not solved in time.

    Parameters
    ----------
    demand : Demand
    cost : ndarray, shape (p,)
        Cost of one agent of each pair.
    seconds : float
        Time limit.
    """
    pairs, tasks, classes = len(cost), len(demand.need), len(demand.count)
    if demand.spare < demand.ability.max() or pairs > MAX_PAIRS or seconds <= 0:
        return np.zeros(classes)  # if nearly all agents must work, prices may have any sign
    columns = np.arange(pairs)
    part = demand.weight / demand.need[demand.task_of_pair]
    share = csr_array((-part, (demand.task_of_pair, columns)), shape=(tasks, pairs))
    used = csr_array((np.ones(pairs), (demand.class_of_pair, columns)), shape=(classes, pairs))
    limits = np.concatenate([-np.ones(tasks), demand.count])
    scale = float(cost.mean()) or 1.0
    answer = linprog(
        cost / scale, vstack([share, used]), limits, method="highs", options={"time_limit": min(seconds, 1e9)}
    )
    if answer.status != 0:
        return np.zeros(classes)
    return np.asarray(np.maximum(0.0, -answer.ineqlin.marginals[tasks:])) * scale
