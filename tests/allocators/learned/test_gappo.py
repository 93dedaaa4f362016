"""GAPPO as shipped: what it promises on instances and sizes that training never saw."""

import threading

import numpy as np
import pytest
import torch

from alloc.allocators import Budget, RefusedError, Status, load, solve
from alloc.allocators.base import Allocator
from alloc.allocators.learned.gappo import ruin
from alloc.problems import Allocation, InputError, Instance, Objective
from alloc.problems.generate import paper, paper_like, random_instance
from alloc.problems.generate_family import Family


@pytest.fixture(scope="module")
def gappo() -> Allocator:
    return load("gappo")


def test_unseen_paper_instances(gappo: Allocator) -> None:
    """Five batches of games bring T to within 8 % of the optimum on each of three instances of scenario 1."""
    for seed in range(3):
        result = solve(paper(1, seed), gappo, iterations=5, time_limit_s=None, objective="makespan-energy")
        assert result.makespan is not None
        assert result.makespan <= 1.08


def test_energy_counts(gappo: Allocator) -> None:
    """With energy in the objective the same policy flies less than without."""
    instance = paper(1, 4)
    plain, saving = (
        solve(instance, gappo, objective=goal, iterations=3, time_limit_s=None, target_gap=0.0).energy
        for goal in ("makespan", "makespan-energy")
    )
    assert plain is not None
    assert saving is not None
    assert saving < plain


def test_reach_is_respected(gappo: Allocator) -> None:
    """With short ranges and own positions no agent is sent too far, and all tasks that can be served are."""
    family = Family(agents=60, tasks=12, starts="own", communication_range=(0.3, 0.6), battery=None)
    result = solve(random_instance(family, 11), gappo, iterations=3, time_limit_s=None)
    assert result.evaluation is not None
    assert result.evaluation.violations == ()
    assert result.status in (Status.FEASIBLE, Status.OPTIMAL, Status.INFEASIBLE)
    assert result.gap is None or result.gap < 0.25


def test_same_seed_same_answer(gappo: Allocator) -> None:
    """Counted in batches, a run is reproducible, from several threads at once too."""
    instance = paper_like(30, 6, 120, seed=9)
    answers: list[Allocation | None] = [None] * 3

    def run(number: int) -> None:
        answers[number] = solve(instance, gappo, iterations=3, time_limit_s=None, seed=3, threads=1).allocation

    workers = [threading.Thread(target=run, args=(number,)) for number in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert answers[0] is not None
    assert answers[0] == answers[1] == answers[2]


def test_global_generators_are_left_alone(gappo: Allocator) -> None:
    """A run draws from its own generators, and leaves torch's thread count as it was."""
    threads, before = torch.get_num_threads(), torch.random.get_rng_state()
    solve(paper(1, 1), gappo, iterations=2, time_limit_s=None)
    assert torch.equal(torch.random.get_rng_state(), before)
    assert torch.get_num_threads() == threads


def test_a_warm_start_is_built_on(gappo: Allocator) -> None:
    """Started from a perfect plan, the answer is as good."""
    instance = Instance(ability=np.ones(12), workload=np.full(4, 3.0))
    perfect = Allocation(np.arange(12) % 4)
    assert solve(instance, gappo, start=perfect, iterations=2, time_limit_s=None).makespan == 1.0


def test_too_large_an_instance_is_refused_beforehand(gappo: Allocator) -> None:
    """Where a single game could not be laid out in time, it says so and names its limit."""
    huge = Instance(ability=np.ones(10_000), workload=np.ones(1_000))
    assert gappo.refusal(huge, Objective.MAKESPAN, Budget(time_limit_s=1.0)) is not None
    with pytest.raises(RefusedError, match="more than the"):
        solve(huge, gappo, time_limit_s=1.0)


def test_unknown_policy_file() -> None:
    """A policy file that is not there is told before anything runs."""
    with pytest.raises(InputError, match="no such policy file"):
        load("gappo", policy="/nonexistent/policy.safetensors")


@pytest.mark.parametrize("device", ["nonsense", "cuda:99", "xpu:7", "meta"])
def test_devices_that_are_not_there(device: str) -> None:
    """A device that cannot be used is told in one line."""
    with pytest.raises(InputError, match=r"device: .* cannot be used here") as caught:
        load("gappo", device=device)
    assert "\n" not in str(caught.value)


def test_ruins_send_some_home() -> None:
    """In a ruin every agent is where the plan has it or at home, some of them at home, and not always the same."""
    instance = paper_like(40, 8, 160, seed=2)
    home = instance.start_task.astype(np.int64)
    plan = Allocation((home + 1) % 8)
    ruins = ruin(instance, plan, home, 20, np.random.default_rng(0)).numpy()
    back = ruins == home
    assert (back | (ruins == plan.task_of_agent)).all()
    assert 0 < back.mean() < 0.8
    assert len({row.tobytes() for row in back}) > 10


def test_degenerate_instances(gappo: Allocator) -> None:
    """One agent and one task, nothing to do, nobody able: no method may stumble over them."""
    assert solve(Instance(ability=[2], workload=[3]), gappo, time_limit_s=0.3).makespan == 1.5
    assert solve(Instance(ability=[1, 1], workload=[0, 0]), gappo, time_limit_s=0.3).makespan == 0
    nobody = Instance(ability=[1], workload=[1], allowed_tasks=[[]])
    assert solve(nobody, gappo, time_limit_s=0.3).status is Status.INFEASIBLE
