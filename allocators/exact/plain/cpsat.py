"""The plain model by CP-SAT, with coefficients rounded to integers such that every plan stays feasible."""

import math
from collections.abc import Iterable
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from ortools.sat.python import cp_model

from alloc.allocators.exact.plain.stages import PlainAnswer, Report
from alloc.allocators.exact.solver_model import SolverLimits
from alloc.problems.instance import IntArray
from alloc.problems.models.programme import Programme

RATIO_STEPS = 2**24
"""Number of steps of the ratio BOUND / T, far finer than the 1e-6 to which optima are proven."""

ABILITY_BITS, COST_BITS = 33, 50
"""Bits of the sums of abilities and of energy in the model, so that no product exceeds 2^58."""

EFFORT = 20.0
"""Limit of repeatable runs in the solver's deterministic seconds."""


class PlainCpSat:
    """CP-SAT on one programme, with default settings except for limits and seed."""

    def __init__(self, programme: Programme, limits: SolverLimits) -> None:
        self._programme, self._solver = programme, cp_model.CpSolver()
        parameters = self._solver.parameters
        parameters.num_workers, parameters.random_seed = limits.threads, limits.seed % 2**31
        if np.isfinite(limits.seconds):
            parameters.max_time_in_seconds = limits.seconds
        if limits.repeatable:
            parameters.num_workers, parameters.max_deterministic_time = 1, EFFORT
        parameters.relative_gap_limit = 0.0

    def solve(self, report: Report) -> PlainAnswer:
        """Solve the programme, and report every plan found."""
        model, scale = self._formulate()
        pairs = len(self._programme.kind)

        class Reporter(cp_model.CpSolverSolutionCallback):
            """Reports every plan that the solver finds."""

            def on_solution_callback(self) -> None:
                report(_chosen(self.response_proto.solution, pairs))

        status = self._solver.solve(model, Reporter())
        proto = self._solver.response_proto
        bound = None
        steps = proto.best_objective_bound  # 0 if the solver was stopped before it had one
        if status in (cp_model.OPTIMAL, cp_model.FEASIBLE) or (status == cp_model.UNKNOWN and steps):
            bound = (steps + 1) / RATIO_STEPS if self._programme.is_free else max(0.0, steps / scale)
        found = status in (cp_model.OPTIMAL, cp_model.FEASIBLE)
        return PlainAnswer(_chosen(proto.solution, pairs) if found else None, bound)

    def stop(self) -> None:
        """Request CP-SAT to stop."""
        self._solver.stop_search()

    def _formulate(self) -> tuple[cp_model.CpModel, float]:
        """Return the model, whose first variables are those of the pairs, and the scale of its costs."""
        programme, model = self._programme, cp_model.CpModel()
        x = [model.new_bool_var("") for _ in programme.kind]
        ability = _scale(float(programme.groups.ability.sum()), ABILITY_BITS)
        weight, need = _up(programme.rate * ability), _down(programme.need / programme.scale * ability)
        steps = RATIO_STEPS if programme.is_free else 1
        ratio = model.new_int_var(0, RATIO_STEPS, "") if programme.is_free else 1
        for pairs, least in zip(_grouped(programme.row, len(need)), need.tolist(), strict=True):
            done = cp_model.LinearExpr.weighted_sum([x[p] for p in pairs], (weight[pairs] * steps).tolist())
            model.add(done >= least * ratio)
        for pairs in _grouped(programme.kind, len(programme.groups.ability)):
            model.add_at_most_one([x[p] for p in pairs])
        scale = 1.0
        if programme.is_free:
            model.maximize(ratio)
        elif programme.energy is not None:
            scale = _scale(float(programme.energy.sum()), COST_BITS)
            model.minimize(cp_model.LinearExpr.weighted_sum(x, _down(programme.energy * scale).tolist()))
        return model, scale


def _grouped(numbers: IntArray, count: int) -> list[IntArray]:
    """Return the indices at which each number below `count` occurs, in ascending order."""
    places = np.argsort(numbers, kind="stable")
    return np.split(places, np.searchsorted(numbers[places], np.arange(1, count)))


def _chosen(solution: Iterable[int], pairs: int) -> IntArray:
    """Return the pairs whose variables, which come first, are 1."""
    return np.flatnonzero(np.fromiter(islice(solution, pairs), dtype=np.int64, count=pairs))


def _scale(total: float, bits: int) -> float:
    """Return the power of two that scales `total` to this number of bits."""
    return math.ldexp(1.0, bits - math.frexp(total)[1])


def _up(values: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.ceil(values).astype(np.int64)


def _down(values: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.floor(values).astype(np.int64)
