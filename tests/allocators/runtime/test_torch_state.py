"""Settings of torch by the caller, and by other code in the process, are respected."""

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial

import pytest
import torch

from alloc.allocators import load, solve
from alloc.allocators.contract.search import STANDS
from alloc.allocators.learned import policy
from alloc.allocators.learned.algorithms.a2c import A2c
from alloc.allocators.learned.algorithms.ddpg import Ddpg
from alloc.allocators.learned.algorithms.dqn import Dqn
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.search.fine_tuning import FineTuning, FineTuningParameters
from alloc.allocators.runtime.torch_state import plain_torch, torch_threads
from alloc.problems.generate import paper_like

pytestmark = pytest.mark.timeout(400)  # the first game waits for the compiler, long on a busy machine

LEARNED = ["gappo", "gappo-ls", "ppo", "a2c", "dqn", "ddpg"]
CONTEXTS: dict[str, Callable[[], AbstractContextManager[object]]] = {
    "no gradients": torch.no_grad,
    "inference": torch.inference_mode,
    "autocast": partial(torch.autocast, "cpu", dtype=torch.bfloat16),
    "another device": partial(torch.device, "meta"),
}


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[FineTuning]:
    """Have `gappo` learn on after 0.1 s; what learned is in the list."""
    made: list[FineTuning] = []

    def early(*arguments: object) -> FineTuning:
        made.append(FineTuning(*arguments, FineTuningParameters(after_s=0.1, games=8, rounds=4)))  # type: ignore[arg-type]
        return made[-1]

    monkeypatch.setattr(policy, "FineTuning", early)
    return made


@pytest.mark.parametrize("method", LEARNED)
@pytest.mark.parametrize("context", CONTEXTS)
def test_torch_settings_of_the_caller_change_no_answer(method: str, context: str) -> None:
    """Loaded and run within such a context, a method gives the same answer."""
    run = partial(solve, paper_like(24, 6, 100, 0), objective="makespan-energy", time_limit_s=None, iterations=5)
    plain = run(load(method))
    with CONTEXTS[context]():
        within = run(load(method))
        again = torch.zeros(2, device="cpu") + 1
    assert (within.allocation, within.notes) == (plain.allocation, plain.notes)
    assert again.is_inference() is (context == "inference")


@pytest.mark.parametrize("context", CONTEXTS)
def test_fine_tuning_works_with_torch_settings_of_the_caller(context: str, runs: list[FineTuning]) -> None:
    """Gradients are computed in full precision even if the caller has disabled them."""
    with CONTEXTS[context]():
        result = solve(paper_like(24, 6, 100, 0), "gappo", objective="makespan-energy", time_limit_s=1.0)
    assert result.notes == ()
    assert runs[0].jobs > 0


def test_failing_fine_tuning_keeps_the_plan(
    runs: list[FineTuning], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The run continues with the shipped policy; a note reports the failure, and the log has the traceback."""

    def fail(*_: object) -> None:
        raise RuntimeError("out of luck")

    monkeypatch.setattr(FineTuning, "learn", fail)
    result = solve(paper_like(24, 6, 100, 0), "gappo", objective="makespan-energy", time_limit_s=1.0)
    assert str(result.stop_reason) == "time_limit"
    assert result.notes == (f"fine-tuning failed (RuntimeError: out of luck); {STANDS}",)
    (record,) = caplog.records
    assert (record.name, record.exc_info is not None) == ("alloc", True)


def test_torch_state_is_restored_in_every_thread() -> None:
    """Overlapping runs restore the settings of every thread, and do not affect others."""
    seen: list[int] = []
    first_in, second_in, first_out = threading.Event(), threading.Event(), threading.Event()

    def initialised() -> int:
        thread = threading.Thread(target=lambda: seen.append(torch.get_num_threads()))
        thread.start()
        thread.join()
        return seen[-1]

    def overlapping() -> None:
        first_in.wait(10)
        with torch_threads(1):
            seen.append(torch.get_num_threads())
            second_in.set()
            first_out.wait(10)
        seen.append(torch.get_num_threads())

    before = torch.get_num_threads()
    torch.set_num_threads(3)
    try:
        other = threading.Thread(target=overlapping)
        other.start()
        with torch_threads(1):
            assert torch.get_num_threads() == 1
            first_in.set()
            second_in.wait(10)
            assert initialised() == 3
        first_out.set()
        other.join()
        assert seen == [1, 3, 3]
        assert (torch.get_num_threads(), initialised()) == (3, 3)
    finally:
        torch.set_num_threads(before)


@pytest.mark.parametrize("learner", [Ppo, A2c, Dqn, Ddpg])
def test_initial_weights_match_torch(learner: Callable[..., Ppo]) -> None:
    """Initial weights equal those after `manual_seed`, but no shared generator is used."""
    size = NetworkSize(8, 8, 2)
    before = torch.get_rng_state()
    made = learner(size, seed=5).policy.state_dict()
    assert torch.equal(torch.get_rng_state(), before)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(5)
        expected = ActorCritic(size).state_dict()
    assert made.keys() == expected.keys()
    assert all(torch.equal(made[name], expected[name]) for name in expected)


def test_tensors_in_plain_torch_are_trainable_cpu_tensors() -> None:
    """Tensors made in `plain_torch` are trainable and on the CPU, whatever the caller has set."""
    with torch.inference_mode(), torch.device("meta"), plain_torch():
        weights = Ppo(NetworkSize(8, 8, 2), seed=3).policy.state_dict()
    assert all(not weight.is_inference() and weight.device.type == "cpu" for weight in weights.values())


@pytest.mark.parametrize("method", LEARNED)
def test_shared_generators_are_not_used(method: str) -> None:
    """Random numbers of a caller that has seeded torch do not depend on loads and runs in between."""
    before = torch.get_rng_state()
    load(method)
    assert torch.equal(torch.get_rng_state(), before)
