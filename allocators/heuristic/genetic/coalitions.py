"""Coalitions of two groups that mutation may exchange, and the costs of the exchanges."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.heuristic.genetic.encoding import BoolArray, Encoding, Genes
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class TwoColumns:
    """Rows, and two columns in each between which agents are exchanged; all of shape (k,)."""

    row: IntArray
    source: IntArray
    target: IntArray


def members(some: Genes, column: IntArray, cap: int, no_agent: int, rng: np.random.Generator) -> IntArray:
    """Return `no_agent`, then up to `cap` members of a group in each row, then -1; shape (k, at most cap + 1)."""
    row, agent = np.nonzero(some == column[:, None])
    size = np.bincount(row, minlength=len(some))
    position = np.arange(len(row)) - (np.cumsum(size) - size)[row]
    most = int(size.max(initial=0))
    if most > cap:
        position = (position + rng.integers(most, size=len(some))[row]) % size[row]
        row, agent, position = row[position < cap], agent[position < cap], position[position < cap]
    table = np.full((len(some), min(most, cap) + 1), -1, dtype=np.intp)
    table[:, 0] = no_agent
    table[row, position + 1] = agent
    return table


def coalitions(agents: IntArray, pairs: bool) -> IntArray:
    """Return all coalitions of one member, or of at most two, shape (k, coalitions, 1 or 2); the first is empty."""
    if not pairs:
        return agents[:, :, None]
    one, other = np.triu_indices(agents.shape[1])
    distinct = (one != other) | (one == 0)
    return np.stack([agents[:, one[distinct]], agents[:, other[distinct]]], axis=2)


def exchange_cost(
    givers: IntArray,
    takers: IntArray,
    group: FloatArray,
    demand: FloatArray,
    columns: TwoColumns,
    encoding: Encoding,
    rng: np.random.Generator,
    noise: float,
    distance_weight: float | None,
) -> FloatArray:
    """Return the cost of each exchange, ``inf`` if it is impossible, shape (k, givers, takers).

    The cost is the resulting shortfall of both tasks, relative to their demands, plus exponential noise of a scale up
    to `noise`, plus the weighted distance unless `distance_weight` is None.
    """
    rows, ability = len(givers), encoding.ability
    moved = ability[givers].sum(axis=2)[:, :, None] - ability[takers].sum(axis=2)[:, None, :]
    cost = _shortfall(moved, group, demand, columns)
    scale = noise * rng.random((rows, 1, 1))
    cost += scale * rng.standard_exponential(cost.shape)
    if distance_weight is not None:
        weight = distance_weight / encoding.mean_cost * rng.random((rows, 1, 1)) ** 2
        cost += weight * _added_cost(givers, takers, columns, encoding)
    cost[~_is_possible(givers, takers, columns, encoding)] = np.inf
    return cost


def _shortfall(moved: FloatArray, group: FloatArray, demand: FloatArray, columns: TwoColumns) -> FloatArray:
    """Return the shortfall of both tasks, relative to their demands, after the ability `moved` has changed groups."""
    shortfall: FloatArray = np.zeros(moved.shape)
    mean = demand[:-1].mean()
    for column, sign in ((columns.source, -1.0), (columns.target, 1.0)):
        need = demand[column]
        scale = np.where(need > 0, need, mean)[:, None, None]
        excess = (group[columns.row, column] - need)[:, None, None]
        shortfall += np.maximum(0.0, -(excess + sign * moved)) / scale
    return shortfall


def _added_cost(givers: IntArray, takers: IntArray, columns: TwoColumns, encoding: Encoding) -> FloatArray:
    """Return the distance that each exchange adds."""
    source, target = columns.source[:, None, None], columns.target[:, None, None]
    going = (encoding.cost(givers, target) - encoding.cost(givers, source)).sum(axis=2)
    coming = (encoding.cost(takers, source) - encoding.cost(takers, target)).sum(axis=2)
    added: FloatArray = going[:, :, None] + coming[:, None, :]
    return added


def _is_possible(givers: IntArray, takers: IntArray, columns: TwoColumns, encoding: Encoding) -> BoolArray:
    """Return whether both coalitions exist, can reach their tasks, and are not both empty."""
    going = np.all(encoding.allows(givers, columns.target[:, None, None]) & (givers >= 0), axis=2)
    coming = np.all(encoding.allows(takers, columns.source[:, None, None]) & (takers >= 0), axis=2)
    possible: BoolArray = going[:, :, None] & coming[:, None, :]
    possible[:, 0, 0] = False
    return possible
