"""The exact method `cpsat`: constraint programming with OR-Tools CP-SAT over classes of agents."""

import sys
from collections.abc import Callable, Iterable, Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from ortools.sat.python import cp_model

from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.monitor import SolverMonitor
from alloc.allocators.exact.plain.cpsat import PlainCpSat
from alloc.allocators.exact.solver_model import Answer, SolverModel, Verdict
from alloc.allocators.exact.stages import ExactAllocator
from alloc.problems.instance import IntArray

NEED_STEPS = 2**40
"""Number of steps into which a non-integer need is divided; each agent's weight is rounded up by at most one step."""

COST_STEPS = 2**36
"""Number of steps into which the cost of the initial plan is divided; each agent's cost loses less than one step."""

MAX_SUM = 2**58
"""Upper bound on all sums in the model, well below 2^63 to leave room for the solver's own arithmetic."""

REPEATABLE_EFFORT = 20.0
"""Limit of one call in repeatable runs, in the solver's deterministic seconds."""

CHUNK = 10_000
"""Number of variables created between two checks of whether the run is over."""

WholeArray = NDArray[np.int64]


class CpSatSolver:
    """The CP-SAT back end."""

    max_pairs = 2_000_000
    pairs_per_second = 60_000

    def solve_model(self, model: SolverModel, monitor: SolverMonitor) -> Answer:
        """Solve `model` by CP-SAT."""
        solver = cp_model.CpSolver()
        _set_parameters(solver, model)

        def work() -> Answer:
            formulated = formulate(model, monitor.stopped.is_set)
            if formulated is None:
                return Answer()
            program, scale = formulated
            reporter = None if model.cost is None else _Reporter(len(model.demand.class_of_pair), monitor)
            return _read(solver, solver.solve(program, reporter), model, scale)

        return monitor.run(work, solver.stop_search) or Answer()


class CpSat(ExactAllocator):
    """Proven optima by CP-SAT.

    References
    ----------
    Perron, Didier and Gay (2023), The CP-SAT-LP solver, doi:10.4230/LIPIcs.CP.2023.3.
    """

    method = BUILT_IN["cpsat"]
    solver = CpSatSolver()
    plain_solver = PlainCpSat


class _Reporter(cp_model.CpSolverSolutionCallback):
    """Reports every plan that the solver finds."""

    def __init__(self, pairs: int, monitor: SolverMonitor) -> None:
        super().__init__()
        self._pairs, self._monitor = pairs, monitor

    def on_solution_callback(self) -> None:
        self._monitor.report(_counts(self.response_proto.solution, self._pairs))


def formulate(model: SolverModel, stopped: Callable[[], bool] = lambda: False) -> tuple[cp_model.CpModel, float] | None:
    """Formulate the model of `exact.model` in integers; its first variables are x.

    Returns
    -------
    program : CpModel
    scale : float
        Scale of the costs, see `integer_costs`; 1 without costs. The result is None if `stopped` returns True.
    """
    demand, program = model.demand, cp_model.CpModel()
    x: list[cp_model.IntVar] = []
    parts = (_add_variables(program, x, demand), _add_work(program, x, demand), _add_agents(program, x, demand))
    if any(stopped() for steps in parts for _ in steps):
        return None
    for variable, agents in zip(x, [] if model.hint is None else model.hint.tolist(), strict=False):
        program.add_hint(variable, agents)
    scale = 1.0
    if model.cost is not None:
        cost, scale = integer_costs(model)
        program.minimize(cp_model.LinearExpr.weighted_sum(x, cost.tolist()))
    return program, scale


def _add_variables(program: cp_model.CpModel, x: list[cp_model.IntVar], demand: Demand) -> Iterator[None]:
    """Variables 0 <= x_kj <= max_count_kj."""
    for most in np.split(demand.max_count, range(CHUNK, len(demand.max_count), CHUNK)):
        x += [program.new_int_var(0, agents, "") for agents in most.tolist()]
        yield


