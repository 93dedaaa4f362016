"""Training: resumes to the same curve on any engine, keeps the best, stops in time, and leaves complete files."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors import safe_open

from alloc.allocators.learned.algorithms.hyperparameters import PpoParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob, TrainingStats
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.allocators.learned.algorithms.registry import METHODS
from alloc.allocators.learned.files import checkpoint
from alloc.allocators.learned.files.policy_file import load_policy
from alloc.allocators.learned.files.run_files import RunFiles
from alloc.allocators.learned.network.actor_critic import NetworkSize
from alloc.allocators.learned.training import member as module_of_members
from alloc.allocators.learned.training import population as module
from alloc.allocators.learned.training.curriculum import Curriculum
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.loop import run_training
from alloc.allocators.learned.training.parameters import TrainingParameters
from alloc.allocators.learned.training.report import Report
from alloc.allocators.learned.training.trainer import Trainer
from alloc.allocators.learned.training.validation import Validation, games_on
from alloc.allocators.parallel.processes import ProcessEngine
from alloc.allocators.parallel.serial import SerialEngine
from alloc.problems import InputError
from alloc.problems.game import PAPER
from alloc.problems.generate import paper_like

CURRICULUM, BOARDS = games_on([paper_like(10, 3, 44, seed) for seed in range(3)], Curriculum(games=(2, 4)))
TINY = TrainingParameters(
    population=3,
    decisions=60,
    network=NetworkSize(8, 8, 2),
    learner=PpoParameters(update_epochs=1, minibatch_size=64, buffer_size=200),
    curriculum=CURRICULUM,
)
TIMES = ("seconds", "decisions_per_second")


def trainer(seed: int = 5, **changes: Any) -> Trainer:
    return Trainer(replace(TINY, **changes), seed, BOARDS)


def figures(history: Sequence[Report]) -> list[dict[str, float]]:
    return [{name: value for name, value in asdict(report).items() if name not in TIMES} for report in history]


def weights(run: Trainer) -> torch.Tensor:
    everyone = [member.get("network", member.get("networks")) for member in run.members] + run.best
    return torch.cat([weight.flatten() for network in everyone for weight in network.values()])


@pytest.fixture
def paths(tmp_path: Path) -> RunFiles:
    return RunFiles(tmp_path / "p", tmp_path / "c", tmp_path / "log.csv")


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Has generations bring the costs that a test plans, for one member."""

    def plan(*costs: float) -> None:
        coming = iter(costs)
        monkeypatch.setattr(module_of_members, "validate", lambda *_: Validation(next(coming), 0.5, 1.0, 0.1, 1.0, 0.0))

    return plan


@pytest.mark.parametrize(
    "changes",
    [
        {},
        *({"method": name, "population": 1, "learner": None} for name in METHODS if name != "gappo"),
        {"rules": PAPER},
    ],
    ids=[*METHODS, "rules of the paper"],
)
def test_resumed_run_continues_identically(tmp_path: Path, changes: dict[str, Any]) -> None:
    """Two generations at once, or one and one with a checkpoint between, give the same figures and weights."""
    limits = Limits(steps=1000)
    whole, first, second = (trainer(**changes) for _ in range(3))
    whole.advance(limits)
    whole.advance(limits)
    first.advance(limits)
    first.save(tmp_path / "checkpoint")
    second.resume(tmp_path / "checkpoint")
    second.advance(limits)
    assert figures(whole.history) == figures(second.history)
    assert torch.equal(weights(whole), weights(second))


@pytest.mark.slow
def test_processes_train_identically() -> None:
    """Members trained in other processes are equal to the last bit."""
    here, there = trainer(), trainer()
    with ProcessEngine(2) as engine:
        for _ in range(2):
            here.advance()
            there.advance(engine=engine)
    assert figures(here.history) == figures(there.history)
    assert torch.equal(weights(here), weights(there))


def test_seeds_determine_weights_and_jobs() -> None:
    """Another seed gives other initial weights, and every job has its own seed."""
    one, other = trainer(1), trainer(2)
    assert not torch.equal(weights(one), weights(other))
    seeds = {one._job(member, Limits()).seed for member in range(3)}
    one.advance()
    seeds |= {one._job(member, Limits()).seed for member in range(3)}
    assert len(seeds) == 6


def test_jobs_modify_only_their_own_learner() -> None:
    """A discarded generation leaves weights and optimisers unchanged."""
    run, undisturbed = trainer(), trainer()
    for one in (run, undisturbed):
        one.advance()
    before = weights(run).clone()
    asked = iter([False, False, True])
    assert run.advance(engine=SerialEngine(), should_stop=lambda: next(asked)) is None
    assert run.generation == 1
    assert torch.equal(weights(run), before)
    for one in (run, undisturbed):
        one.advance()
    assert torch.equal(weights(run), weights(undisturbed))


