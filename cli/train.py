"""``alloc train``."""

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from alloc.cli.console import note, number, say
from alloc.cli.files import check_writable
from alloc.cli.options import examples

if TYPE_CHECKING:
    from alloc.allocators.learned.train import Limits, Report, Trainer, TrainingParameters
    from alloc.problems import Instance
    from alloc.problems.game import Board

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

MOST_NAMES = 10
"""Instances that are named at the most."""


class Turn(StrEnum):
    """As `alloc.problems.game.Turn`, without torch; a test compares the two."""

    BIDDING = "bidding"
    SIMULTANEOUS = "simultaneous"


class Reward(StrEnum):
    """As `alloc.problems.game.Reward`."""

    MAKESPAN = "makespan"
    COVERAGE = "coverage"


class Engine(StrEnum):
    """As `alloc.allocators.learned.engine.ENGINES`."""

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
    seed: Annotated[int, typer.Option(min=0, help="Source of all randomness.")] = 0,
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
        typer.Option(help="For --engine ray: head of the cluster.", show_default="one of its own"),
    ] = None,
    threads: Annotated[
        int,
        typer.Option(min=1, max=1024, help="Threads of torch; the tensors are small, and more than one rarely pays."),
    ] = 1,
) -> None:
    """Train a learned method, with a checkpoint after each generation."""
    policy = Path(output)
    kept, lines = Path(checkpoint or policy.with_suffix(".checkpoint")), Path(log or policy.with_suffix(".csv"))
    for path in (policy, kept, lines):
        check_writable(str(path))
    if len({policy, kept, lines}) < 3:
        raise typer.BadParameter("policy, checkpoint and log must be three files", param_hint="'--output'")
    if population is not None and method != "gappo":
        raise typer.BadParameter(f"{method} trains one network; gappo breeds several", param_hint="'--population'")
    from alloc.problems import InputError

    if kept.exists() and not resume:
        raise InputError("holds a training run; go on with --resume, or name another by --checkpoint", source=str(kept))
    from alloc.allocators.learned.engine import make_engine
    from alloc.allocators.learned.train import Limits, train
    from alloc.allocators.learned.training_log import event_writer

    if tensorboard is not None:
        event_writer(Path(tensorboard)).close()
    parameters = training_parameters(
        method,
        family=family or ["mixed"],
        lesson=lesson,
        population=population,
        settings=settings or [],
        turn=turn,
        reward=reward,
        init=init,
    )
    trainer = _trainer(parameters, seed, instances, init, kept if resume else None)
    if steps is None and minutes is None and iterations is None:
        steps = STEPS
    limits = Limits(steps, iterations, minutes, patience)
    with make_engine(engine.value, workers, address, threads) as where:
        try:
            with _interrupts():
                train(
                    trainer,
                    policy,
                    checkpoint=kept,
                    log=lines,
                    limits=limits,
                    tensorboard=None if tensorboard is None else Path(tensorboard),
                    engine=where,
                    on_report=lambda report: _tell(report, trainer, limits),
                )
        except KeyboardInterrupt:
            note(f"interrupted; {kept} holds {trainer.generation} generations")
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


def training_parameters(
    method: str,
    *,
    family: list[str],
    lesson: int,
    population: int | None = None,
    settings: Sequence[str] = (),
    turn: Turn = Turn.BIDDING,
    reward: Reward = Reward.MAKESPAN,
    init: str | None = None,
) -> "TrainingParameters":
    """Return what the options ask for.

    Raises
    ------
    InputError
        If there is no such method, family or hyperparameter, or no policy to start from.
    """
    from alloc.allocators.learned.curriculum import Curriculum
    from alloc.allocators.learned.families import FAMILIES
    from alloc.allocators.learned.methods import method_parameters
    from alloc.allocators.learned.network import NetworkSize
    from alloc.allocators.learned.policy_file import load_policy
    from alloc.allocators.learned.train import TrainingParameters
    from alloc.problems import InputError
    from alloc.problems.errors import nearest
    from alloc.problems.game import Rules

    for name in family:
        if name not in FAMILIES:
            raise InputError(f"no such family: {name!r}{nearest(name, FAMILIES)}", "--family")
    return TrainingParameters(
        method=method,
        population=(population or 4) if method == "gappo" else 1,
        decisions=lesson,
        network=NetworkSize() if init is None else load_policy(init, None)[0].size,
        learner=method_parameters(method, _pairs(settings)),
        curriculum=Curriculum(tuple(family)),
        rules=Rules(turn.value, reward.value),
    )


def _pairs(settings: Sequence[str]) -> dict[str, str]:
    for setting in settings:
        if "=" not in setting:
            raise typer.BadParameter(f"{setting!r} is not NAME=VALUE", param_hint="'--set'")
    return dict(setting.split("=", 1) for setting in settings)


def _trainer(
    parameters: "TrainingParameters", seed: int, instances: str | None, init: str | None, checkpoint: Path | None
) -> "Trainer":
    from dataclasses import replace

    from alloc.allocators.learned.policy_file import load_policy
    from alloc.allocators.learned.train import Trainer
    from alloc.allocators.learned.validation import own_games

    boards: list[Board] | None = None
    problems = [] if instances is None else _read(instances)
    if instances is not None:
        curriculum, boards = own_games(problems, parameters.curriculum)
        parameters = replace(parameters, curriculum=curriculum)
    weights = [] if init is None else [network.state_dict() for network in load_policy(init, None)]
    trainer = Trainer(parameters, seed, boards, weights)
    if checkpoint is not None:
        trainer.resume(checkpoint)
    if instances is not None:
        _tell_held_out(problems)
    return trainer


def _tell_held_out(instances: "Sequence[Instance]") -> None:
    from alloc.allocators.learned.validation import hold_out

    train, held = hold_out(instances)
    idle = sum(not (instance.workload > 0).any() for instance in instances)
    if idle:
        note(f"{idle} of {len(instances)} instances left out: there is no work to do")
    if train == held:
        note("the networks are judged on the instances that they learn from; with five or more, a fifth is held out")
    else:
        names = ", ".join(instance.name for instance in held[:MOST_NAMES])
        more = f" and {len(held) - MOST_NAMES} more" if len(held) > MOST_NAMES else ""
        note(f"{len(held)} of {len(instances)} instances held out to judge the networks: {names}{more}")


def _read(name: str) -> "list[Instance]":
    """Read an instance, or all that lie in a folder."""
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance

    folder = Path(name)
    if not folder.is_dir() or (folder / "agents.csv").exists():
        return [read_instance(name)]
    found = [path for path in sorted(folder.iterdir()) if path.suffix in (".json", ".npz") or path.is_dir()]
    if not found:
        raise InputError("holds no instances", source=name)
    return [read_instance(str(path)) for path in found]


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
