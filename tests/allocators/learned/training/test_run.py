"""Training as a function: the same policy as by the command, and errors before anything is written."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from safetensors import safe_open

from alloc.allocators import solve
from alloc.allocators.learned.algorithms.hyperparameters import DqnParameters, PpoParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.allocators.learned.training import train
from alloc.allocators.parallel.engine import EngineError
from alloc.allocators.parallel.serial import SerialEngine
from alloc.cli.main import main
from alloc.problems import InputError, TrainingError
from alloc.problems.formats import write_instance
from alloc.problems.generate import paper_like

INSTANCES = [paper_like(8, 2, 35, seed) for seed in range(2)]
QUICK: dict[str, Any] = {"instances": INSTANCES, "decisions": 150, "parameters": {"update_epochs": 1}}


def test_library_and_command_train_the_same_policy(tmp_path: Path) -> None:
    """The policy files are equal to the byte, the report is returned, and a solver accepts the policy."""
    (tmp_path / "mine").mkdir()
    for number, instance in enumerate(INSTANCES):
        write_instance(instance, tmp_path / "mine" / f"{number}.json")
    options = ["--instances", str(tmp_path / "mine"), "--lesson", "150", "--set", "update_epochs=1"]
    assert main(["train", "ppo", "--output", str(tmp_path / "a"), *options, "--iterations", "2", "--seed", "3"]) == 0
    trainer = train("ppo", tmp_path / "b", iterations=2, seed=3, **QUICK)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert [report.generation for report in trainer.history] == [1, 2]
    assert (tmp_path / "b.checkpoint").exists()
    assert len((tmp_path / "b.csv").read_text().splitlines()) == 3
    result = solve(INSTANCES[0], "ppo", policy=tmp_path / "b", time_limit_s=None, iterations=1)
    assert result.allocation is not None


def test_training_can_be_observed_stopped_and_resumed(tmp_path: Path) -> None:
    """Callbacks see the start and every generation; a stop keeps complete generations, which resuming continues."""
    seen: list[int] = []
    options = {**QUICK, "iterations": 3, "on_report": lambda report: seen.append(report.generation)}
    started: list[int] = []
    first = train("ppo", tmp_path / "p", should_stop=lambda: len(seen) == 1, **options)
    assert first.generation == 1
    train("ppo", tmp_path / "p", resume=True, on_start=lambda trainer, _: started.append(trainer.generation), **options)
    assert (started, seen) == ([1], [1, 2, 3])
    whole = train("ppo", tmp_path / "w", **{**options, "on_report": lambda _: None})
    assert (tmp_path / "w").read_bytes() == (tmp_path / "p").read_bytes()
    assert whole.generation == 3


def test_policy_can_initialise_another_method(tmp_path: Path) -> None:
    """With `init` another method starts from the networks of a policy, and its metadata records the origin."""
    train("ppo", tmp_path / "p", iterations=1, **QUICK)
    trainer = train("gappo", tmp_path / "g", iterations=1, init=tmp_path / "p", population=2, **QUICK)
    assert len(trainer.members) == 2
    with safe_open(tmp_path / "g", framework="pt") as file:
        metadata = file.metadata()
    assert metadata["method"] == "gappo"
    assert json.loads(metadata["training"])["generation"] == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "gapo"}, "did you mean 'gappo'"),
        ({"families": ["mixt"]}, "did you mean 'mixed'"),
        ({"parameters": {"clip_coeff": 1}}, "ppo has no parameter 'clip_coeff'"),
        ({"parameters": {"clip_coef": -1}}, "clip_coef must be"),
        ({"parameters": {"clip_coef": "x"}}, "clip_coef must be like 0.2"),
        ({"parameters": DqnParameters()}, "parameters: ppo has PpoParameters, got DqnParameters"),
        ({"population": 2}, "population: ppo trains one network"),
        ({"decisions": 0}, "decisions: must be"),
        ({"steps": -1}, "steps: must be"),
        ({"minutes": float("nan")}, "minutes: must be"),
        ({"init": "nowhere"}, "nowhere: no such policy file"),
        ({"resume": True}, "no such checkpoint"),
        ({"output": "p.pt"}, "has the suffix '.pt'"),
        ({"log": "taken"}, "taken: is there already, and no log"),
        ({"checkpoint": "taken"}, "taken: is there already, and no checkpoint"),
        ({"output": "taken"}, "taken: exists and is not a policy file"),
        ({"turn": "both"}, "turn: must be one of bidding, simultaneous"),
    ],
)
def test_wrong_arguments_are_refused_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: dict[str, Any], message: str
) -> None:
    """Invalid arguments are an `InputError` that names the parameter or the file."""
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("somebody's")
    with pytest.raises(InputError, match=message):
        train(**{"method": "ppo", "output": "p", **options})
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_run_is_not_overwritten(tmp_path: Path) -> None:
    """A second run of the same name is refused if the first one has generations, and otherwise starts anew."""
    train("ppo", tmp_path / "p", iterations=0, **QUICK)
    train("ppo", tmp_path / "p", iterations=1, **QUICK)
    with pytest.raises(InputError, match="holds a training run; resume it"):
        train("ppo", tmp_path / "p", iterations=1, **QUICK)
    (tmp_path / "p.checkpoint").unlink()
    with pytest.raises(InputError, match="holds a policy, and no checkpoint"):
        train("ppo", tmp_path / "p", iterations=1, **QUICK)


def test_failing_engine_is_a_training_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says what is kept, and the cause is chained."""

    def give_up(*_: object) -> None:
        raise EngineError("a worker process died 3 times at the same item")

    monkeypatch.setattr(SerialEngine, "map", give_up)
    with pytest.raises(TrainingError, match=r"p\.checkpoint holds 0 generations") as caught:
        train("ppo", tmp_path / "p", **QUICK)
    assert isinstance(caught.value.__cause__, EngineError)


@pytest.mark.slow
def test_members_use_the_threads_of_the_engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Torch uses as many threads as the engine grants per item."""
    import torch

    seen: list[int] = []
    plain = Ppo.train_on

    def train_on(self: Ppo, job: TrainingJob) -> object:
        seen.append(torch.get_num_threads())
        return plain(self, job)

    monkeypatch.setattr(Ppo, "train_on", train_on)
    for threads in (1, 2):
        engine = SerialEngine(threads)
        train("ppo", tmp_path / f"{threads}", iterations=1, engine=engine, **{**QUICK, "parameters": PpoParameters()})
    assert seen == [1, 2]


def test_torch_is_imported_after_the_checks(tmp_path: Path) -> None:
    """Invalid arguments do not import torch."""
    code = (
        "import sys\nfrom alloc.allocators.learned.training import train\n"
        "try:\n    train('ppo', 'p', parameters={'clip_coef': -1})\n"
        "except ValueError:\n    print('torch' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.strip() == "False"
