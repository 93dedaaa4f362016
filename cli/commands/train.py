"""``alloc train``."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from alloc.cli.commands.training import (
    check_free,
    check_suffix,
    learner_parameters,
    new_trainer,
    read_instances,
    training_parameters,
)
from alloc.cli.options import examples
from alloc.cli.output.console import STANDARD, complain, note, say
from alloc.cli.output.files import check_output, check_outputs
from alloc.problems.text import counted, number

if TYPE_CHECKING:
    from alloc.allocators.learned.training.trainer import Limits, Report, Trainer

EXAMPLES = examples(
    "alloc train gappo --output policy.safetensors --steps 2000000",
    "alloc train gappo --output policy.safetensors --steps 2000000 --resume",
    "alloc train ppo --output mine.safetensors --instances my-instances --init policy.safetensors --minutes 10",
    "alloc solve demo.json --method gappo --policy policy.safetensors",
    closing="Ctrl-C ends the training; what the last whole generation brought is stored, and --resume goes on from it "
    "to the same curve, also after a crash. With --steps or --iterations the same seed trains the same policy, on any "
    "engine; with --minutes alone the schedules follow the clock.",
)

STEPS = 500_000


class Turn(StrEnum):
    """As `alloc.problems.game.Turn`, without torch; a test compares the two."""

    BIDDING = "bidding"
    SIMULTANEOUS = "simultaneous"


class Reward(StrEnum):
    """As `alloc.problems.game.Reward`."""

    MAKESPAN = "makespan"
    COVERAGE = "coverage"


class Engine(StrEnum):
    """As `alloc.allocators.parallel.engine.ENGINES`."""

    SERIAL = "serial"
    PROCESSES = "processes"
    RAY = "ray"


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("train", epilog=EXAMPLES)(train_command)


def train_command(
    method: Annotated[str, typer.Argument(metavar="METHOD", help="What to train: gappo, ppo, a2c, dqn or ddpg.")],
    output: Annotated[str, typer.Option(metavar="FILE", help="Policy file to write: the best networks up to now.")],
    steps: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Decisions of agents, those of the whole population and before --resume included.",
            show_default=f"{STEPS}; none where --minutes or --iterations is given",
        ),
    ] = None,
    minutes: Annotated[
        float | None, typer.Option(min=0, help="Minutes of training, those before --resume included.")
    ] = None,
    iterations: Annotated[int | None, typer.Option(min=0, help="Generations, those before --resume included.")] = None,
    patience: Annotated[
        int | None, typer.Option(min=1, help="Stop after so many generations without better networks.")
    ] = None,
    family: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Instances to train on: mixed, paper (small ones like the paper's), elsewhere, real, heavy-tailed, "
            "clustered, depots, short-range, travel, battery, priority, unbalanced or varied; may be repeated.",
            show_default="mixed",
        ),
    ] = None,
    instances: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|DIR",
            help="Train on these instances instead; with five or more, a fifth of them, drawn at random, "
            "judges the networks and is not trained on.",
        ),
    ] = None,
    init: Annotated[
        str | None, typer.Option(metavar="POLICY", help="Start from the networks of this policy file.")
    ] = None,
    population: Annotated[
        int | None, typer.Option(min=1, help="Networks that are trained and bred; for gappo only.", show_default="4")
    ] = None,
    lesson: Annotated[
        int, typer.Option(min=1, help="Decisions of agents between two generations, for each network.")
    ] = 20_000,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="A hyperparameter of the method, such as clip=0.1; may be repeated. A name that the method does not "
            "have, such as in help=, is answered by all that it has, and their defaults.",
        ),
    ] = None,
    turn: Annotated[Turn, typer.Option(help="Who moves: the best bids, or all agents at once.")] = Turn.BIDDING,
    reward: Annotated[Reward, typer.Option(help="Makespan, or the paper's coverage (3).")] = Reward.MAKESPAN,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Source of all randomness.")] = 0,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint.")] = False,
    checkpoint: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="The whole run, for --resume.", show_default="OUTPUT with .checkpoint"),
    ] = None,
    log: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="A CSV line for each generation.", show_default="OUTPUT with .csv"),
    ] = None,
    tensorboard: Annotated[
        str | None, typer.Option(metavar="DIR", help="Also write event files for TensorBoard there.")
    ] = None,
    engine: Annotated[Engine, typer.Option(help="Where the networks of the population learn.")] = Engine.SERIAL,
    workers: Annotated[
        int | None,
        typer.Option(min=1, max=1024, help="For --engine processes.", show_default="all processors"),
    ] = None,
    address: Annotated[
        str | None,
        typer.Option(
            help="For --engine ray: head of the cluster.", show_default="RAY_ADDRESS, else the cluster on this machine"
        ),
    ] = None,
    threads: Annotated[
        int,
        typer.Option(min=1, max=1024, help="Threads of torch; the tensors are small, and more than one rarely pays."),
    ] = 1,
) -> None:
    """Train a learned method, with a checkpoint after each generation."""
    check_output(output)
    kept = checkpoint or str(Path(output).with_suffix(".checkpoint"))
    lines = log or str(Path(output).with_suffix(".csv"))
    check_outputs(("--output", output), ("--checkpoint", kept), ("--log", lines), read=[("--init", init)])
    if STANDARD in (output, kept, lines):
        raise typer.BadParameter("policy, checkpoint and log must be files", param_hint="'--output'")
    # from cheap to dear: nobody need wait for torch to be told of a mistake that can be seen without it
    families = family or ["mixed"]
    learner = learner_parameters(method, families, settings or [])
    if population is not None and method != "gappo":
        raise typer.BadParameter(f"{method} trains one network; gappo breeds several", param_hint="'--population'")
    from alloc.allocators.parallel.engine import EngineError, check_engine, make_engine

    check_engine(engine.value, workers, address)
    problems = None if instances is None else read_instances(instances)
    if init is not None:
        from alloc.allocators.learned.files.policy_header import read_header

        read_header(init)
    policy, run = Path(output), Path(kept)
    check_free(policy, run, Path(lines), resume=resume)
    check_suffix(policy)
    from alloc.allocators.learned.training.log import summary_writer
    from alloc.allocators.learned.training.trainer import Limits, train

    if tensorboard is not None:
        summary_writer()  # a writer of its own would hide what is in the folder
    parameters = training_parameters(
        method,
        learner,
        families=families,
        lesson=lesson,
        population=population,
        turn=turn.value,
        reward=reward.value,
        init=init,
    )
    trainer = new_trainer(parameters, seed, problems, init, run if resume else None)
    if steps is None and minutes is None and iterations is None:
        steps = STEPS
    limits = Limits(steps, iterations, minutes, patience)
    with make_engine(engine.value, workers, address, threads) as where:
        try:
            with _interrupts():
                train(
                    trainer,
                    policy,
                    checkpoint=run,
                    log=Path(lines),
                    limits=limits,
                    tensorboard=None if tensorboard is None else Path(tensorboard),
                    engine=where,
                    on_report=lambda report: _tell(report, trainer, limits),
                )
        except KeyboardInterrupt:
            note(f"interrupted; {kept} holds {counted(trainer.generation, 'generation')}")
        except EngineError as error:
            complain(
                f"{error}; {kept} holds {counted(trainer.generation, 'generation')}, and --resume goes on from them"
            )
            raise typer.Exit(1) from None
    _close(trainer, policy)


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
    """Let SIGTERM do what Ctrl-C does: what is on disk is whole at any moment, so that neither has to wait."""

    def interrupt(*_: Any) -> None:
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
