"""`solve`: what is done before and after every method."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from alloc.allocators import (
    Allocator,
    Budget,
    Improvement,
    Method,
    Proposal,
    RefusedError,
    Search,
    Status,
    StopReason,
    load,
    solve,
)
from alloc.allocators.parallel.processors import available_threads
from alloc.problems import Allocation, InputError, Instance, Objective


class Answers(Allocator):
    """A method that proposes what it was made with."""

    method = Method(name="answers", summary="for tests", objectives=(Objective.MAKESPAN,))

    def __init__(self, proposal: Proposal, refusal: str | None = None) -> None:
        self.proposal, self.reason = proposal, refusal

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        return self.reason

    def allocate(self, search: Search) -> Proposal:
        return self.proposal


@pytest.fixture
def instance() -> Instance:
    return Instance(ability=[3, 2, 1], workload=[4, 2], task_position=[[0, 0], [1, 0]], start_task=[0, 0, 0])


def test_proposals_are_scored_by_the_evaluator(instance: Instance) -> None:
    """The makespan is the evaluator's, and proofs come only from bounds."""
    result = solve(instance, Answers(Proposal(Allocation([0, 1, 0]))))
    assert (result.makespan, result.status, result.stop_reason) == (1.0, Status.OPTIMAL, StopReason.PROVEN)
    poor = solve(instance, Answers(Proposal(Allocation([0, 1, -1]))))
    assert (poor.makespan, poor.status, poor.stop_reason) == (
        pytest.approx(4 / 3),
        Status.FEASIBLE,
        StopReason.FINISHED,
    )
    assert poor.gap == pytest.approx(0.25)


def test_runs_with_iteration_limits_use_one_thread(instance: Instance) -> None:
    """Without a time limit runs are the same on every machine: one thread unless more are requested."""
    seen = []

    class Counts(Answers):
        def allocate(self, search: Search) -> Proposal:
            seen.append(search.threads)
            return self.proposal

    counts = Counts(Proposal(Allocation([0, 1, 0])))
    solve(instance, counts, iterations=5, time_limit_s=None)
    solve(instance, counts, iterations=5, time_limit_s=None, threads=3)
    solve(instance, counts, iterations=5, time_limit_s=1)
    assert seen == [1, 3, available_threads()]


def test_unserved_tasks_are_repaired(instance: Instance) -> None:
    """A task that a method leaves unserved is served."""
    result = solve(instance, Answers(Proposal(Allocation([0, 0, 0]))))
    assert result.evaluation is not None
    assert result.evaluation.unserved_tasks == ()


def test_infeasible_result_has_a_plan_and_a_reason(contested: Instance) -> None:
    """If no allocation serves all tasks, the best partial plan is returned and the competing tasks are named."""
    result = solve(contested, "greedy")
    assert result.status is Status.INFEASIBLE
    assert (result.makespan, result.lower_bound, result.gap) == (None, None, None)
    assert result.evaluation is not None
    assert len(result.evaluation.unserved_tasks) == 1
    assert any("only 2 agents can take any of the 3 tasks 't1', 't2', 't4'" in note for note in result.notes)


def test_task_without_able_agent_is_explained() -> None:
    """A simple reason is stated simply."""
    result = solve(Instance(ability=[1], workload=[1], allowed_tasks=[[]]), "greedy")
    assert result.notes == ("no agent can take task 't1'",)
    assert result.status is Status.INFEASIBLE


def test_proposing_nothing_gives_no_solution(instance: Instance) -> None:
    """A method that proposes nothing has no solution and no makespan."""
    result = solve(instance, Answers(Proposal()))
    assert (result.status, result.allocation, result.makespan) == (Status.NO_SOLUTION, None, None)


def test_optimality_requires_proof_of_energy(instance: Instance) -> None:
    """At the least makespan without a proven energy, a run is finished but not proven."""
    far = Instance(
        ability=[1, 2, 3], workload=[3, 3], task_position=[[1, 0], [0, 0]], start_task=[1, 0, 0], energy_per_distance=1
    )
    result = solve(far, "greedy", objective="makespan-energy")
    assert result.makespan == 1.0
    assert result.status is Status.FEASIBLE
    assert result.stop_reason is StopReason.FINISHED
    assert result.energy_gap is not None
    assert result.energy_gap > 0.1


def test_zero_energy_is_proven() -> None:
    """If no agent flies the energy is proven, also without a linear programme of this size."""
    rng = np.random.default_rng(0)
    large = Instance(ability=rng.uniform(1, 2, 3000), workload=np.ones(300), allowed_tasks=[[0]] + [None] * 2999)
    answers = Answers(Proposal(Allocation(np.arange(3000) % 300)))
    answers.method = replace(Answers.method, objectives=tuple(Objective))  # type: ignore[misc]
    result = solve(large, answers, objective="makespan-energy")
    assert (result.energy, result.energy_lower_bound, result.energy_gap) == (0.0, 0.0, 0.0)


