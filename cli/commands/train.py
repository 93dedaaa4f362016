"""``alloc train``."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import typer

from alloc.cli.commands import train_options as options
from alloc.cli.commands.train_options import Engine, Reward, Turn
from alloc.cli.commands.training import check_training_files, learner_parameters, note_held_out, read_instances
from alloc.cli.options import SeedOption, examples
from alloc.cli.output.console import complain, note, say
from alloc.problems import TrainingError
from alloc.problems.text import counted, number

if TYPE_CHECKING:
    from alloc.allocators.learned.training.limits import Limits
    from alloc.allocators.learned.training.report import Report
    from alloc.allocators.learned.training.trainer import Trainer
    from alloc.problems import Instance

EXAMPLES = examples(
    "alloc train gappo --output policy.safetensors --steps 2000000",
    "alloc train gappo --output policy.safetensors --steps 2000000 --resume",
    "alloc train ppo --output mine.safetensors --instances my-instances --init policy.safetensors --minutes 10",
    "alloc solve demo.json --method gappo --policy policy.safetensors",
    closing="Ctrl-C ends the training; the last complete generation is stored, and --resume continues from it to the "
    "same curve, also after a crash. With --steps or --iterations the same seed trains the same policy, on any engine; "
    "with --minutes alone the schedules follow the clock.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("train", epilog=EXAMPLES)(train_command)


def train_command(
    method: options.MethodArgument,
    output: options.OutputOption,
    steps: options.StepsOption = None,
    minutes: options.MinutesOption = None,
    iterations: options.GenerationsOption = None,
    patience: options.PatienceOption = None,
    family: options.FamilyOption = None,
    instances: options.TrainingInstancesOption = None,
    init: options.InitOption = None,
    population: options.PopulationOption = None,
    generation_steps: options.GenerationStepsOption = 20_000,
    lesson: options.FormerGenerationStepsOption = None,
    settings: options.HyperparametersOption = None,
    turn: options.TurnOption = Turn.BIDDING,
    reward: options.RewardOption = Reward.MAKESPAN,
    seed: SeedOption = 0,
    resume: options.ResumeOption = False,
    checkpoint: options.CheckpointOption = None,
    log: options.LogOption = None,
    tensorboard: options.TensorBoardOption = None,
    engine: options.EngineOption = Engine.SERIAL,
    workers: options.WorkersOption = None,
    address: options.AddressOption = None,
    threads: options.TorchThreadsOption = 1,
) -> None:
    """Train a learned method, with a checkpoint after each generation."""
    from alloc.allocators.learned.training.run import train
    from alloc.allocators.parallel.engines import check_engine, make_engine

    # what needs neither torch nor a cluster is checked first
    hyperparameters = learner_parameters(method, family or ["mixed"], settings or [], population)
    check_engine(engine.value, workers, address)
    problems = None if instances is None else read_instances(instances)
    check_training_files(output, checkpoint, log, tensorboard, init, resume=resume)
    run = _Progress(checkpoint or str(Path(output).with_suffix(".checkpoint")), problems)
    with make_engine(engine.value, workers, address, threads) as where, _interrupts(run):
        train(
            method,
            output,
            steps=steps,
            minutes=minutes,
            iterations=iterations,
            patience=patience,
            families=family or ["mixed"],
            instances=problems,
            init=init,
            population=population,
            decisions=lesson or generation_steps,
            parameters=hyperparameters,
            turn=turn.value,
            reward=reward.value,
            seed=seed,
            resume=resume,
            checkpoint=checkpoint,
            log=log,
            tensorboard=tensorboard,
            engine=where,
            on_start=run.begin,
            on_report=run.report,
        )
    _close(run, output)


class _Progress:
    """What a training has reached, and a line for each generation."""

    def __init__(self, checkpoint: str, instances: "list[Instance] | None") -> None:
        self.checkpoint, self._instances = checkpoint, instances
        self.trainer: Trainer | None = None
        self._limits: Limits | None = None

    @property
    def stored(self) -> str:
        """How many generations the checkpoint holds."""
        return f"{self.checkpoint} holds {counted(self.trainer.generation if self.trainer else 0, 'generation')}"

    def begin(self, trainer: "Trainer", limits: "Limits") -> None:
        """Take note of a run before its first generation."""
        self.trainer, self._limits = trainer, limits
        if self._instances is not None:
            note_held_out(self._instances)

    def report(self, report: "Report") -> None:
        """Print the line of a generation."""
        assert self.trainer is not None
        assert self._limits is not None
        _tell(report, self.trainer, self._limits)


def _close(run: _Progress, policy: str) -> None:
    trainer = run.trainer
    if trainer is None or trainer.generation == 0:
        note(f"no generation is complete, and {policy} is not written")
        raise typer.Exit(1)
    best = trainer.history[trainer.best_generation - 1]
    say(
        f"{policy} holds the networks of generation {best.generation}: T {best.time:.4f}, distance {best.distance:.4f}"
        f", {number(best.unserved, 3)} tasks unserved"
    )


@contextmanager
def _interrupts(run: _Progress) -> Iterator[None]:
    """End a training by Ctrl-C or SIGTERM, and say what is stored: files are complete at any moment."""

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGTERM, interrupt) if main else None
    try:
        yield
    except KeyboardInterrupt:
        note(f"interrupted; {run.stored}")
    except TrainingError as error:
        complain(f"{error.__cause__ or error}; {run.stored}, and --resume continues from there")
        raise typer.Exit(1) from None
    finally:
        if main:
            signal.signal(signal.SIGTERM, before)


def _tell(report: "Report", trainer: "Trainer", limits: "Limits") -> None:
    progress = trainer.progress(limits)
    left = report.seconds * (1 - progress) / progress / 60 if progress > 0 else float("inf")
    say(
        f"gen {report.generation}  {report.decisions:,} decisions  {number(report.decisions_per_second, 3)}/s"
        f"  T {report.time:.4f}  distance {report.distance:.4f}  others {report.others_time:.4f}"
        f"  unserved {number(report.unserved, 3)}"
        f"  cost {report.cost:.4f} (best {report.best_cost:.4f}, gen {trainer.best_generation})"
        f"  reward {number(report.reward, 3)}  entropy {number(report.entropy, 3)}  KL {number(report.divergence, 2)}"
        f"  rate {number(report.learning_rate, 2)}  {report.seconds / 60:.1f} min, {left:.1f} left"
    )
