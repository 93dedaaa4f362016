"""Exact by mixed-integer programming: stated in cvxpy over classes of agents, solved by HiGHS.

cvxpy compiles the model; HiGHS then gets the compiled arrays, as only so can it be halted and asked for what it found.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cvxpy as cp
import highspy
import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from alloc.allocators.exact.solver_model import UNKNOWN, Answer, Question, Watch
from alloc.allocators.exact.stages import ExactAllocator
from alloc.allocators.registry import BUILT_IN
from alloc.problems.bounds import scale_to_one
from alloc.problems.instance import FloatArray, IntArray

TOLERANCE = 1e-9
"""How far HiGHS may be off a row or an integer."""

SMALL_WHOLE = 100_000
"""Needs up to this are left in whole numbers, which HiGHS makes use of; rows with larger ones are scaled to 1."""

DEAREST = 2.0**20
"""Scaled cost to which pairs are cut that are dearer than the plan at hand, lest they blur the others."""

FAINT, FINE = 1e-6, 2.0**10
"""Part of a need below which an agent is told from nobody only if rows are scaled by so much against the tolerance."""

SMALLEST = 1e-12
"""Coefficients below this count as 0, as little as HiGHS can be told."""

REPEATABLE_NODES = 5_000
"""Limit of one call in nodes of the search tree where runs must be repeatable."""


@dataclass(frozen=True, eq=False)
class Programme:
    """Compiled: minimise ``cost @ x`` with ``matrix @ x <= limit`` and ``0 <= x <= upper``, x integer.

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


class Milp(ExactAllocator):
    """Proven optima by cvxpy and HiGHS.

    References
    ----------
    Huangfu and Hall (2018), Parallelizing the dual revised simplex method, doi:10.1007/s12532-017-0130-5.
    """

    method = BUILT_IN["milp"]
    most_pairs = 2_000_000
    pairs_per_second = 200_000

    def ask(self, question: Question, watch: Watch) -> Answer:
        """Put `question` to HiGHS."""
        highs = highspy.Highs()
        highs.HandleUserInterrupt = True

        def work() -> Answer:
            programme = compile_programme(question)
            if watch.halted.is_set():
                return UNKNOWN
            _load(highs, programme, question)
            if question.cost is not None:
                highs.cbMipImprovingSolution += lambda event: watch.tell(
                    _agents(event.data_out.mip_solution, programme)
                )
            highs.solve()
            return _read(highs, programme, question)

        return watch.run(work, highs.cancelSolve)


def state(question: Question) -> tuple[cp.Problem, cp.Variable]:
    """State the question in cvxpy; the variable holds the agents per pair."""
    demand, pairs = question.demand, np.arange(len(question.demand.kind))
    x = cp.Variable(len(pairs), integer=True, bounds=[np.zeros(len(pairs)), demand.most.astype(float)])
    scale = 1.0 if demand.need.max() <= SMALL_WHOLE else 1 / demand.need
    if not demand.whole and demand.weight.min(initial=1.0) < FAINT:
        scale = FINE * scale
    need = demand.need * scale
    weight = demand.weight * (need / demand.need)[demand.goal]
    done = csr_array((weight, (demand.goal, pairs)), shape=(len(need), len(pairs))) @ x
    used = csr_array((np.ones(len(pairs)), (demand.kind, pairs)), shape=(len(demand.count), len(pairs))) @ x
    rows = [used <= demand.count]
    if demand.partial:
        served = cp.Variable(len(need), boolean=True)
        rows += [done >= diags_array(need) @ served, np.ones(len(need)) @ served >= demand.serve]
    else:
        rows += [done >= need]
    if np.isfinite(demand.spare):
        rows += [done <= demand.enough * scale, used >= demand.least_used]
    cost = np.zeros(len(pairs)) if question.cost is None else scaled_costs(question)[0]
    return cp.Problem(cp.Minimize(cost @ x), rows), x