def test_train_writes_policy_checkpoint_and_log(paths: RunFiles) -> None:
    """After every generation all three files are complete; the policy has the population and its metadata."""
    run = trainer(1)
    run_training(run, paths, limits=Limits(iterations=2))
    assert len(load_policy(paths.policy, "gappo")) == 3
    with safe_open(paths.policy, framework="pt") as file:
        said = file.metadata()
    assert f'"generation": {run.best_generation}' in said["training"]
    again = trainer(1)
    again.resume(paths.checkpoint)
    assert again.generation == 2
    lines = paths.log.read_text().splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("generation,decisions,evaluations,cost,unserved,time")


def test_log_and_policy_are_completed_on_resume(paths: RunFiles) -> None:
    """A run killed between writing the checkpoint and the other files writes these on resume."""
    run = trainer(1)
    run_training(run, paths, limits=Limits(iterations=2))
    log = paths.log.read_bytes()
    paths.log.write_bytes(log[: len(log) // 2])
    paths.policy.unlink()
    again = trainer(1)
    again.resume(paths.checkpoint)
    run_training(again, paths, limits=Limits(iterations=2))
    assert paths.log.read_bytes() == log
    for one, two in zip(load_policy(paths.policy, "gappo"), run.best, strict=True):
        assert all(torch.equal(weight, two[name]) for name, weight in one.state_dict().items())


def test_the_best_networks_are_kept(paths: RunFiles, planned: Callable[..., None]) -> None:
    """The policy is that of the generation with the least cost, not the last one."""
    planned(0.5, 0.2, 0.3, 0.4)
    run = trainer(population=1, method="ppo")
    for generation in range(1, 5):
        run.advance()
        if generation == 2:
            second = {name: weight.clone() for name, weight in run.members[0]["network"].items()}
    assert run.best_generation == 2
    assert [report.best_cost for report in run.history] == [0.5, 0.2, 0.2, 0.2]
    assert [report.unserved for report in run.history] == [0.5] * 4
    run.write_policy(paths.policy)
    (kept,) = load_policy(paths.policy, "ppo")
    assert all(torch.equal(weight, second[name]) for name, weight in kept.state_dict().items())


def test_patience_ends_a_run_without_improvement(paths: RunFiles, planned: Callable[..., None]) -> None:
    """Two consecutive generations without better networks end it, one does not."""
    planned(0.5, 0.6, 0.4, 0.4, 0.5, 0.1)
    run = trainer(population=1, method="ppo")
    run_training(run, paths, limits=Limits(iterations=9, patience=2))
    assert [report.cost for report in run.history] == [0.5, 0.6, 0.4, 0.4, 0.5]


def test_steps_are_summed_over_members(paths: RunFiles) -> None:
    """Training ends with the update that reaches the steps, and the last jobs are shorter."""
    run = trainer()
    run_training(run, paths, limits=Limits(steps=400))
    assert run.history[-1].decisions >= 400
    assert run.history[-2].decisions < 400
    assert run._job(0, Limits(steps=run.history[-1].decisions + 6)).decisions == 2


def test_progress_follows_the_first_given_limit() -> None:
    """Schedules follow the steps, else the generations, else the clock."""
    run = trainer()
    assert run.progress(Limits()) == run.progress(Limits(steps=9)) == 0
    run.advance()
    done, spent = run.history[0].decisions, run.history[0].seconds
    assert run.progress(Limits(steps=2 * done, iterations=1, minutes=1e-9)) == 0.5
    assert run.progress(Limits(iterations=4, minutes=1e-9)) == 0.25
    assert run.progress(Limits(minutes=spent / 60 * 4)) == pytest.approx(0.25)
    assert run.progress(Limits(minutes=0)) == 1
    assert run.is_over(Limits(minutes=0))


def test_members_start_from_given_weights() -> None:
    """The networks of a policy file are assigned in turn; without any, all members have the same weights."""
    given = [Ppo(TINY.network, seed=seed).policy.state_dict() for seed in (8, 9)]
    run = Trainer(TINY, 0, BOARDS, given)
    for member, expected in zip(run.members, (given[0], given[1], given[0]), strict=True):
        assert all(torch.equal(member["network"][name], weight) for name, weight in expected.items())
    alike = trainer().members
    assert all(torch.equal(alike[0]["network"][name], weight) for name, weight in alike[2]["network"].items())


def test_reports_sum_over_all_members(monkeypatch: pytest.MonkeyPatch) -> None:
    """A report sums over members, and fitness (12) gets their network evaluations."""

    def train_on(self: Ppo, job: TrainingJob) -> TrainingStats:
        return TrainingStats(10, 100, 1.0, 2.0, 0.0, 1e-3)

    seen = []
    monkeypatch.setattr(Ppo, "train_on", train_on)
    monkeypatch.setattr(module, "fitness", lambda *columns: seen.append(columns[2]) or [1.0, 3.0, 2.0])
    run = trainer()
    run.advance()
    run.advance()
    assert (run.history[-1].decisions, run.history[-1].evaluations, run.history[-1].fitness) == (60, 600, 3.0)
    assert seen == [[100, 100, 100]] * 2


@pytest.mark.parametrize("content", [None, b"", b"not a checkpoint"])
def test_missing_and_broken_checkpoints_are_refused(tmp_path: Path, content: bytes | None) -> None:
    """A missing or broken checkpoint is reported in one line."""
    if content is not None:
        (tmp_path / "checkpoint").write_bytes(content)
    with pytest.raises(InputError, match="checkpoint") as caught:
        trainer().resume(tmp_path / "checkpoint")
    assert "\n" not in str(caught.value)


def test_damaged_checkpoints_are_refused(tmp_path: Path) -> None:
    """A truncated or corrupt checkpoint is reported in plain words rather than torch's."""
    path = tmp_path / "checkpoint"
    trainer().save(path)
    whole = path.read_bytes()
    for content in (whole[:100], whole[: len(whole) // 2], whole[:-1], whole[:30] + b"x" * 200 + whole[230:]):
        path.write_bytes(content)
        with pytest.raises(InputError) as caught:
            trainer().resume(path)
        assert caught.value.message == "is no checkpoint, or is damaged; name another checkpoint, or remove it"


def test_checkpoints_of_other_versions_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are not resumed, but their number of generations is known."""
    monkeypatch.setattr(checkpoint, "CHECKPOINT_FORMAT", "alloc-checkpoint/2")
    run = trainer()
    run.save(tmp_path / "none")
    run.advance()
    run.save(tmp_path / "one")
    monkeypatch.undo()
    assert [checkpoint.generations_in(tmp_path / name) for name in ("none", "one")] == [0, 1]
    with pytest.raises(InputError, match="is a checkpoint of another version"):
        trainer().resume(tmp_path / "one")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"population": 2}, "is a run with population 3, not 2"),
        ({"seed": 6}, "is a run with seed 5, not 6"),
        ({"method": "ppo"}, "is a run with method gappo, not ppo"),
        ({"learner": PpoParameters(update_epochs=2)}, "is a run with learner"),
        ({"curriculum": Curriculum(("travel",))}, "is a run with curriculum.families mixed, not travel"),
        ({"curriculum": replace(CURRICULUM, instances=CURRICULUM.instances[:1])}, "is a run with instances"),
    ],
)
def test_checkpoints_of_other_runs_are_refused(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    """A checkpoint records its run, and the error says what differs."""
    trainer().save(tmp_path / "checkpoint")
    with pytest.raises(InputError, match=message):
        trainer(**changes).resume(tmp_path / "checkpoint")


def test_metadata_keep_the_names_of_their_format(tmp_path: Path) -> None:
    """Checkpoints use the parameter names of the format, errors those of the program."""
    trainer().save(tmp_path / "checkpoint")
    stored = torch.load(tmp_path / "checkpoint", weights_only=True)["description"]
    assert {
        "learner.clip",
        "learner.minibatch",
        "learner.capacity",
        "curriculum.price",
        "curriculum.own",
    } <= stored.keys()
    assert stored["learner.minibatch"] == "64"
    assert {"learner.clip_coef", "learner.minibatch_size", "curriculum.energy_weight"}.isdisjoint(stored)
    with pytest.raises(InputError, match=r"is a run with learner\.clip_coef 0\.2, not 0\.3"):
        trainer(learner=replace(TINY.learner, clip_coef=0.3)).resume(tmp_path / "checkpoint")


def test_unreadable_files_are_not_reported_as_damaged(tmp_path, monkeypatch):
    """Lack of memory, lack of permission and damage differ: removal is advised only for damaged files."""
    path = tmp_path / "run.checkpoint"
    trainer().save(path)
    for error, words in (
        (MemoryError(), "does not fit into memory"),
        (RuntimeError("DefaultCPUAllocator: can't allocate memory"), "does not fit into memory"),
        (PermissionError(13, "Permission denied"), "may not be read"),
        (RuntimeError("invalid header"), "or remove it"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr("torch.load", _raising(error))
            with pytest.raises(InputError, match=words) as caught:
                trainer().resume(path)
        assert caught.value.__cause__ is not None
        assert ("remove" in str(caught.value)) == (words == "or remove it")


def _raising(error):
    def fail(*arguments, **options):
        raise error

    return fail


def test_ddpg_has_no_population():
    """Breeding needs single networks, which is reported before training."""
    with pytest.raises(InputError, match="population: breeding"):
        TrainingParameters(method="ddpg", population=2)