def test_refusals_are_raised_beforehand(instance: Instance) -> None:
    """Unsupported objectives and speeds, and the method's own reason, are refused with an explanation."""
    idle = Proposal(Allocation.idle(instance))
    with pytest.raises(RefusedError, match="does not optimise makespan-energy"):
        solve(instance, Answers(idle), objective="makespan-energy")
    with pytest.raises(RefusedError, match="too large for it"):
        solve(instance, Answers(idle, "too large for it"))
    moving = Instance(ability=[1], workload=[1], speed=[1.0])
    for method in (Answers(idle), "ga"):
        with pytest.raises(RefusedError, match="finite speeds"):
            solve(moving, method)


def test_warm_start_is_never_lost(instance: Instance) -> None:
    """An answer worse than the warm start is replaced by it."""
    result = solve(instance, Answers(Proposal(Allocation([1, 0, 1]))), start=Allocation([0, 1, 0]))
    assert result.makespan == 1.0


def test_infeasible_starts_are_repaired() -> None:
    """Agents of a start that can no longer do their task are not sent there."""
    instance = Instance(ability=[1, 2, 3], workload=[3, 3], allowed_tasks=[[0], [0], [1]])
    result = solve(instance, Answers(Proposal()), start=Allocation([1, 0, 1]))
    assert result.evaluation is not None
    assert result.evaluation.violations == ()


def test_stop_event_ends_a_run(instance: Instance) -> None:
    """A stop event ends a run long before its limit, with the corresponding reason."""
    stop = threading.Event()
    hard = Instance(ability=np.random.default_rng(0).uniform(1, 10, 40), workload=[3.3, 5.9, 7.1, 9.7])
    timer = threading.Timer(0.2, stop.set)
    timer.start()
    result = solve(hard, "ga", time_limit_s=60, stop=stop)
    timer.cancel()
    assert result.stop_reason is StopReason.INTERRUPTED
    assert result.runtime_s < 5
    assert result.makespan is not None


def test_callback_exceptions_end_a_run(instance: Instance) -> None:
    """An exception of a callback reaches the caller."""

    def enough(step: Improvement) -> None:
        raise RuntimeError(f"T = {step.evaluation.makespan:g}")

    with pytest.raises(RuntimeError, match="T = 1"):
        solve(instance, Answers(Proposal(Allocation([0, 1, 0]))), on_improvement=enough)


def test_parameters_with_an_allocator_object_are_refused(instance: Instance) -> None:
    """An allocator already has its parameters: further ones are an error."""
    with pytest.raises(InputError, match="with its own parameters; set policy when creating it"):
        solve(instance, load("greedy"), policy="x.safetensors")
    with pytest.raises(InputError, match="takes no option 'policy'"):
        solve(instance, "greedy", policy="x.safetensors")


def test_auto_takes_no_parameters(instance: Instance) -> None:
    """The method picked by auto depends on the size: a parameter requires naming the method."""
    with pytest.raises(InputError, match="needs a named method that has it"):
        solve(instance, "auto", policy="x.safetensors")
    assert solve(instance, "auto", policy=None).makespan == 1.0


@pytest.mark.parametrize("wrong", [{"seed": -1}, {"seed": 2**63}, {"threads": 0}, {"threads": 10**20}])
def test_seeds_and_threads_out_of_range_are_refused(instance: Instance, wrong: dict[str, int]) -> None:
    """Invalid seeds and numbers of threads are refused beforehand for every method."""
    with pytest.raises(InputError, match="must be a whole number from"):
        solve(instance, "greedy", **wrong)


def test_target_gap_uses_the_best_bound() -> None:
    """If reach makes one task long, the simple bounds are weak, and the run still ends at the target gap."""
    hard = Instance(
        ability=[1.1, 1.7, 2.3, 3.1, 4.9, 9.7], workload=[3.3, 5.9, 1.0], allowed_tasks=[[0, 1]] * 5 + [[2]]
    )
    plain = Search(hard, Objective.MAKESPAN, Budget())
    result = solve(hard, "ga", time_limit_s=20, target_gap=0.2)
    assert (result.stop_reason, result.gap is not None and result.gap <= 0.2) == (StopReason.TARGET_GAP, True)
    assert result.makespan is not None
    assert (result.makespan - plain.lower_bound) / result.makespan > 0.2


def test_auto_names_the_method_it_picked(instance: Instance) -> None:
    """The result has the name of the method that ran, and the reason."""
    result = solve(instance, "auto")
    assert result.method != "auto"
    assert any(f"auto picked {result.method}" in note for note in result.notes)


def test_notes_of_the_method_are_in_the_result(instance: Instance) -> None:
    """The notes of a proposal are in the result."""
    assert solve(instance, Answers(Proposal(Allocation([0, 1, 0]), notes=("12 messages",)))).notes == ("12 messages",)