def scaled_costs(question: Question) -> tuple[FloatArray, float]:
    """Return costs such that the plan at hand costs about 1 for each agent there is, and their scale, a power of two.

    A pair that alone costs more than the plan at hand, and much more than agents do, is cut: it is in no better plan.
    """
    assert question.cost is not None
    agents = float(question.demand.count.sum())
    known = np.zeros(0) if question.hint is None else question.cost / agents * question.hint
    typical = float(known.sum()) or float(question.cost.max(initial=0.0)) or 1.0
    scale = scale_to_one(typical)
    with np.errstate(over="ignore"):
        return np.minimum(question.cost * scale, max(DEAREST, typical * agents * scale)), scale


def compile_programme(question: Question) -> Programme:
    """Let cvxpy compile the question to arrays."""
    problem, x = state(question)
    data, _, _ = problem.get_problem_data(cp.HIGHS)
    upper = np.array(data["upper_bounds"], dtype=float)
    upper[data["bool_vars_idx"]] = 1.0
    first = data["param_prob"].var_id_to_col[x.id]
    return Programme(
        cost=np.asarray(data["c"], dtype=float),
        upper=upper,
        matrix=csc_array(data["A"]),
        limit=np.asarray(data["b"], dtype=float),
        pair_at=first + np.arange(x.size),
    )


def _load(highs: highspy.Highs, programme: Programme, question: Question) -> None:
    rows, columns = programme.matrix.shape
    lp = highspy.HighsLp()
    lp.num_col_, lp.num_row_ = columns, rows
    lp.col_cost_, lp.col_lower_, lp.col_upper_ = programme.cost, np.zeros(columns), programme.upper
    lp.row_lower_, lp.row_upper_ = np.full(rows, -np.inf), programme.limit
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_ = programme.matrix.indptr, programme.matrix.indices
    lp.a_matrix_.value_ = programme.matrix.data
    lp.integrality_ = [highspy.HighsVarType.kInteger] * columns
    for option, value in _options(question).items():
        highs.setOptionValue(option, value)
    highs.passModel(lp)
    if question.hint is not None and question.cost is not None and not question.demand.partial:
        highs.setSolution(len(programme.pair_at), programme.pair_at.astype(np.int32), question.hint.astype(float))


def _options(question: Question) -> dict[str, bool | int | float | str]:
    options: dict[str, bool | int | float | str] = {
        "output_flag": False,
        "parallel": "off",
        "random_seed": question.seed % 2**31,
        "small_matrix_value": SMALLEST,
        "mip_rel_gap": 1e-8,
        "mip_abs_gap": 0.0,
        "mip_feasibility_tolerance": TOLERANCE,
        "primal_feasibility_tolerance": TOLERANCE,
        "dual_feasibility_tolerance": TOLERANCE,
    }
    if np.isfinite(question.seconds):
        options["time_limit"] = question.seconds
    if question.repeatable:
        options["mip_max_nodes"] = REPEATABLE_NODES
    return options


def _read(highs: highspy.Highs, programme: Programme, question: Question) -> Answer:
    """Trust a solution only if HiGHS itself calls it feasible: at a limit without one, it hands out zeros."""
    status, info = highs.getModelStatus(), highs.getInfo()
    if status in (highspy.HighsModelStatus.kInfeasible, highspy.HighsModelStatus.kUnboundedOrInfeasible):
        return Answer(impossible=True)
    bound = _safe_bound(info.mip_dual_bound, question)
    if info.primal_solution_status != highspy.SolutionStatus.kSolutionStatusFeasible:
        return Answer(bound=bound)
    return Answer(_agents(highs.getSolution().col_value, programme), bound=bound)


def _safe_bound(dual_bound: float, question: Question) -> float:
    """Lower what HiGHS proves by its tolerances, which count for each agent, and undo the scale of the costs."""
    if question.cost is None or not np.isfinite(dual_bound):
        return 0.0
    least = min(dual_bound * (1 - 10 * TOLERANCE), dual_bound - TOLERANCE * float(question.demand.count.sum()))
    return max(0.0, least) / scaled_costs(question)[1]


def _agents(solution: Sequence[float], programme: Programme) -> IntArray:
    return np.round(np.asarray(solution)[programme.pair_at]).astype(np.intp)
