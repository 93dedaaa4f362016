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
from alloc.cli.commands.training import (
    TrainingFiles,
    learner_parameters,
    new_trainer,
    read_instances,
    training_parameters,
)
from alloc.cli.options import SeedOption, examples
from alloc.cli.output.console import complain, note, say
from alloc.problems.text import counted, number

if TYPE_CHECKING:
    import alloc.allocators.parallel.engine as engines
    from alloc.allocators.learned.training.trainer import Limits, Report, Trainer

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
    files = TrainingFiles.of(output, checkpoint, log, tensorboard, read=init)
    # checks that need no torch come first, so that mistakes are reported without loading it
    learner = learner_parameters(method, family or ["mixed"], settings or [], population)
    from alloc.allocators.parallel.engine import check_engine, make_engine

    check_engine(engine.value, workers, address)
    problems = None if instances is None else read_instances(instances)
    files.check(init, resume=resume)
    parameters = training_parameters(
        method,
        learner,
        families=family or ["mixed"],
        generation_steps=lesson or generation_steps,
        population=population,
        turn=turn.value,
        reward=reward.value,
        init=init,
    )
    trainer = new_trainer(parameters, seed, problems, init, files.checkpoint if resume else None)
    with make_engine(engine.value, workers, address, threads) as where:
        _train(trainer, files, _limits(steps, iterations, minutes, patience), where)
    _close(trainer, files.policy)


def _limits(steps: int | None, iterations: int | None, minutes: float | None, patience: int | None) -> "Limits":
    from alloc.allocators.learned.training.trainer import Limits

    if steps is None and minutes is None and iterations is None:
        steps = options.STEPS
    return Limits(steps, iterations, minutes, patience)


def _train(trainer: "Trainer", files: TrainingFiles, limits: "Limits", engine: "engines.Engine") -> None:
    """Train until a limit, an interrupt or a failure of the engine; say what is stored in the last two cases."""
    from alloc.allocators.learned.training.trainer import train
    from alloc.allocators.parallel.engine import EngineError

    try:
        with _interrupts():
            train(
                trainer,
                files.policy,
                checkpoint=files.checkpoint,
                log=files.log,
                limits=limits,
                tensorboard=files.tensorboard,
                engine=engine,
                on_report=lambda report: _tell(report, trainer, limits),
            )
    except KeyboardInterrupt:
        note(f"interrupted; {files.checkpoint} holds {counted(trainer.generation, 'generation')}")
    except EngineError as error:
        stored = f"{files.checkpoint} holds {counted(trainer.generation, 'generation')}"
        complain(f"{error}; {stored}, and --resume continues from there")
        raise typer.Exit(1) from None


def _close(trainer: "Trainer", policy: Path) -> None:
    if trainer.generation == 0:
        note(f"no generation is complete, and {policy} is not written")
        raise typer.Exit(1)
    best = trainer.history[trainer.best_generation - 1]
    say(
        f"{policy} holds the networks of generation {best.generation}: T {best.time:.4f}, distance {best.distance:.4f}"
        f", {number(best.unserved, 3)} tasks unserved"
    )


@contextmanager
def _interrupts() -> Iterator[None]:
    """Treat SIGTERM as Ctrl-C: files are complete at any moment, so neither has to wait."""

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
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
