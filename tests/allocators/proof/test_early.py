"""Runs end as soon as bounds that cost little prove their plan."""

import importlib

import numpy as np
import pytest
from oracle import brute_force

from alloc.allocators import Budget, Search, StopReason, solve
from alloc.allocators.proof.early import EarlyProof
from alloc.problems import Allocation, Instance, Objective

BOTH = Objective.MAKESPAN_ENERGY


def drawn(agents: int, tasks: int, seed: int = 1) -> Instance:
    """Return an instance in the unit cube, with travel that costs and takes no time."""
    rng = np.random.default_rng(seed)
    return Instance(
        ability=rng.integers(1, 6, agents),
        workload=rng.integers(2, 9, tasks),
        agent_position=rng.random((agents, 3)),
        task_position=rng.random((tasks, 3)),
    )


@pytest.mark.parametrize("method", ["local-search", "ga", "lp-round"])
def test_run_ends_with_a_proven_optimum(method: str) -> None:
    """With minutes left, a run on five agents ends at once, with a plan proven best in both objectives."""
    instance = drawn(5, 3)
    result = solve(instance, method, objective=BOTH, time_limit_s=300.0)
    best = brute_force(instance)
    assert (result.status, result.stop_reason) == ("optimal", StopReason.PROVEN)
    assert (result.makespan, result.energy) == (pytest.approx(best.makespan), pytest.approx(best.energy))
    assert result.runtime_s < 30


def test_run_ends_with_a_proven_makespan() -> None:
    """This also holds if the simple bound on the makespan leaves a gap."""
    instance = Instance(ability=[3.1, 2.3, 2.2], workload=[3, 3])
    result = solve(instance, "local-search", time_limit_s=300.0)
    assert result.lower_bound == pytest.approx(brute_force(instance).makespan)
    assert result.runtime_s < 30


@pytest.mark.parametrize("shape", [(5, 3), (14, 14)])
@pytest.mark.parametrize("method", ["local-search", "ga"])
def test_runs_with_iteration_limits_keep_their_answers(
    method: str, shape: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With an iteration limit and a seed, the plan is the same as without the proof."""

    def plan() -> Allocation | None:
        return solve(drawn(*shape), method, objective=BOTH, time_limit_s=None, iterations=20).allocation

    ended = plan()
    monkeypatch.setattr(importlib.import_module("alloc.allocators.solve"), "_is_proven_early", lambda *_: False)
    assert plan() == ended


def test_matching_optimum_is_proven_by_a_linear_programme() -> None:
    """The optimum with one agent per task is a matching, which ends the run even with fourteen tasks."""
    tasks = np.random.default_rng(0).random((14, 2))
    instance = Instance(ability=np.ones(14), workload=np.ones(14), task_position=tasks, agent_position=tasks + 0.01)
    run = Search(instance, BOTH, Budget(None))
    proof = EarlyProof(run)
    run.submit(Allocation(np.roll(np.arange(14), 1)))
    assert run.stop_reason() is None
    run.submit(Allocation(np.arange(14)))
    assert run.stop_reason() is StopReason.PROVEN
    assert EarlyProof(Search(instance, BOTH, Budget(None), start=Allocation(np.arange(14)))).hours == proof.hours


def test_optimal_warm_start_is_proven() -> None:
    """A run that starts from the best plan ends at once."""
    instance = drawn(5, 3)
    best = Search(instance, BOTH, Budget(None), start=Allocation(np.array(brute_force(instance).plan)))
    EarlyProof(best)
    assert best.stop_reason() is StopReason.PROVEN


def test_short_runs_skip_the_proof() -> None:
    """Within 0.1 s there is no time for bounds beyond the simple ones."""
    result = solve(drawn(5, 3), "local-search", objective=BOTH, time_limit_s=0.05)
    assert result.stop_reason is StopReason.TIME_LIMIT
    assert result.energy_lower_bound is None
