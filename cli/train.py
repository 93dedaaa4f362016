"""``alloc train``."""

import threading
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli.console import note, number, say
from alloc.cli.files import check_writable
from alloc.cli.options import examples

if TYPE_CHECKING:
    from alloc.allocators.learned.train import Report, Trainer

EXAMPLES = examples(
    "alloc train gappo --output policy.safetensors --minutes 30",
    "alloc train gappo --output policy.safetensors --minutes 60 --resume",
    "alloc solve demo.json --method gappo --policy policy.safetensors",
    closing="Ctrl-C ends the training; what the last whole generation brought is stored, and --resume goes on from it.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("train", epilog=EXAMPLES)(train_command)


def train_command(
    method: Annotated[str, typer.Argument(metavar="METHOD", help="What to train: gappo.")],
    output: Annotated[str, typer.Option(metavar="FILE", help="Policy file to write.")],
    minutes: Annotated[
        float | None,
        typer.Option(min=0, help="Minutes of training, those before --resume included.", show_default="10"),
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(min=0, help="Generations, those before --resume included; then no limit of time.")
    ] = None,
    population: Annotated[int, typer.Option(min=1, help="Networks that are trained and bred.")] = 4,
    seed: Annotated[int, typer.Option(min=0, help="Source of all randomness.")] = 0,
    checkpoint: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="The whole run, for --resume.", show_default="OUTPUT with .checkpoint"),
    ] = None,
    log: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="A CSV line for each generation.", show_default="OUTPUT with .csv"),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint.")] = False,
    threads: Annotated[
        int,
        typer.Option(min=1, max=1024, help="Threads of torch; the tensors are small, and more than one rarely pays."),
    ] = 1,
) -> None:
    """Train a learned method, with a checkpoint after each generation."""
    if method != "gappo":
        raise typer.BadParameter(f"{method!r} learns nothing; gappo does", param_hint="METHOD")
    policy = Path(output)
    kept, lines = Path(checkpoint or policy.with_suffix(".checkpoint")), Path(log or policy.with_suffix(".csv"))
    for path in (policy, kept, lines):
        check_writable(str(path))
    if len({policy, kept, lines}) < 3:
        raise typer.BadParameter("policy, checkpoint and log must be three files", param_hint="'--output'")
    from alloc.problems import InputError

    if kept.exists() and not resume:
        raise InputError("holds a training run; go on with --resume, or name another by --checkpoint", source=str(kept))
    from alloc.allocators.interrupt import signals_set
    from alloc.allocators.learned.train import train

    trainer = _trainer(kept, population, seed, threads, resume=resume)
    if not resume:
        lines.unlink(missing_ok=True)
    stop = threading.Event()
    with signals_set(stop):
        train(
            trainer,
            policy,
            checkpoint=kept,
            log=lines,
            generations=iterations,
            minutes=10.0 if minutes is None and iterations is None else minutes,
            should_stop=stop.is_set,
            on_report=_tell,
        )
    if stop.is_set():
        note(f"interrupted; {kept} holds {trainer.generation} generations")
    if trainer.generation == 0:
        note(f"no generation is complete, and {policy} is not written")
        raise typer.Exit(1)


def _trainer(checkpoint: Path, population: int, seed: int, threads: int, *, resume: bool) -> "Trainer":
    import torch

    from alloc.allocators.learned.train import Trainer, TrainingParameters

    torch.set_num_threads(threads)
    parameters = TrainingParameters(population=population)
    return Trainer.resume(checkpoint, parameters) if resume else Trainer(parameters, seed)


def _tell(report: "Report") -> None:
    say(
        f"generation {report.generation:4d}  {report.seconds / 60:7.1f} min  reward {number(report.reward, 4)}"
        f"  T short by {number(report.shortfall, 3)}  distance {number(report.distance, 3)}"
        f"  entropy {number(report.entropy, 3)}"
    )
