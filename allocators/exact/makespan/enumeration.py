"""All groups that a task could have in any plan with makespan T, and which of them together make a plan.

With the prices of the configuration linear programme all agents cost a known sum, and the cheapest groups of all tasks
cost nearly as much. So a group that costs more than the cheapest one of its task and what is left over is in no plan
(reduced cost fixing). Where few are left, a plan is a choice among them, by an integer programme, or there is none.

References
----------
Baldacci, Christofides and Mingozzi (2008), An exact algorithm for the vehicle routing problem based on the set
partitioning formulation with additional cuts, doi:10.1007/s10107-007-0178-5.
"""

from collections.abc import Callable
from dataclasses import dataclass

import highspy
import numpy as np
from scipy.sparse import csc_array

from alloc.allocators.exact.makespan.configuration import Configurations, Prices
from alloc.allocators.exact.makespan.patterns import WholeArray, fill_table, read_group
from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems.instance import FloatArray, IntArray

MOST_GROUPS = 60_000
"""Groups in all beyond which the integer programme takes too long."""

MOST_NODES = 3_000_000
"""Nodes of one enumeration, some hundredths of a second."""

MOST_CELLS = 20_000_000
"""Classes times steps of the need beyond which groups are not enumerated."""

LONGEST = 64
"""Agents in a group at the most."""


@compiled
def fill_least(weight: WholeArray, price: FloatArray, count: WholeArray, least: FloatArray) -> None:
    """Write the least cost of every need covered by the classes from each one on; `least` is (k + 1, most + 1)."""
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
    most_nodes: int,
    groups: WholeArray,
) -> int:
    """List the groups that cover a need, none of whose agents can be spared, at a cost of at most `limit`.

    Parameters
    ----------
    weight : ndarray of int64, shape (k,)
        What one agent of each class adds, falling, all > 0.
    price : ndarray of float64, shape (k,)
        Whole numbers >= 0.
    count : ndarray of int64, shape (k,)
    least : ndarray, shape (k + 1, need + 1)
        As `fill_least` writes it; need >= 1.
    limit : float
    most_nodes : int
        Nodes of the search tree at which it gives up.
    groups : ndarray of int64, shape (most, LONGEST)
        Gets the classes of the agents in each; -1 where there are no more.

    Returns
    -------
    int
        How many there are, -1 if they are too many.
    """
    k, found, depth = len(weight), 0, 0
    member = np.zeros(LONGEST + 1, dtype=np.int64)  # class tried at each depth
    left, cost = np.zeros(LONGEST + 1, dtype=np.int64), np.zeros(LONGEST + 1)
    used = np.zeros(k, dtype=np.int64)
    left[0] = least.shape[1] - 1
    for _ in range(most_nodes):
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
            if depth == LONGEST - 1:
                return -1
            used[i] += 1
            depth += 1
            member[depth], left[depth], cost[depth] = i, rest, paid
        else:
            if found == len(groups):
                return -1
            for place in range(LONGEST):
                groups[found, place] = member[place] if place <= depth else -1
            found += 1
            member[depth] += 1
    return -1


@dataclass(frozen=True, eq=False)
class Choice:
    """The integer programme: a group for each task.

    Attributes
    ----------
    groups : ndarray of int64, shape (p, k)
        Agents of each class in each group.
    row : ndarray of int, shape (p,)
        Row of tasks alike that each group is for.
    tasks : list of ndarray of int
        Tasks alike, per row.
    count : ndarray of int64, shape (k,)
    """

    groups: WholeArray
    row: IntArray
    tasks: list[IntArray]
    count: WholeArray


