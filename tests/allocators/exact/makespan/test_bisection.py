"""The makespan stage, with a solver stub."""

from dataclasses import replace

import numpy as np
import pytest
from oracle import brute_force

from alloc.allocators import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.exact.makespan.bisection import bisect, least_makespan
from alloc.allocators.exact.makespan.probe import Probe, probe_makespan
from alloc.allocators.exact.makespan.state import MakespanState
from alloc.allocators.exact.model import Model
from alloc.allocators.exact.monitor import SolverMonitor
from alloc.allocators.exact.solver_model import Answer, SolverModel, Verdict
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.problems import Allocation, Instance, Objective, agent_classes


class ScriptedSolver:
    """Knows the best plan: returns it if it meets T, and otherwise a proof; or never has a verdict."""

    max_pairs = 1_000
    pairs_per_second = 1_000_000

    def __init__(self, instance: Instance, *, silent: bool = False) -> None:
        best = brute_force(instance)
        self._model = Model.build(instance, agent_classes(instance, by_place=False), instance.m)
        self._plan, self._makespan, self._silent = Allocation(best.plan), best.makespan, silent
        self.times: list[float] = []

    def solve_model(self, model: SolverModel, monitor: SolverMonitor) -> Answer:
        self.times.append(model.demand.time)
        if self._silent:
            return Answer()
        if model.demand.time < self._makespan * (1 - 1e-9):
            return Answer(Verdict.INFEASIBLE)
        return Answer(Verdict.FEASIBLE, self._model.counts(model.demand, self._plan))


def instance_of(seed: int) -> Instance:
    """Few agents of real abilities, so that simple bounds leave a gap."""
    rng = np.random.default_rng(seed)
    return Instance(ability=rng.uniform(1, 9, 6), workload=rng.uniform(5, 20, 2))


def search_on(instance: Instance) -> Search:
    search = Search(instance, Objective.MAKESPAN, Budget(time_limit_s=20.0))
    search.submit(greedy(instance))
    return search


@pytest.mark.parametrize("seed", range(5))
def test_bisection_alone_closes_the_gap(seed):
    """Given right verdicts, plan and bound meet at the optimum of brute force."""
    instance = instance_of(seed)
    search, solver = search_on(instance), ScriptedSolver(instance)
    least_makespan(search, solver, instance.m, np.inf, descent=False)
    assert search.fastest.evaluation.makespan == pytest.approx(brute_force(instance).makespan, rel=1e-9)
    assert search.gap <= 1e-6
    assert search.iteration == len(solver.times)


@pytest.mark.parametrize("seed", range(3))
def test_probes_without_verdict_prove_nothing(seed):
    """A solver without verdicts ends the bisection, and does not change the bound."""
    instance = instance_of(seed)
    search, solver = search_on(instance), ScriptedSolver(instance, silent=True)
    state = MakespanState.begin(search, instance.m, np.inf, descent=False)
    state.bounds_tried = True  # no bound by linear programmes either
    before = search.lower_bound
    bisect(state, solver)
    assert 1 < len(solver.times) < 100
    assert search.lower_bound == state.lower == before


def test_probe_returns_the_verdict_of_the_solver():
    """Above the optimum there is a plan, below it a proof; for a T below the bound, the solver is not called."""
    instance = instance_of(0)
    search, solver = search_on(instance), ScriptedSolver(instance)
    state, best = MakespanState.begin(search, instance.m, np.inf, descent=False), brute_force(instance).makespan
    assert probe_makespan(state, solver, Probe(best * 1e-3, 1.0)) is Verdict.INFEASIBLE
    assert not solver.times
    assert probe_makespan(state, solver, Probe(best * (1 - 1e-6), 1.0)) is Verdict.INFEASIBLE
    assert state.lower == pytest.approx(best * (1 - 1e-6))
    search.fastest = None
    search.submit(greedy(instance))
    assert probe_makespan(state, solver, Probe(best * (1 + 1e-9), 1.0)) is Verdict.FEASIBLE
    assert state.upper == pytest.approx(best)


@pytest.mark.parametrize("patience", [1.0, np.inf])
@pytest.mark.parametrize("is_whole", [False, True])
def test_stage_is_limited_if_abilities_have_no_unit(monkeypatch, is_whole, patience):
    """The stage ends after as long again as the fastest plan took; with a unit, a proof may come at any time."""
    drawn = instance_of(0)
    instance = Instance(ability=np.round(drawn.ability), workload=drawn.workload) if is_whole else drawn
    search = search_on(instance)
    state = MakespanState.begin(search, instance.m, 15.0, patience, descent=False)
    found_s = state.begin_s + 5.0
    monkeypatch.setattr(search, "fastest", replace(search.fastest, time_s=found_s))
    for elapsed_s, has_waited in ((found_s + 4.9, False), (found_s + 5.1, True)):
        monkeypatch.setattr(Search, "elapsed_s", elapsed_s)
        assert state.has_stalled == (has_waited and patience == 1.0 and not is_whole)
        assert state.over == state.has_stalled
