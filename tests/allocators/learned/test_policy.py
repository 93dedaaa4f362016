"""The shipped policies on instances and sizes that were not in training."""

import subprocess
import sys
import threading
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import torch
from tiny_instances import long_travel

from alloc.allocators import Budget, RefusedError, Status, load, solve
from alloc.allocators.contract.base import Allocator
from alloc.allocators.learned.files.policy_file import save_policy
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.problems import Allocation, Family, InputError, Instance, Objective, random_instance
from alloc.problems.generate import paper, paper_like

pytestmark = pytest.mark.timeout(400)  # the first game waits for the compiler, long on a busy machine

SHIPPED = [
    name
    for name in ("gappo", "ppo", "a2c", "dqn", "ddpg")
    if (files("alloc.allocators.learned.files") / "policies" / f"{name}.safetensors").is_file()
]


@pytest.fixture(scope="module")
def gappo() -> Allocator:
    return load("gappo")


@pytest.mark.parametrize("name", SHIPPED)
def test_greedy_game_is_near_the_optimum_on_paper_instances(name: str) -> None:
    """One greedy game without search is within 15 % of the optimum on three instances of scenario 1."""
    policy = load(name)
    for seed in range(3):
        makespan = solve(paper(1, seed), policy, iterations=0, time_limit_s=None).makespan
        assert makespan is not None
        assert makespan <= 1.15


def test_regional_games_reach_the_bound(gappo: Allocator) -> None:
    """A few sweeps reach T = 1 on a small instance like the paper's, which proves it optimal."""
    result = solve(paper_like(40, 8, 160, seed=3), gappo, iterations=40, time_limit_s=None)
    assert result.makespan == 1.0
    assert result.status is Status.OPTIMAL


def test_energy_objective_saves_energy(gappo: Allocator) -> None:
    """With energy in the objective the policy flies less, and slack saves more."""
    instance = paper_like(40, 8, 160, seed=3)
    results = [
        solve(instance, gappo, objective=goal, iterations=10, time_limit_s=None, makespan_slack=slack)
        for goal, slack in (("makespan", 0.0), ("makespan-energy", 0.0), ("makespan-energy", 0.2))
    ]
    energies = [result.energy for result in results]
    assert energies[0] > energies[1] > energies[2]
    assert results[2].makespan <= 1.2 * results[1].makespan * (1 + 1e-9)


def test_reach_and_speed_are_respected(gappo: Allocator) -> None:
    """With short ranges, travel times and positions, plans are feasible, and T is near the bound."""
    for family in (
        Family(agents=60, tasks=12, starts="own", communication_range=(0.3, 0.6), battery=None),
        Family(agents=60, tasks=12, starts="own", speed=(0.5, 2.0), battery=None),
    ):
        result = solve(random_instance(family, 11), gappo, iterations=5, time_limit_s=None)
        assert result.evaluation is not None
        assert result.evaluation.violations == ()
        assert result.gap is None or result.gap < 0.25