def enumerate_groups(
    configurations: Configurations, prices: Prices, time: float, should_stop: Callable[[], bool]
) -> Choice | None:
    """Return the groups that can be part of a plan at T = `time`; None if they are too many."""
    every, count, price = configurations.needs(time), configurations.count, prices.price
    spare = float(price @ count) - sum(float(configurations.costs(each, price)[each.need].sum()) for each in every)
    found: list[WholeArray] = []
    rows: list[int] = []
    tasks: list[IntArray] = []
    total = 0
    for each in every:
        costs = configurations.costs(each, price)
        able = np.flatnonzero((each.weight > 0) & (count > 0))
        order = able[np.argsort(-each.weight[able], kind="stable")]
        if len(order) * int(each.need.max()) > MOST_CELLS:
            return None
        least = np.empty((len(order) + 1, int(each.need.max()) + 1))
        fill_least(each.weight[order], price[order], count[order], least)
        for need in np.unique(each.need):
            if should_stop():
                return None
            limit = float(costs[need]) + spare
            members = np.empty((MOST_GROUPS - total, LONGEST), dtype=np.int64)
            size = list_groups(
                each.weight[order], price[order], count[order], least[:, : need + 1], limit, MOST_NODES, members
            )
            if size < 0:
                return None
            groups = np.zeros((size, len(count)), dtype=np.int64)
            line, place = np.nonzero(members[:size] >= 0)
            np.add.at(groups, (line, order[members[line, place]]), 1)
            found.append(groups)
            rows += [len(tasks)] * len(groups)
            tasks.append(each.tasks[each.need == need])
            total += len(groups)
    return Choice(np.concatenate(found), np.array(rows, dtype=np.intp), tasks, count)


def choose_groups(choice: Choice, seed: int, should_stop: Callable[[], bool]) -> tuple[WholeArray | None, bool]:
    """Choose a group for each task by HiGHS.

    Returns
    -------
    ndarray of int64, shape (k, t), or None
        Agents of each class on each task of the model.
    bool
        Whether there is proven to be no such choice.
    """
    highs = highspy.Highs()
    highs.HandleUserInterrupt = True
    for option, value in (("output_flag", False), ("parallel", "off"), ("random_seed", seed % 2**31)):
        highs.setOptionValue(option, value)

    def work() -> highspy.HighsModelStatus:
        highs.passModel(_programme(choice))
        highs.solve()
        return highs.getModelStatus()

    status = run_native(work, should_stop, highs.cancelSolve)
    if status is None or status == highspy.HighsModelStatus.kInfeasible:
        return None, status is not None
    if highs.getInfo().primal_solution_status != highspy.SolutionStatus.kSolutionStatusFeasible:
        return None, False
    return _table(choice, np.round(np.asarray(highs.getSolution().col_value)).astype(np.int64)), False


def _programme(choice: Choice) -> highspy.HighsLp:
    """State that each task takes a group, and no class more agents than it has."""
    p, rows = len(choice.row), len(choice.tasks)
    alike = np.array([len(tasks) for tasks in choice.tasks], dtype=float)
    line, kind = np.nonzero(choice.groups)
    row = np.concatenate([choice.row, rows + kind])
    value = np.concatenate([np.ones(p), choice.groups[line, kind].astype(float)])
    matrix = csc_array((value, (row, np.concatenate([np.arange(p), line]))), shape=(rows + len(choice.count), p))
    lp = highspy.HighsLp()
    lp.num_row_, lp.num_col_ = matrix.shape
    lp.col_cost_, lp.col_lower_, lp.col_upper_ = np.zeros(p), np.zeros(p), alike[choice.row]
    lp.row_lower_ = np.concatenate([alike, np.full(len(choice.count), -np.inf)])
    lp.row_upper_ = np.concatenate([alike, choice.count.astype(float)])
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_, lp.a_matrix_.value_ = matrix.indptr, matrix.indices, matrix.data
    lp.integrality_ = [highspy.HighsVarType.kInteger] * p
    return lp


def _table(choice: Choice, times: WholeArray) -> WholeArray:
    table = np.zeros((len(choice.count), sum(len(tasks) for tasks in choice.tasks)), dtype=np.int64)
    free = [list(tasks) for tasks in choice.tasks]
    for group in np.repeat(np.arange(len(times)), times).tolist():
        table[:, free[choice.row[group]].pop()] = choice.groups[group]
    return table


def compile_loops() -> None:
    """Compile what this needs, or read it from the cache, so that no run waits for it."""
    ones = np.ones(2, dtype=np.int64)
    read_group(fill_table(ones, np.ones(2), ones, 2, False), 2, 1)
    least = np.empty((3, 3))
    fill_least(ones, np.ones(2), ones, least)
    list_groups(ones, np.ones(2), ones, least[:, :2], 1.0, 1, np.empty((1, LONGEST), dtype=np.int64))
