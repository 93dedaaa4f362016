"""The integer programme that selects one group for each task among those that a better plan may use; by HiGHS.

References
----------
Baldacci, Christofides and Mingozzi (2008), An exact algorithm for the vehicle routing problem based on the set
partitioning formulation with additional cuts, doi:10.1007/s10107-007-0178-5.
"""

from dataclasses import dataclass

import highspy
import numpy as np
from scipy.sparse import csc_array, csr_array, vstack

from alloc.allocators.exact.energy.energy_model import EnergyModel
from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.exact.monitor import SolverMonitor
from alloc.problems.instance import FloatArray

TOLERANCE = 1e-9
"""Feasibility and integrality tolerance of HiGHS."""

PROBING = 2**15
"""Presolve rule that HiGHS is to skip: for a thousand groups or more it takes all the time."""

REPEATABLE_NODES = 5_000
"""Limit of repeatable runs in nodes of the search tree."""


NOTHING_BELOW = (highspy.HighsModelStatus.kInfeasible, highspy.HighsModelStatus.kObjectiveBound)
"""Statuses of HiGHS if no plan costs less than the bound on the objective."""


@dataclass(frozen=True, eq=False)
class GroupProgramme:
    """All groups of plans that cost less than `below`, or some of them.

    Attributes
    ----------
    model : EnergyModel
    below : float
        Upper bound on the cost of plans of interest.
    task : ndarray of int, shape (g,)
        Task of each group.
    group : csr_array of int, shape (g, p)
        Agents of each pair in each group.
    used : csr_array, shape (g, c)
        Coefficients of each group in cuts that all plans satisfy.
    limit : ndarray, shape (c,)
        Right-hand sides of these cuts.
    """

    model: EnergyModel
    below: float
    task: WholeArray
    group: csr_array
    used: csr_array
    limit: FloatArray

    def solve(self, monitor: SolverMonitor, seed: int, *, repeatable: bool) -> tuple[WholeArray | None, float]:
        """Return the best plan found as agents of each pair, shape (p,), or None, and a lower bound on all plans."""
        highs = highspy.Highs()
        highs.HandleUserInterrupt = True
        scale = 1 / max(1e-300, float(np.abs(self.model.cost).mean()))
        options: dict[str, bool | int | float | str] = {
            "output_flag": False, "parallel": "off", "random_seed": seed % 2**31, "mip_rel_gap": 1e-8,
            "mip_abs_gap": 0.0, "mip_feasibility_tolerance": TOLERANCE, "primal_feasibility_tolerance": TOLERANCE,
            "dual_feasibility_tolerance": TOLERANCE, "presolve_rule_off": PROBING,
            "objective_bound": self.below * scale * (1 + TOLERANCE),
        }  # fmt: skip
        if repeatable:
            options["mip_max_nodes"] = REPEATABLE_NODES
        for option, value in options.items():
            highs.setOptionValue(option, value)
        highs.passModel(self._compile(scale))

        def work() -> tuple[WholeArray | None, float]:
            highs.solve()
            info, counts = highs.getInfo(), None
            if highs.getModelStatus() in NOTHING_BELOW:
                return None, self.below
            bound = min(info.mip_dual_bound * (1 - 10 * TOLERANCE), info.mip_dual_bound - TOLERANCE) / scale
            if info.primal_solution_status == highspy.SolutionStatus.kSolutionStatusFeasible:
                picked = np.round(np.asarray(highs.getSolution().col_value)).astype(np.int64)
                counts = np.asarray(self.group.T @ picked)
            return counts, min(self.below, bound) if np.isfinite(bound) else 0.0

        return monitor.run(work, highs.cancelSolve) or (None, 0.0)

    def _compile(self, scale: float) -> highspy.HighsLp:
        """Return the programme for HiGHS, with a row for each task, then each class, then each cut."""
        model, groups, tasks = self.model, len(self.task), len(self.model.need)
        columns = np.arange(groups)
        of_task = csr_array((np.ones(groups), (self.task, columns)), shape=(tasks, groups))
        matrix = csc_array(vstack([of_task, model.by_class(self.group).T, self.used.T]))
        lp = highspy.HighsLp()
        lp.num_row_, lp.num_col_ = matrix.shape
        lp.col_cost_, lp.col_lower_, lp.col_upper_ = (
            scale * (self.group @ model.cost),
            np.zeros(groups),
            np.ones(groups),
        )
        least = np.where(model.min_agents > 0, model.min_agents, -highspy.kHighsInf)
        lp.row_lower_ = np.concatenate([np.ones(tasks), least, np.full(len(self.limit), -highspy.kHighsInf)])
        lp.row_upper_ = np.concatenate([np.ones(tasks), model.count, self.limit + TOLERANCE])
        lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
        lp.a_matrix_.start_, lp.a_matrix_.index_ = matrix.indptr, matrix.indices
        lp.a_matrix_.value_ = matrix.data.astype(float)
        lp.integrality_ = [highspy.HighsVarType.kInteger] * groups
        return lp
