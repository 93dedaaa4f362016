"""Exact by constraint programming: OR-Tools CP-SAT over classes of agents."""

import sys
from collections.abc import Callable, Iterable
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from ortools.sat.python import cp_model

from alloc.allocators.exact.model import Demand
from alloc.allocators.exact.solver_model import UNKNOWN, Answer, Question, Watch
from alloc.allocators.exact.stages import ExactAllocator
from alloc.allocators.registry import BUILT_IN
from alloc.problems.instance import IntArray

FINE = 2**40
"""Steps into which the need of a task is divided where it is no integer; each agent rounds up by at most one."""

FINE_COST = 2**36
"""Steps into which the cost of the plan to begin with is divided; each agent rounds down by at most one."""

LARGEST = 2**58
"""No sum in the model exceeds this, far enough below 2^63 for the solver's own arithmetic."""

REPEATABLE_EFFORT = 20.0
"""Limit of one call where runs must be repeatable, in the solver's deterministic seconds."""

CHUNK = 10_000
"""Variables made between two looks at whether the run is over."""

WholeArray = NDArray[np.int64]


class CpSat(ExactAllocator):
    """Proven optima by CP-SAT.

    References
    ----------
    Perron, Didier and Gay (2023), The CP-SAT-LP solver, doi:10.4230/LIPIcs.CP.2023.3.
    """

    method = BUILT_IN["cpsat"]
    most_pairs = 2_000_000
    pairs_per_second = 60_000

    def ask(self, question: Question, watch: Watch) -> Answer:
        """Put `question` to CP-SAT."""
        solver = cp_model.CpSolver()
        _set_parameters(solver, question)

        def work() -> Answer:
            built = build(question, watch.halted.is_set)
            if built is None:
                return UNKNOWN
            model, scale = built
            reporter = None if question.cost is None else _Reporter(len(question.demand.kind), watch)
            return _read(solver, solver.solve(model, reporter), question, scale)

        return watch.run(work, solver.stop_search)


class _Reporter(cp_model.CpSolverSolutionCallback):
    """Tells every plan that the solver finds on its way."""

    def __init__(self, pairs: int, watch: Watch) -> None:
        super().__init__()
        self._pairs, self._watch = pairs, watch

    def on_solution_callback(self) -> None:
        self._watch.tell(_agents(self.response_proto.solution, self._pairs))


def build(question: Question, halted: Callable[[], bool] = lambda: False) -> tuple[cp_model.CpModel, float] | None:
    """State the question in integers, its first variables being the agents per pair.

    Returns
    -------
    (CpModel, float) or None
        The model and the scale of its costs; None if `halted` says so before it is built.
    """
    demand = question.demand
    model, x = cp_model.CpModel(), []
    for most in np.split(demand.most, range(CHUNK, len(demand.most), CHUNK)):
        x += [model.new_int_var(0, agents, "") for agents in most.tolist()]
        if halted():
            return None
    weight, need = whole_numbers(demand)
    enough, least_used = demand.enough, demand.least_used.tolist()
    served = [model.new_bool_var("") if demand.partial else 1 for _ in need]
    for row, pairs in enumerate(_by(demand.goal, len(need))):
        done = cp_model.LinearExpr.weighted_sum([x[p] for p in pairs], weight[pairs].tolist())
        if np.isfinite(demand.spare):
            model.add_linear_constraint(done, int(need[row]), int(enough[row]))
        else:
            model.add(done >= int(need[row]) * served[row])
        if halted():
            return None
    if demand.partial:
        model.add(cp_model.LinearExpr.sum(served) == demand.serve)
    for kind, pairs in enumerate(_by(demand.kind, len(demand.count))):
        if least_used[kind] > 0 or demand.most[pairs].sum() > demand.count[kind]:
            working = cp_model.LinearExpr.sum([x[p] for p in pairs])
            model.add_linear_constraint(working, least_used[kind], int(demand.count[kind]))
        if halted():
            return None
    for variable, agents in zip(x, [] if question.hint is None else question.hint.tolist(), strict=False):
        model.add_hint(variable, agents)
    return model, _minimise(model, x, question)


def _minimise(model: cp_model.CpModel, x: list[cp_model.IntVar], question: Question) -> float:
    """Set the objective, if there is one, and return its scale."""
    if question.cost is None:
        return 1.0
    cost, scale = whole_costs(question)
    model.minimize(cp_model.LinearExpr.weighted_sum(x, cost.tolist()))
    return scale


def whole_numbers(demand: Demand) -> tuple[WholeArray, WholeArray]:
    """Return weights and needs in integers such that every plan that meets `demand` meets these.

    Weights are rounded up and needs down, so that what is impossible here is impossible indeed.
    """
    scale = 1.0
    if not demand.whole:
        most_done = np.bincount(demand.goal, weights=demand.weight * demand.most, minlength=len(demand.need))
        scale = min(FINE, LARGEST / max(1.0, float(most_done.max(initial=1.0))))
    return np.ceil(demand.weight * scale).astype(np.int64), np.floor(demand.need * scale).astype(np.int64)


def whole_costs(question: Question) -> tuple[WholeArray, float]:
    """Return costs in integers, rounded down, and their scale: a bound on them bounds the true costs too.

    A pair that alone costs more than the plan at hand is cut to that cost, which no bound can exceed anyway.
    """
    assert question.cost is not None
    known = 0.0 if question.hint is None else float(question.cost @ question.hint)
    known = known or float(question.cost.sum()) or 1.0
    scale = min(FINE_COST / known, sys.float_info.max)
    return np.floor(np.minimum(question.cost, known) * scale).astype(np.int64), scale


def _by(group: IntArray, groups: int) -> list[IntArray]:
    """Indices of the pairs in each group."""
    order = np.argsort(group, kind="stable")
    return np.split(order, np.searchsorted(group[order], np.arange(1, groups)))


def _set_parameters(solver: cp_model.CpSolver, question: Question) -> None:
    parameters = solver.parameters
    parameters.catch_sigint_signal = False
    parameters.presolve_inclusion_work_limit = 0  # with wide coefficients it cuts off solutions (OR-Tools 9.15)
    parameters.random_seed = question.seed % 2**31
    parameters.num_workers = 1 if question.repeatable else question.threads
    if question.cost is None and question.demand.spare == 0:  # all equations: presolve finds nothing and takes long
        parameters.cp_model_presolve = False
    if np.isfinite(question.seconds):
        parameters.max_time_in_seconds = question.seconds
    if question.repeatable:
        parameters.max_deterministic_time = REPEATABLE_EFFORT


def _read(solver: cp_model.CpSolver, status: "cp_model.CpSolverStatus", question: Question, scale: float) -> Answer:
    if status == cp_model.INFEASIBLE:
        return Answer(impossible=True)
    bound = 0.0 if question.cost is None else solver.best_objective_bound / scale
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return Answer(bound=max(0.0, bound))
    return Answer(_agents(solver.response_proto.solution, len(question.demand.kind)), bound=max(0.0, bound))


def _agents(solution: Iterable[int], pairs: int) -> IntArray:
    return np.fromiter(islice(solution, pairs), dtype=np.intp, count=pairs)