def test_same_seed_gives_same_answer(gappo: Allocator) -> None:
    """With a sweep budget, a run is reproducible, also from several threads at once."""
    instance = paper_like(30, 6, 120, seed=9)
    answers: list[Allocation | None] = [None] * 3

    def run(number: int) -> None:
        settings = {"iterations": 3, "time_limit_s": None, "seed": 3, "threads": 1, "handle_signals": False}
        answers[number] = solve(instance, gappo, objective="makespan-energy", **settings).allocation

    workers = [threading.Thread(target=run, args=(number,)) for number in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert answers[0] is not None
    assert answers[0] == answers[1] == answers[2]


def test_global_generators_are_not_used(gappo: Allocator) -> None:
    """A run uses its own generators, and keeps torch's thread count."""
    threads, before = torch.get_num_threads(), torch.random.get_rng_state()
    solve(paper_like(30, 6, 120, seed=9), gappo, iterations=2, time_limit_s=None)
    assert torch.equal(torch.random.get_rng_state(), before)
    assert torch.get_num_threads() == threads


def test_warm_start_is_never_lost(gappo: Allocator) -> None:
    """Started from a perfect plan, the answer is as good."""
    instance = Instance(ability=np.ones(12), workload=np.full(4, 3.0))
    perfect = Allocation(np.arange(12) % 4)
    assert solve(instance, gappo, start=perfect, iterations=2, time_limit_s=None).makespan == 1.0


def test_local_search_continues_from_the_policy() -> None:
    """The hybrid is no worse than one game of the policy alone."""
    instance = paper_like(40, 8, 160, seed=3)
    alone = solve(instance, "gappo", iterations=0, time_limit_s=None, objective="makespan-energy").evaluation
    both = solve(instance, "gappo-ls", iterations=20, time_limit_s=None, objective="makespan-energy").evaluation
    assert alone is not None
    assert both is not None
    assert both.is_better_than(alone, Objective.MAKESPAN_ENERGY)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_hybrid_is_never_worse_than_its_policy(gappo: Allocator, seed: int) -> None:
    """With long travel times `gappo-ls` starts from the first plan of `gappo`, and soon has a far better one."""
    instance = long_travel(seed)
    first = solve(instance, gappo, iterations=0, time_limit_s=None, threads=1).makespan
    hybrid = solve(instance, "gappo-ls", iterations=30, time_limit_s=None, threads=1)
    assert hybrid.trace[0].makespan == first
    assert hybrid.makespan < 0.98 * first


def test_too_large_instances_are_refused_beforehand(gappo: Allocator) -> None:
    """If a single game would not end in time, the method refuses and names its limit."""
    huge = Instance(ability=np.ones(10_000), workload=np.ones(1_000))
    assert gappo.refusal(huge, Objective.MAKESPAN, Budget(time_limit_s=1.0)) is not None
    with pytest.raises(RefusedError, match="may take 7 s"):
        solve(huge, gappo, time_limit_s=1.0)


def test_own_policy_is_used_only_by_its_method(tmp_path: Path) -> None:
    """A user's policy file is accepted by the method that trained it, and by no other."""
    torch.manual_seed(0)
    save_policy(tmp_path / "own.safetensors", [ActorCritic(NetworkSize(8, 8, 2))], "ppo")
    instance = paper_like(12, 4, 50, 0)
    result = solve(instance, "ppo", policy=tmp_path / "own.safetensors", iterations=2, time_limit_s=None)
    assert result.makespan is not None
    with pytest.raises(InputError, match=r"own\.safetensors: holds a policy of ppo; use it with the method ppo"):
        load("gappo", policy=tmp_path / "own.safetensors")


def test_missing_policy_file_is_refused_beforehand() -> None:
    """A missing policy file is reported before anything runs."""
    with pytest.raises(InputError, match="no such policy file"):
        load("gappo", policy="/nonexistent/policy.safetensors")


def test_invalid_policy_file_is_refused_before_torch_is_loaded() -> None:
    """A wrong file name is reported without loading torch, which takes seconds."""
    code = (
        "import sys\nfrom alloc.allocators import load\nfrom alloc.problems import InputError\n"
        "for policy in sys.argv[1:]:\n    try:\n        load('gappo', policy=policy)\n"
        "    except InputError:\n        print('torch' in sys.modules)"
    )
    wrong = ["nowhere.safetensors", "/", "", __file__]
    done = subprocess.run([sys.executable, "-c", code, *wrong], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False"] * 4


@pytest.mark.parametrize("device", ["nonsense", "cuda:99", "xpu:7", "meta", "mps", "tpu", "hpu", ""])
def test_unavailable_devices_are_refused(device: str) -> None:
    """A device that cannot be used is reported in one line, whatever torch says."""
    with pytest.raises(InputError, match=f"^device: {device!r} cannot be used here; use cpu( or cuda)?$"):
        load("gappo", device=device)


def test_degenerate_instances_are_solved(gappo: Allocator) -> None:
    """One agent and one task, no work, no able agent: every method copes."""
    assert solve(Instance(ability=[2], workload=[3]), gappo, time_limit_s=0.3).makespan == 1.5
    assert solve(Instance(ability=[1, 1], workload=[0, 0]), gappo, time_limit_s=0.3).makespan == 0
    nobody = Instance(ability=[1], workload=[1], allowed_tasks=[[]])
    assert solve(nobody, gappo, time_limit_s=0.3).status is Status.INFEASIBLE
