"""Set partitioning: choose one group for each task such that no class of agents is exceeded."""

from collections.abc import Callable
from dataclasses import dataclass

import highspy
import numpy as np
from scipy.sparse import csc_array

from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.exact.solver_model import Verdict
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems.instance import IntArray


@dataclass(frozen=True, eq=False)
class SetPartitioning:
    """The integer programme, in which z_p tasks take group p.

        sum_p z_p = tasks alike of row r, over the groups p for that row;   sum_p agents_pk z_p <= count_k.

    Attributes
    ----------
    groups : ndarray of int64, shape (p, k)
        Agents of each class in each group.
    row : ndarray of int, shape (p,)
        Row of identical tasks that each group is for.
    tasks : list of ndarray of int
        The identical tasks of each row.
    count : ndarray of int64, shape (k,)
    """

    groups: WholeArray
    row: IntArray
    tasks: list[IntArray]
    count: WholeArray


def solve_set_partitioning(
    programme: SetPartitioning, seed: int, should_stop: Callable[[], bool]
) -> tuple[Verdict, WholeArray | None]:
    """Choose a group for each task by HiGHS.

    Returns
    -------
    Verdict
    ndarray of int64, shape (k, t), or None
        Agents of each class on each task of the model, if feasible.
    """
    highs = highspy.Highs()
    highs.HandleUserInterrupt = True
    for option, value in (("output_flag", False), ("parallel", "off"), ("random_seed", seed % 2**31)):
        highs.setOptionValue(option, value)

    def work() -> highspy.HighsModelStatus:
        highs.passModel(_formulate(programme))
        highs.solve()
        return highs.getModelStatus()

    status = run_native(work, should_stop, highs.cancelSolve)
    if status is None:
        return Verdict.UNKNOWN, None
    if status == highspy.HighsModelStatus.kInfeasible:
        return Verdict.INFEASIBLE, None
    if highs.getInfo().primal_solution_status != highspy.SolutionStatus.kSolutionStatusFeasible:
        return Verdict.UNKNOWN, None
    times = np.round(np.asarray(highs.getSolution().col_value)).astype(np.int64)
    return Verdict.FEASIBLE, _table(programme, times)


def _formulate(programme: SetPartitioning) -> highspy.HighsLp:
    p, rows = len(programme.row), len(programme.tasks)
    alike = np.array([len(tasks) for tasks in programme.tasks], dtype=float)
    line, agent_class = np.nonzero(programme.groups)
    row = np.concatenate([programme.row, rows + agent_class])
    value = np.concatenate([np.ones(p), programme.groups[line, agent_class].astype(float)])
    shape = (rows + len(programme.count), p)
    matrix = csc_array((value, (row, np.concatenate([np.arange(p), line]))), shape=shape)
    lp = highspy.HighsLp()
    lp.num_row_, lp.num_col_ = matrix.shape
    lp.col_cost_, lp.col_lower_, lp.col_upper_ = np.zeros(p), np.zeros(p), alike[programme.row]
    lp.row_lower_ = np.concatenate([alike, np.full(len(programme.count), -np.inf)])
    lp.row_upper_ = np.concatenate([alike, programme.count.astype(float)])
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_, lp.a_matrix_.value_ = matrix.indptr, matrix.indices, matrix.data
    lp.integrality_ = [highspy.HighsVarType.kInteger] * p
    return lp


def _table(programme: SetPartitioning, times: WholeArray) -> WholeArray:
    """Distribute the chosen groups, each chosen a number of `times`, to the identical tasks of their rows."""
    table = np.zeros((len(programme.count), sum(len(tasks) for tasks in programme.tasks)), dtype=np.int64)
    free = [list(tasks) for tasks in programme.tasks]
    for group in np.repeat(np.arange(len(times)), times).tolist():
        table[:, free[programme.row[group]].pop()] = programme.groups[group]
    return table
