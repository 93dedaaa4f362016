"""Linear programmes by HiGHS that can be stopped: the solver of `scipy.optimize.linprog`, with the same answers.

scipy cannot stop it, so that a cancelled run would have to wait, or to abandon a thread.
"""

from collections.abc import Callable
from dataclasses import dataclass

import highspy
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from alloc.allocators.runtime.interrupts import run_native

FloatArray = NDArray[np.float64]

DUAL_SIMPLEX = 1


@dataclass(frozen=True, eq=False)
class Optimum:
    """A solution of a linear programme.

    Attributes
    ----------
    value : float
        Objective value.
    x : ndarray, shape (v,)
    multiplier : ndarray, shape (r,)
        Dual value >= 0 of each constraint.
    """

    value: float
    x: FloatArray
    multiplier: FloatArray


def minimise(
    cost: FloatArray,
    matrix: csr_array | csc_array,
    limits: FloatArray,
    *,
    should_stop: Callable[[], bool],
    upper: FloatArray | None = None,
    seconds: float = np.inf,
) -> Optimum | None:
    """Minimise ``cost @ x`` subject to ``matrix @ x <= limits`` and ``0 <= x <= upper``, in a separate thread.

    Parameters
    ----------
    cost : ndarray, shape (v,)
    matrix : sparse array, shape (r, v)
    limits : ndarray, shape (r,)
    should_stop : callable
        Called every 10 ms in the calling thread.
    upper : ndarray, shape (v,), optional
        ``inf`` by default.
    seconds : float
        Time limit.

    Returns
    -------
    Optimum or None
        None if the solver was stopped or ran out of time, or there is no optimum.
    """
    highs = highspy.Highs()
    highs.HandleUserInterrupt = True

    def work() -> Optimum | None:
        _load(highs, cost, csc_array(matrix), limits, upper, seconds)
        highs.solve()
        if highs.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return None
        solution = highs.getSolution()
        multiplier = np.maximum(0.0, -np.asarray(solution.row_dual))
        return Optimum(highs.getInfo().objective_function_value, np.asarray(solution.col_value), multiplier)

    return run_native(work, should_stop, highs.cancelSolve)


def _load(
    highs: highspy.Highs,
    cost: FloatArray,
    matrix: csc_array,
    limits: FloatArray,
    upper: FloatArray | None,
    seconds: float,
) -> None:
    rows, columns = matrix.shape
    lp = highspy.HighsLp()
    lp.num_col_, lp.num_row_ = columns, rows
    lp.col_cost_, lp.col_lower_ = cost, np.zeros(columns)
    lp.col_upper_ = np.full(columns, np.inf) if upper is None else upper
    lp.row_lower_, lp.row_upper_ = np.full(rows, -np.inf), limits
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_, lp.a_matrix_.value_ = matrix.indptr, matrix.indices, matrix.data
    for option, value in (("output_flag", False), ("presolve", "on"), ("simplex_strategy", DUAL_SIMPLEX)):
        highs.setOptionValue(option, value)
    if np.isfinite(seconds):
        highs.setOptionValue("time_limit", seconds)
    highs.passModel(lp)
