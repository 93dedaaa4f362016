"""Noisy list schedules as an initial population."""

from collections.abc import Callable

import numpy as np

from alloc.allocators.heuristic.genetic.encoding import Encoding, Genes
from alloc.problems.instance import FloatArray

CHECK_EVERY = 64
"""Agents between two checks of the clock."""


def list_schedules(
    encoding: Encoding,
    noise: FloatArray,
    distance_weight: FloatArray,
    rng: np.random.Generator,
    stop: Callable[[], bool],
) -> Genes:
    """Build one allocation per row by list scheduling: assign each agent in turn to the task with the lowest W / h.

    Parameters
    ----------
    encoding : Encoding
    noise : ndarray, shape (rows,)
        Standard deviation of the noise on the logarithms of abilities, by which agents are sorted, largest first.
    distance_weight : ndarray, shape (rows,)
        Amount that the mean distance adds to W / h, in units of the final mean of W / h; 0 ignores distances.
    rng : Generator
    stop : callable
        Checked periodically; when it returns true, the remaining agents stay idle.

    Returns
    -------
    ndarray of int, shape (rows, n)
    """
    rows, reach = len(noise), encoding.reach
    genes = np.full((rows, encoding.n), encoding.idle, dtype=np.int32)
    ability, row = encoding.ability, np.arange(rows)
    order = np.argsort(-(np.log(ability[:-1]) + noise[:, None] * rng.standard_normal(genes.shape)), axis=1)
    mean = ability.sum() / encoding.workload.sum()
    coverage = np.zeros((rows, encoding.idle))
    with_distance, all_tasks = bool(distance_weight.any()), len(encoding.tasks) == encoding.instance.m
    for step, agents in enumerate(order.T):
        if step % CHECK_EVERY == 0 and stop():
            break
        origin = reach.origin[agents]
        cost = coverage
        if with_distance:
            flight = reach.cost[origin] if all_tasks else reach.cost[origin][:, encoding.tasks]
            cost = cost + (distance_weight * mean / encoding.mean_cost)[:, None] * flight
        if not encoding.is_complete:
            reachable = reach.mask[origin] if all_tasks else reach.mask[origin][:, encoding.tasks]
            cost = np.where(reachable, cost, np.inf)
        best = cost.argmin(axis=1)
        able = cost[row, best] < np.inf
        coverage[row[able], best[able]] += ability[agents[able]] / encoding.workload[best[able]]
        genes[row[able], agents[able]] = best[able]
    return genes
