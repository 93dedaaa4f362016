"""The exact method `milp`: mixed-integer programming over classes of agents, formulated in cvxpy, solved by HiGHS.

cvxpy compiles the model; HiGHS is called directly on the compiled arrays, so that it can be interrupted and queried.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cvxpy as cp
import highspy
import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.monitor import SolverMonitor
from alloc.allocators.exact.plain.highs import PlainHighs
from alloc.allocators.exact.solver_model import Answer, SolverModel, Verdict
from alloc.allocators.exact.stages import ExactAllocator
from alloc.problems.bounds import scale_to_one
from alloc.problems.instance import FloatArray, IntArray

TOLERANCE = 1e-9
"""Feasibility and integrality tolerance of HiGHS."""

MAX_UNSCALED = 100_000
"""Integer needs up to this are kept, as HiGHS exploits integrality; rows with larger needs are scaled to 1."""

COST_CAP = 2.0**20
"""Cap on the scaled cost of pairs that cost more than the incumbent plan, to preserve the precision of the others."""

SMALL_WEIGHT, SMALL_WEIGHT_SCALE = 1e-6, 2.0**10
"""Weights below this share of a need would be within the tolerance; then rows are scaled up by the second value."""

SMALLEST_COEFFICIENT = 1e-12
"""Coefficients below this count as 0: the smallest value that HiGHS accepts for this option."""

REPEATABLE_NODES = 5_000
"""Limit of one call in repeatable runs, in nodes of the search tree."""


@dataclass(frozen=True, eq=False)
class CompiledModel:
    """Minimise ``cost @ x`` subject to ``matrix @ x <= limit`` and ``0 <= x <= upper``, x integer.

    Attributes
    ----------
    cost, upper : ndarray, shape (v,)
    matrix : csc_array, shape (r, v)
    limit : ndarray, shape (r,)
    pair_at : ndarray of int, shape (p,)
        Column of each pair.
    """

    cost: FloatArray
    upper: FloatArray
    matrix: csc_array
    limit: FloatArray
    pair_at: IntArray


class HighsSolver:
    """The cvxpy and HiGHS back end."""

    max_pairs = 2_000_000
    pairs_per_second = 200_000

    def solve_model(self, model: SolverModel, monitor: SolverMonitor) -> Answer:
        """Solve `model` by HiGHS."""
        highs = highspy.Highs()
        highs.HandleUserInterrupt = True

        def work() -> Answer:
            compiled = compile_model(model)
            if monitor.stopped.is_set():
                return Answer()
            _load(highs, compiled, model)
            if model.cost is not None:
                highs.cbMipImprovingSolution += lambda event: monitor.report(
                    _counts(event.data_out.mip_solution, compiled)
                )
            highs.solve()
            return _read(highs, compiled, model)

        return monitor.run(work, highs.cancelSolve) or Answer()


class Milp(ExactAllocator):
    """Proven optima by cvxpy and HiGHS.

    References
    ----------
    Huangfu and Hall (2018), Parallelizing the dual revised simplex method, doi:10.1007/s12532-017-0130-5.
    """

    method = BUILT_IN["milp"]
    solver = HighsSolver()
    plain_solver = PlainHighs


def formulate(model: SolverModel) -> tuple[cp.Problem, cp.Variable]:
    """Formulate the model of `exact.model` in cvxpy; the variable returned is x."""
    demand, pairs = model.demand, np.arange(len(model.demand.class_of_pair))
    scale = _row_scale(demand)
    need = demand.need * scale
    weight = demand.weight * (need / demand.need)[demand.task_of_pair]
    weights = csr_array((weight, (demand.task_of_pair, pairs)), shape=(len(need), len(pairs)))
    ones = csr_array((np.ones(len(pairs)), (demand.class_of_pair, pairs)), shape=(len(demand.count), len(pairs)))

    x = cp.Variable(len(pairs), integer=True, bounds=[np.zeros(len(pairs)), demand.max_count.astype(float)])
    done, used = weights @ x, ones @ x
    rows = [used <= demand.count]  # (agents)
    if demand.partial:
        served = cp.Variable(len(need), boolean=True)
        rows += [done >= diags_array(need) @ served, np.ones(len(need)) @ served >= demand.min_served]
    else:
        rows += [done >= need]  # (work)
    if np.isfinite(demand.spare):
        rows += [done <= demand.max_weight * scale, used >= demand.min_agents]
    cost = np.zeros(len(pairs)) if model.cost is None else scaled_costs(model)[0]
    return cp.Problem(cp.Minimize(cost @ x), rows), x


def _row_scale(demand: Demand) -> float | FloatArray:
    """Return the scale of each row of (work) that keeps coefficients well above the tolerance."""
    scale: float | FloatArray = 1.0 if demand.need.max() <= MAX_UNSCALED else 1 / demand.need
    if not demand.integral and demand.weight.min(initial=1.0) < SMALL_WEIGHT:
        scale = SMALL_WEIGHT_SCALE * scale
    return scale


def scaled_costs(model: SolverModel) -> tuple[FloatArray, float]:
    """Return costs scaled such that the incumbent plan costs about 1 per agent, and their scale, a power of two.

    Large costs of pairs that exceed the cost of the incumbent plan are capped: no better plan uses such a pair.
    """
    assert model.cost is not None
    agents = float(model.demand.count.sum())
    known = np.zeros(0) if model.hint is None else model.cost / agents * model.hint
    typical = float(known.sum()) or float(model.cost.max(initial=0.0)) or 1.0
    scale = scale_to_one(typical)
    with np.errstate(over="ignore"):
        return np.minimum(model.cost * scale, max(COST_CAP, typical * agents * scale)), scale


def compile_model(model: SolverModel) -> CompiledModel:
    """Let cvxpy compile the model to arrays."""
    problem, x = formulate(model)
    data, _, _ = problem.get_problem_data(cp.HIGHS)
    upper = np.array(data["upper_bounds"], dtype=float)
    upper[data["bool_vars_idx"]] = 1.0
    first = data["param_prob"].var_id_to_col[x.id]
    return CompiledModel(
        cost=np.asarray(data["c"], dtype=float),
        upper=upper,
        matrix=csc_array(data["A"]),
        limit=np.asarray(data["b"], dtype=float),
        pair_at=first + np.arange(x.size),
    )


def _load(highs: highspy.Highs, compiled: CompiledModel, model: SolverModel) -> None:
    rows, columns = compiled.matrix.shape
    lp = highspy.HighsLp()
    lp.num_col_, lp.num_row_ = columns, rows
    lp.col_cost_, lp.col_lower_, lp.col_upper_ = compiled.cost, np.zeros(columns), compiled.upper
    lp.row_lower_, lp.row_upper_ = np.full(rows, -np.inf), compiled.limit
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_ = compiled.matrix.indptr, compiled.matrix.indices
    lp.a_matrix_.value_ = compiled.matrix.data
    lp.integrality_ = [highspy.HighsVarType.kInteger] * columns
    for option, value in _options(model).items():
        highs.setOptionValue(option, value)
    highs.passModel(lp)
    if model.hint is not None and model.cost is not None and not model.demand.partial:
        highs.setSolution(len(compiled.pair_at), compiled.pair_at.astype(np.int32), model.hint.astype(float))


def _options(model: SolverModel) -> dict[str, bool | int | float | str]:
    options: dict[str, bool | int | float | str] = {
        "output_flag": False,
        "parallel": "off",
        "random_seed": model.limits.seed % 2**31,
        "small_matrix_value": SMALLEST_COEFFICIENT,
        "mip_rel_gap": 1e-8,
        "mip_abs_gap": 0.0,
        "mip_feasibility_tolerance": TOLERANCE,
        "primal_feasibility_tolerance": TOLERANCE,
        "dual_feasibility_tolerance": TOLERANCE,
    }
    if np.isfinite(model.limits.seconds):
        options["time_limit"] = model.limits.seconds
    if model.limits.repeatable:
        options["mip_max_nodes"] = REPEATABLE_NODES
    return options


def _read(highs: highspy.Highs, compiled: CompiledModel, model: SolverModel) -> Answer:
    """Read a solution only if HiGHS reports it as feasible: at a limit without incumbent, it returns zeros."""
    status, info = highs.getModelStatus(), highs.getInfo()
    if status in (highspy.HighsModelStatus.kInfeasible, highspy.HighsModelStatus.kUnboundedOrInfeasible):
        return Answer(Verdict.INFEASIBLE)
    bound = _safe_bound(info.mip_dual_bound, model)
    if info.primal_solution_status != highspy.SolutionStatus.kSolutionStatusFeasible:
        return Answer(bound=bound)
    return Answer(Verdict.FEASIBLE, _counts(highs.getSolution().col_value, compiled), bound)


def _safe_bound(dual_bound: float, model: SolverModel) -> float:
    """Return the bound of HiGHS in unscaled costs, reduced by its tolerances, which add up over agents."""
    if model.cost is None or not np.isfinite(dual_bound):
        return 0.0
    least = min(dual_bound * (1 - 10 * TOLERANCE), dual_bound - TOLERANCE * float(model.demand.count.sum()))
    return max(0.0, least) / scaled_costs(model)[1]


def _counts(solution: Sequence[float], compiled: CompiledModel) -> IntArray:
    return np.round(np.asarray(solution)[compiled.pair_at]).astype(np.intp)