def _add_work(program: cp_model.CpModel, x: list[cp_model.IntVar], demand: Demand) -> Iterator[None]:
    """(work): need_j <= sum_k weight_kj x_kj <= max_weight_j, or need_j y_j with sum_j y_j = min_served."""
    weight, need = integer_weights(demand)
    max_weight = demand.max_weight
    served = [program.new_bool_var("") if demand.partial else 1 for _ in need]
    for j, pairs in enumerate(_grouped(demand.task_of_pair, len(need))):
        done = cp_model.LinearExpr.weighted_sum([x[p] for p in pairs], weight[pairs].tolist())
        if np.isfinite(demand.spare):
            program.add_linear_constraint(done, int(need[j]), int(max_weight[j]))
        else:
            program.add(done >= int(need[j]) * served[j])
        yield
    if demand.partial:
        program.add(cp_model.LinearExpr.sum(served) == demand.min_served)


def _add_agents(program: cp_model.CpModel, x: list[cp_model.IntVar], demand: Demand) -> Iterator[None]:
    """(agents): min_agents_k <= sum_j x_kj <= count_k, unless the bounds of the variables imply it."""
    min_agents = demand.min_agents.tolist()
    for k, pairs in enumerate(_grouped(demand.class_of_pair, len(demand.count))):
        if min_agents[k] > 0 or demand.max_count[pairs].sum() > demand.count[k]:
            working = cp_model.LinearExpr.sum([x[p] for p in pairs])
            program.add_linear_constraint(working, min_agents[k], int(demand.count[k]))
        yield


def integer_weights(demand: Demand) -> tuple[WholeArray, WholeArray]:
    """Return integer weights and needs, a relaxation: every plan that meets `demand` meets them.

    Weights are rounded up and needs down, so that infeasibility of the rounded model is a proof.
    """
    scale = 1.0
    if not demand.integral:
        largest = np.bincount(demand.task_of_pair, weights=demand.weight * demand.max_count, minlength=len(demand.need))
        scale = min(NEED_STEPS, MAX_SUM / max(1.0, float(largest.max(initial=1.0))))
    return np.ceil(demand.weight * scale).astype(np.int64), np.floor(demand.need * scale).astype(np.int64)


def integer_costs(model: SolverModel) -> tuple[WholeArray, float]:
    """Return integer costs, rounded down, and their scale: a lower bound on them also bounds the true costs.

    The cost of a pair is capped at that of the incumbent plan, which no bound can exceed anyway.
    """
    assert model.cost is not None
    known = 0.0 if model.hint is None else float(model.cost @ model.hint)
    known = known or float(model.cost.sum()) or 1.0
    scale = min(COST_STEPS / known, sys.float_info.max)
    return np.floor(np.minimum(model.cost, known) * scale).astype(np.int64), scale


def _grouped(group: IntArray, groups: int) -> list[IntArray]:
    """Return the indices of the pairs in each group."""
    order = np.argsort(group, kind="stable")
    return np.split(order, np.searchsorted(group[order], np.arange(1, groups)))


def _set_parameters(solver: cp_model.CpSolver, model: SolverModel) -> None:
    parameters, limits = solver.parameters, model.limits
    parameters.catch_sigint_signal = False
    parameters.presolve_inclusion_work_limit = 0  # with wide coefficients it cuts off solutions (OR-Tools 9.15)
    parameters.random_seed = limits.seed % 2**31
    parameters.num_workers = 1 if limits.repeatable else limits.threads
    if model.cost is None and model.demand.spare == 0:  # only equations: presolve is slow and finds nothing
        parameters.cp_model_presolve = False
    if np.isfinite(limits.seconds):
        parameters.max_time_in_seconds = limits.seconds
    if limits.repeatable:
        parameters.max_deterministic_time = REPEATABLE_EFFORT


def _read(solver: cp_model.CpSolver, status: "cp_model.CpSolverStatus", model: SolverModel, scale: float) -> Answer:
    if status == cp_model.INFEASIBLE:
        return Answer(Verdict.INFEASIBLE)
    bound = 0.0 if model.cost is None else max(0.0, solver.best_objective_bound / scale)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return Answer(bound=bound)
    counts = _counts(solver.response_proto.solution, len(model.demand.class_of_pair))
    return Answer(Verdict.FEASIBLE, counts, bound)


def _counts(solution: Iterable[int], pairs: int) -> IntArray:
    return np.fromiter(islice(solution, pairs), dtype=np.intp, count=pairs)
