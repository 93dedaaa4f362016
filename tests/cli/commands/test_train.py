"""``alloc train``: mistakes are reported before training, and interrupts and kill -9 do not change results."""

import csv
import inspect
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.allocators.learned.files.policy_file import save_policy
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.training import trainer as module_of_training
from alloc.allocators.learned.training.families import FAMILIES
from alloc.allocators.parallel.engine import EngineError
from alloc.allocators.parallel.engines import ENGINES
from alloc.allocators.parallel.serial import SerialEngine
from alloc.cli.commands.training import train_options
from alloc.problems import Instance
from alloc.problems.formats import write_instance
from alloc.problems.generate import paper_like

QUICK = ("--instances", "mine", "--generation-steps", "150", "--set", "update_epochs=1")


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A folder with instances on which a generation is fast."""
    folder = tmp_path / "mine"
    folder.mkdir()
    for seed in range(2):
        write_instance(paper_like(8, 2, 35, seed), folder / f"{seed}.json")
    return folder


def curve(path: Path) -> list[list[str]]:
    """All columns of the log except times."""
    with path.open(newline="") as file:
        return [row[:-2] for row in csv.reader(file)]


def files() -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}


def weights(path: Path) -> dict[str, torch.Tensor]:
    with safe_open(path, framework="pt") as file:
        return {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118


@pytest.mark.parametrize(
    "more",
    [
        ("--resume",),
        ("--checkpoint", "p.safetensors"),
        ("--checkpoint", "nowhere/c"),
        ("--population", "0"),
        ("--family", "mixt"),
        ("--set", "clip_coef"),
        ("--set", "clip_coeff=1"),
        ("--seed", str(2**63)),
        ("--minutes", "nan"),
        ("--set", "learning_rate=-1"),
        ("--set", "clip_coef=nan"),
        ("--instances", "nowhere.json"),
        ("--init", "nowhere.safetensors"),
        ("--workers", "2"),
        ("--turn", "both"),
    ],
)
def test_bad_usage_is_reported_before_training(alloc, more):
    """Invalid options are reported at once, in one line."""
    ran = alloc("train", "gappo", "--output", "p.safetensors", *more)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert not Path("p.safetensors").exists()


def test_unsupported_methods_are_refused(alloc):
    """Unknown methods, and populations for methods with a single network, are errors."""
    assert "did you mean 'gappo'" in alloc("train", "gapo", "--output", "p.safetensors").err
    ran = alloc("train", "ppo", "--output", "p.safetensors", "--population", "3")
    assert (ran.code, ran.err.count("\n")) == (2, 1)


def test_missing_tensorboard_is_reported_before_training(alloc, monkeypatch):
    """The error names the extra to install."""
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    ran = alloc("train", "ppo", "--output", "p.safetensors", "--tensorboard", "events")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert "alloc-mrta[train]" in ran.err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_before_the_first_generation_writes_no_policy(alloc, monkeypatch, mine, number):
    """A signal ends training within a generation; without a complete generation there is no policy."""

    def train_on(self, job):
        os.kill(os.getpid(), number)
        time.sleep(10)
        raise AssertionError("not interrupted")

    monkeypatch.setattr(Ppo, "train_on", train_on)
    before = signal.getsignal(number)
    ran = alloc("train", "ppo", "--output", "p.safetensors", *QUICK)
    assert ran.code == 1
    assert "interrupted" in ran.err
    assert not Path("p.safetensors").exists()
    assert signal.getsignal(number) is before


def test_failing_engine_is_one_line(alloc, monkeypatch, mine):
    """Lack of memory is not a defect of the program; the line says what is kept, and how to resume."""

    def give_up(*_):
        raise EngineError("a worker process died 3 times at the same item")

    monkeypatch.setattr(SerialEngine, "map", give_up)
    ran = alloc("train", "ppo", "--output", "p.safetensors", *QUICK)
    assert (ran.code, ran.out) == (1, "")
    judges, told = ran.err.splitlines()
    assert judges.startswith("note: ")
    assert "died 3 times at the same item; p.checkpoint holds 0 generations, and resuming" in told


def test_existing_run_is_not_overwritten(alloc, mine):
    """If a checkpoint exists, a new training must be resumed or written elsewhere."""
    assert alloc("train", "ppo", "--output", "p.safetensors", *QUICK, "--iterations", "1").code == 0
    before = files()
    ran = alloc("train", "ppo", "--output", "p.safetensors", *QUICK)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert "p.checkpoint: holds a training run; resume it" in ran.err
    assert files() == before
    Path("p.safetensors").unlink()  # without the policy the checkpoint alone says it
    assert "p.checkpoint: holds a training run" in alloc("train", "ppo", "--output", "p.safetensors", *QUICK).err


def test_run_without_generations_does_not_block_another(alloc, mine):
    """Files of a run without a complete generation do not block another run."""
    assert alloc("train", "gappo", "--output", "p", *QUICK, "--iterations", "0").code == 1
    assert Path("p.checkpoint").exists()
    ran = alloc("train", "gappo", "--output", "p", *QUICK, "--iterations", "1", "--population", "2", "--resume")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "is a run with population 4, not 2" in ran.err
    ran = alloc("train", "gappo", "--output", "p", *QUICK, "--iterations", "0", "--population", "2")
    assert ran.code == 1
    ran = alloc("train", "gappo", "--output", "p", *QUICK, "--iterations", "1", "--population", "2", "--resume")
    assert ran.code == 0


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("gapo",), "did you mean 'gappo'"),
        (("gappo", "--family", "mixt"), "did you mean 'mixed'"),
        (("gappo", "--set", "clip_coef=-1"), "clip_coef must be"),
        (("gappo", "--instances", "nowhere.json"), "nowhere.json: there is no such file"),
        (("gappo", "--init", "nowhere"), "nowhere: no such policy file"),
        (("gappo", "--workers", "2"), "belongs to the engine processes"),
    ],
)
def test_option_errors_precede_checkpoint_errors(alloc, more, message):
    """Errors in options are reported before errors about checkpoints."""
    Path("p.checkpoint").write_bytes(b"weeks of training")
    ran = alloc("train", *more, "--output", "p.safetensors")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert message in ran.err


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--output", "small.json"), "small.json: exists and is not a policy file"),
        (("--output", "tensors"), "tensors: exists and is not a policy file"),
        (("--output", "small.json", "--resume", "--checkpoint", "small.json"), "small.json: is --output and"),
        (("--output", "policy"), "policy: holds a policy, and no checkpoint to resume is beside it"),
        (("--output", "policy", "--init", "policy"), "policy: is --init and --output at once"),
        (("--output", "new", "--checkpoint", "small.json"), "small.json: is there already, and no checkpoint"),
        (("--output", "new", "--log", "small.json"), "small.json: is there already, and no log of a training"),
        (("--output", "new", "--log", "new"), "new: is --output and --log at once"),
        (("--output", "q.pt"), "q.pt: has the suffix '.pt', but policies are safetensors; end it in .safetensors"),
        (("--output", "q.safetensors.gz"), "q.safetensors.gz: has the suffix '.gz', but policies are safetensors"),
        (("--output", ""), "'': is not a file name"),
        (("--output", "-"), "policy, checkpoint and log must be files"),
    ],
)
def test_foreign_files_are_not_overwritten(alloc, small, more, message):
    """Instances, foreign tensors, policies and tables are not overwritten."""
    save_file({"a": torch.zeros(2)}, "tensors")
    save_policy("policy", [ActorCritic(NetworkSize(4, 4, 1))], "ppo")
    before = files()
    ran = alloc("train", "ppo", *more)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert message in ran.err
    assert files() == before


def test_empty_files_can_be_overwritten(alloc, mine):
    """An empty file, such as a temporary one, can be overwritten."""
    for name in ("p", "p.checkpoint", "p.csv"):
        Path(name).touch()
    assert alloc("train", "ppo", "--output", "p", *QUICK, "--iterations", "1").code == 0


def test_option_errors_do_not_load_torch(small, tmp_path):
    """Errors in options are reported without loading torch."""
    mistakes = [
        "gapo",
        "gappo --family mixt",
        "gappo --set clip_coeff=1",
        "gappo --set clip_coef=-1",
        "gappo --resume",
        "gappo --init nowhere",
        "gappo --init small.json",
        "gappo --instances nowhere.json",
        "gappo --engine ray",
        "gappo --output small.json",
    ]
    code = (
        "import sys\nsys.modules['ray'] = None\nfrom alloc.cli.main import main\nfor mistake in sys.argv[1:]:\n"
        "    print(main(['train', '--output', 'p', *mistake.split()]), 'torch' in sys.modules, mistake)"
    )
    ran = subprocess.run([sys.executable, "-c", code, *mistakes], capture_output=True, text=True, cwd=tmp_path)
    assert ran.stdout.splitlines() == [f"2 False {mistake}" for mistake in mistakes]
    assert ran.stderr.count("\n") == len(mistakes)


def test_resumed_training_gives_the_same_curve(alloc, mine):
    """Two generations, and then two more, equal four; progress and outcome are printed."""
    whole = alloc("train", "gappo", "--output", "w", *QUICK, "--steps", "1500", "--population", "2")
    assert whole.code == 0
    assert "T 1." in whole.err
    assert "  unserved 0  cost 0." in whole.err
    assert "0 tasks unserved" in whole.err.splitlines()[-1]
    assert (
        alloc(
            "train", "gappo", "--output", "p", *QUICK, "--steps", "1500", "--population", "2", "--iterations", "2"
        ).code
        == 0
    )
    ran = alloc("train", "gappo", "--output", "p", *QUICK, "--steps", "1500", "--population", "2", "--resume")
    assert ran.code == 0
    assert curve(Path("p.csv")) == curve(Path("w.csv"))
    other = alloc("train", "gappo", "--output", "p", *QUICK, "--population", "3", "--resume")
    assert (other.code, other.err.count("\n")) == (2, 1)
    assert "population 2, not 3" in other.err


@pytest.mark.slow
def test_killed_training_resumes_to_the_same_curve(alloc, mine):
    """Repeated kill -9 during training leaves complete files, and does not change log or policy."""
    options = [*QUICK, "--steps", "3000", "--population", "2"]
    assert alloc("train", "gappo", "--output", "w", *options).code == 0
    command = [sys.executable, "-c", "from alloc.cli.main import main; raise SystemExit(main())"]
    command += ["train", "gappo", "--output", "p", *options]
    rng = random.Random(0)
    killed = 0
    for number in range(20):
        more = ["--resume"] if Path("p.checkpoint").exists() else []
        run = subprocess.Popen([*command, *more], stderr=subprocess.DEVNULL)
        if number < 2:
            before = Path("p.checkpoint").stat().st_mtime_ns if more else 0
            while run.poll() is None and not _is_newer("p.checkpoint", before):
                time.sleep(0.01)
            time.sleep(rng.uniform(0, 0.3))
            run.kill()
        code = run.wait()
        killed += code == -signal.SIGKILL
        if code == 0:
            break
    assert killed > 0
    assert curve(Path("p.csv")) == curve(Path("w.csv"))
    expected, got = weights(Path("w")), weights(Path("p"))
    assert expected.keys() == got.keys()
    assert all(torch.equal(weight, got[name]) for name, weight in expected.items())


def _is_newer(name: str, moment: int) -> bool:
    return os.path.exists(name) and os.stat(name).st_mtime_ns > moment


def test_training_can_start_from_a_policy(alloc, mine):
    """--init starts from the networks of a policy of any method; the file records its origin."""
    assert alloc("train", "ppo", "--output", "p", *QUICK, "--steps", "300", "--seed", "3").code == 0
    ran = alloc("train", "gappo", "--output", "g", *QUICK, "--init", "p", "--iterations", "0", "--checkpoint", "c")
    assert ran.code == 1
    state = torch.load("c", weights_only=True)
    first = {name.removeprefix("0."): weight for name, weight in weights(Path("p")).items()}
    for member in state["members"]:
        assert all(torch.equal(member["network"][name], weight) for name, weight in first.items())
    with safe_open("p", framework="pt") as file:
        said = file.metadata()
    assert said["method"] == "ppo"
    training = json.loads(said["training"])
    assert training["seed"] == 3
    assert training["decisions"] >= 150
    assert training["turn"] == "bidding"


def test_held_out_instances_are_named(alloc, mine):
    """Some of the given instances are held out, and named; those without work are left out."""
    ran = alloc("train", "ppo", "--output", "p", *QUICK, "--iterations", "1")
    assert "note: the networks are judged on the instances that they learn from" in ran.err
    for seed in range(2, 6):
        write_instance(paper_like(8, 2, 35, seed), mine / f"{seed}.json")
    for name in ("x", "y"):
        write_instance(Instance(name=name, ability=[1], workload=[0]), mine / f"{name}.json")
    ran = alloc("train", "ppo", "--output", "q", *QUICK, "--iterations", "1")
    assert "note: 2 of 8 instances left out: there is no work to do\n" in ran.err
    assert "note: 1 of 8 instances held out to judge the networks: paper-like-" in ran.err


def test_game_of_the_paper_can_be_trained(alloc, mine):
    """Training with simultaneous choices and the coverage reward works."""
    ran = alloc(
        "train", "ppo", "--output", "p", *QUICK, "--iterations", "1", "--turn", "simultaneous", "--reward", "coverage"
    )
    assert ran.code == 0


def test_options_match_the_library():
    """The command line, which does not load torch, has the same engines and families."""
    assert {engine.value for engine in train_options.Engine} == set(ENGINES)
    for name in FAMILIES:
        assert name in inspect.getsource(train_options)


@pytest.mark.needs("tensorboard")
def test_resumed_run_keeps_its_events(alloc, mine):
    """TensorBoard shows the generations before and after --resume, each once."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    run = ("train", "ppo", "--output", "p.safetensors", *QUICK, "--tensorboard", "events")
    assert alloc(*run, "--iterations", "2").code == 0
    assert alloc(*run, "--iterations", "3", "--resume").code == 0
    steps = [event.step for event in EventAccumulator("events").Reload().Scalars("training/cost")]
    with Path("p.csv").open(newline="") as file:
        assert steps == [int(row["decisions"]) for row in csv.DictReader(file)]
    assert len(steps) == 3


def test_unwritable_checkpoint_keeps_the_policy(alloc, mine, monkeypatch):
    """If the checkpoint does not fit on the disk, the networks of the last generation are still stored."""
    save = module_of_training.Trainer.save

    def fail(self, path):
        if self.generation:
            raise OSError(28, "No space left on device", str(path))
        save(self, path)

    monkeypatch.setattr(module_of_training.Trainer, "save", fail)
    ran = alloc("train", "ppo", "--output", "p.safetensors", *QUICK, "--iterations", "1")
    assert (ran.code, ran.err.splitlines()[-1]) == (2, "alloc: p.checkpoint: No space left on device")
    assert weights(Path("p.safetensors"))


def test_former_option_name_still_works(alloc, mine):
    """--lesson is --generation-steps; the help does not show it."""
    assert "--lesson" not in alloc("train", "--help").out
    for name in ("--lesson", "--generation-steps"):
        ran = alloc("train", "ppo", "--output", f"p{name}", *QUICK[:2], *QUICK[4:], name, "100", "--iterations", "1")
        assert ran.code == 0
    assert curve(Path("p--lesson.csv")) == curve(Path("p--generation-steps.csv"))
