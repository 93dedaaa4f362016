"""Enumeration of all groups that tasks can have in plans with makespan T.

At the dual prices of the configuration linear programme, the cheapest groups of all tasks cost nearly as much as all
agents. A group that exceeds the cost of its task's cheapest group by more than the difference is in no plan (reduced
cost fixing). If few groups remain, they are the columns of a set partitioning problem.

References
----------
Baldacci, Christofides and Mingozzi (2008), An exact algorithm for the vehicle routing problem based on the set
partitioning formulation with additional cuts, doi:10.1007/s10107-007-0178-5.
"""

from collections.abc import Callable

import numpy as np

from alloc.allocators.exact.knapsack import WholeArray, fill_table, read_group
from alloc.allocators.exact.makespan.configuration import ConfigurationProgramme, DualPrices
from alloc.allocators.exact.makespan.restricted_master import TaskNeeds
from alloc.allocators.exact.makespan.set_partitioning import SetPartitioning
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

MAX_GROUPS = 60_000
"""Total number of groups above which the set partitioning problem takes too long."""

MAX_NODES = 3_000_000
"""Limit on the nodes of one enumeration, which take some hundredths of a second."""

MAX_CELLS = 20_000_000
"""Number of classes times steps of the need above which groups are not enumerated."""

MAX_GROUP_SIZE = 64
"""Largest number of agents in a group."""


@compiled
def fill_least(weight: WholeArray, price: FloatArray, count: WholeArray, least: FloatArray) -> None:
    """Write the least cost of meeting each need with classes i, i + 1, ...; `least` has shape (k + 1, most + 1)."""
    k, most = len(weight), least.shape[1] - 1
    for i in range(k, -1, -1):
        least[i, 0] = 0.0
        for need in range(1, most + 1):
            least[i, need] = np.inf if i == k else least[i + 1, need]
        if i < k:
            for _ in range(min(count[i], (most + weight[i] - 1) // weight[i])):
                for need in range(most, 0, -1):
                    least[i, need] = min(least[i, need], least[i, max(0, need - weight[i])] + price[i])


@compiled
def list_groups(
    weight: WholeArray,
    price: FloatArray,
    count: WholeArray,
    least: FloatArray,
    limit: float,
    max_nodes: int,
    groups: WholeArray,
) -> int:
    """List the minimal groups that meet a need at a cost of at most `limit`.

    Parameters
    ----------
    weight : ndarray of int64, shape (k,)
        Contribution of one agent of each class, in descending order, all > 0.
    price : ndarray of float64, shape (k,)
        Whole numbers >= 0.
    count : ndarray of int64, shape (k,)
    least : ndarray, shape (k + 1, need + 1)
        As written by `fill_least`; need >= 1.
    groups : ndarray of int64, shape (most, MAX_GROUP_SIZE)
        Output: the classes of the agents in each group, padded with -1.

    Returns
    -------
    int
        Number of groups; -1 if there are too many, or the search tree has more than `max_nodes` nodes.
    """
    k, found, depth = len(weight), 0, 0
    member = np.zeros(MAX_GROUP_SIZE + 1, dtype=np.int64)  # class tried at each depth
    left, cost = np.zeros(MAX_GROUP_SIZE + 1, dtype=np.int64), np.zeros(MAX_GROUP_SIZE + 1)
    used = np.zeros(k, dtype=np.int64)
    left[0] = least.shape[1] - 1
    for _ in range(max_nodes):
        i = member[depth]
        if i == k or cost[depth] + least[i, left[depth]] > limit:  # nor with any later class
            depth -= 1
            if depth < 0:
                return found
            used[member[depth]] -= 1
            member[depth] += 1
            continue
        rest, paid = left[depth] - weight[i], cost[depth] + price[i]
        if used[i] == count[i] or paid + least[i, max(0, rest)] > limit:
            member[depth] += 1
        elif rest > 0:
            if depth == MAX_GROUP_SIZE - 1:
                return -1
            used[i] += 1
            depth += 1
            member[depth], left[depth], cost[depth] = i, rest, paid
        else:
            if found == len(groups):
                return -1
            write_group(groups[found], member, depth + 1)
            found += 1
            member[depth] += 1
    return -1


@compiled
def write_group(row: WholeArray, member: WholeArray, size: int) -> None:
    """Write the first `size` members, padded with -1."""
    for place in range(len(row)):
        row[place] = member[place] if place < size else -1


def enumerate_groups(
    configurations: ConfigurationProgramme, prices: DualPrices, time: float, should_stop: Callable[[], bool]
) -> SetPartitioning | None:
    """Return the set partitioning problem over all groups of plans at T = `time`; None if there are too many."""
    needs, count, price = configurations.needs(time), configurations.count, prices.price
    costs = [configurations.group_costs(each, price) for each in needs]
    cheapest = sum(float(cost[each.need].sum()) for cost, each in zip(costs, needs, strict=True))
    spare = float(price @ count) - cheapest
    found: list[WholeArray] = []
    row_of_group: list[int] = []
    tasks_of_row: list[WholeArray] = []
    total = 0
    for each, cost in zip(needs, costs, strict=True):
        table = _least_costs(each, price, count)
        if table is None:
            return None
        order, least = table
        for need in np.unique(each.need):
            if should_stop():
                return None
            limit = float(cost[need]) + spare
            members = np.empty((MAX_GROUPS - total, MAX_GROUP_SIZE), dtype=np.int64)
            size = list_groups(
                each.weight[order], price[order], count[order], least[:, : need + 1], limit, MAX_NODES, members
            )
            if size < 0:
                return None
            found.append(_count_members(members[:size], order, len(count)))
            row_of_group += [len(tasks_of_row)] * size
            tasks_of_row.append(each.tasks[each.need == need])
            total += size
    return SetPartitioning(np.concatenate(found), np.array(row_of_group, dtype=np.intp), tasks_of_row, count)


def _least_costs(needs: TaskNeeds, price: FloatArray, count: WholeArray) -> tuple[WholeArray, FloatArray] | None:
    """Return the classes by descending weight, and the table of `fill_least` for them; None if it is too large."""
    usable = np.flatnonzero((needs.weight > 0) & (count > 0))
    order = usable[np.argsort(-needs.weight[usable], kind="stable")]
    if len(order) * int(needs.need.max()) > MAX_CELLS:
        return None
    least = np.empty((len(order) + 1, int(needs.need.max()) + 2))[:, :-1]  # a slice: the same type as its parts
    fill_least(needs.weight[order], price[order], count[order], least)
    return order, least


def _count_members(members: WholeArray, order: WholeArray, classes: int) -> WholeArray:
    """Return the agents of each class in each group, shape (p, classes), given members as indices into `order`."""
    groups = np.zeros((len(members), classes), dtype=np.int64)
    line, place = np.nonzero(members >= 0)
    np.add.at(groups, (line, order[members[line, place]]), 1)
    return groups


def compile_loops() -> None:
    """Compile the loops of this module, or load them from the cache, so that they do not delay a run."""
    ones = np.ones(2, dtype=np.int64)
    read_group(fill_table(ones, np.ones(2), ones, 2, False), 2, 1)
    least = np.empty((3, 3))[:, :2]
    fill_least(ones, np.ones(2), ones, least)
    list_groups(ones, np.ones(2), ones, least, 1.0, 1, np.empty((1, MAX_GROUP_SIZE), dtype=np.int64))
