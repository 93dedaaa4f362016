"""The plain model by HiGHS."""

from collections.abc import Sequence

import highspy
import numpy as np

from alloc.allocators.exact.plain.stages import PlainAnswer, Report
from alloc.allocators.exact.solver_model import SolverLimits
from alloc.problems.instance import FloatArray, IntArray
from alloc.problems.models.programme import Programme

TOLERANCE = 1e-9
"""Feasibility and integrality tolerance of HiGHS."""


class PlainHighs:
    """HiGHS on one programme, with default settings except for limits, seed and precision."""

    def __init__(self, programme: Programme, limits: SolverLimits) -> None:
        self._programme, self._limits = programme, limits
        self._highs = highspy.Highs()
        self._highs.HandleUserInterrupt = True

    def solve(self, report: Report) -> PlainAnswer:
        """Solve the programme, and report every plan found."""
        programme, highs = self._programme, self._highs
        self._load()
        highs.cbMipImprovingSolution += lambda event: report(self._pairs(event.data_out.mip_solution))
        highs.solve()
        info = highs.getInfo()
        bound = info.mip_dual_bound if np.isfinite(info.mip_dual_bound) else None
        if bound is not None:  # y is maximised by minimising -y; bounds hold up to the tolerance
            bound = TOLERANCE - bound if programme.is_free else max(0.0, bound * (1 - 10 * TOLERANCE))
        if info.primal_solution_status != highspy.SolutionStatus.kSolutionStatusFeasible:
            return PlainAnswer(bound=bound)
        return PlainAnswer(self._pairs(highs.getSolution().col_value), bound)

    def stop(self) -> None:
        """Request HiGHS to stop."""
        self._highs.cancelSolve()

    def _load(self) -> None:
        programme, highs, matrix = self._programme, self._highs, self._programme.matrix()
        pairs, (rows, columns) = len(programme.kind), matrix.shape
        lp = highspy.HighsLp()
        lp.num_col_, lp.num_row_ = columns, rows
        lp.col_cost_, lp.col_lower_, lp.col_upper_ = self._cost(columns), np.zeros(columns), np.ones(columns)
        need = np.zeros(len(programme.tasks)) if programme.is_free else programme.need
        agents = rows - len(need)
        lp.row_lower_ = np.concatenate([need, np.full(agents, -np.inf)])
        lp.row_upper_ = np.concatenate([np.full(len(need), np.inf), np.ones(agents)])
        lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
        lp.a_matrix_.start_, lp.a_matrix_.index_ = matrix.indptr, matrix.indices
        lp.a_matrix_.value_ = matrix.data
        kinds = highspy.HighsVarType
        lp.integrality_ = [kinds.kInteger] * pairs + [kinds.kContinuous] * (columns - pairs)
        options: dict[str, bool | int | float] = {
            "output_flag": False,
            "random_seed": self._limits.seed % 2**31,
            "threads": self._limits.threads,
        }
        for option in ("mip_feasibility_tolerance", "primal_feasibility_tolerance", "dual_feasibility_tolerance"):
            options[option] = TOLERANCE
        for option, value in {**options, "mip_rel_gap": 1e-7, "mip_abs_gap": 0.0}.items():
            highs.setOptionValue(option, value)
        if np.isfinite(self._limits.seconds):
            highs.setOptionValue("time_limit", self._limits.seconds)
        highs.passModel(lp)

    def _cost(self, columns: int) -> FloatArray:
        programme, cost = self._programme, np.zeros(columns)
        if programme.is_free:
            cost[-1] = -1.0
        elif programme.energy is not None:
            cost[:] = programme.energy
        return cost

    def _pairs(self, solution: Sequence[float]) -> IntArray:
        return np.flatnonzero(np.asarray(solution)[: len(self._programme.kind)] > 0.5)
