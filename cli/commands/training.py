"""What `alloc train` and `alloc tune` are asked for; whatever can be checked without torch is."""

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from alloc.cli.output.console import note

if TYPE_CHECKING:
    from alloc.allocators.learned.algorithms.hyperparameters import Hyperparameters
    from alloc.allocators.learned.training.parameters import TrainingParameters
    from alloc.allocators.learned.training.trainer import Trainer
    from alloc.problems import Instance
    from alloc.problems.game import Board

MOST_NAMES = 10
"""Instances that are named at the most."""


def learner_parameters(method: str, families: Sequence[str], settings: Sequence[str] = ()) -> "Hyperparameters":
    """Return the hyperparameters that the options ask for.

    Raises
    ------
    InputError
        If there is no such method, family or hyperparameter, or one is out of range.
    """
    from alloc.allocators.learned.algorithms.registry import method_parameters
    from alloc.allocators.learned.training.families import FAMILIES
    from alloc.problems import InputError
    from alloc.problems.errors import nearest

    parameters = method_parameters(method, _pairs(settings))
    for name in families:
        if name not in FAMILIES:
            raise InputError(f"no such family: {name!r}{nearest(name, FAMILIES)}", "family")
    return parameters


def _pairs(settings: Sequence[str]) -> dict[str, str]:
    for setting in settings:
        if "=" not in setting:
            raise typer.BadParameter(f"{setting!r} is not NAME=VALUE", param_hint="'--set'")
    return dict(setting.split("=", 1) for setting in settings)


def read_instances(name: str) -> "list[Instance]":
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


def check_free(policy: Path, checkpoint: Path, log: Path, *, resume: bool) -> None:
    """Raise an `InputError` where training would replace what it did not write, or a run that is not gone on with.

    A run without a generation is nothing to be kept.
    """
    from alloc.problems import InputError

    if resume and not checkpoint.exists():
        raise InputError("no such checkpoint; leave --resume out to begin one", source=str(checkpoint))
    if not resume and _is_filled(checkpoint):
        if not zipfile.is_zipfile(checkpoint):
            message = "is there already, and no checkpoint; name another by --checkpoint, or remove it"
            raise InputError(message, source=str(checkpoint))
        if policy.exists() or _generations(checkpoint):
            message = "holds a training run; go on with --resume, or name another by --checkpoint"
            raise InputError(message, source=str(checkpoint))
    if _is_filled(policy) and not _is_policy(policy):
        message = "is there already, and no policy file; name another by --output, or remove it"
        raise InputError(message, source=str(policy))
    if _is_filled(policy) and not resume:
        message = "holds a policy, and no checkpoint to go on from is beside it; name another by --output, or remove it"
        raise InputError(message, source=str(policy))
    if _is_filled(log) and not _is_log(log):
        message = "is there already, and no log of a training; name another by --log, or remove it"
        raise InputError(message, source=str(log))


def check_suffix(policy: Path) -> None:
    """Raise an `InputError` where the name of a policy file says that it is of another kind."""
    from alloc.problems import InputError

    if policy.suffix.lower() not in ("", ".safetensors"):
        message = f"has the suffix {policy.suffix!r}, but policies are safetensors; end it in .safetensors"
        raise InputError(message, source=str(policy))


def _is_filled(path: Path) -> bool:
    return path.is_file() and path.stat().st_size > 0


def _is_log(path: Path) -> bool:
    beginning = b"generation,decisions,"
    with path.open("rb") as file:
        return file.read(len(beginning)) == beginning


def _generations(checkpoint: Path) -> int:
    from alloc.allocators.learned.files.checkpoint import generations_in

    return generations_in(checkpoint)


def _is_policy(path: Path) -> bool:
    from alloc.allocators.learned.files.policy_header import read_header
    from alloc.problems import InputError

    try:
        return "networks" in read_header(path)
    except InputError:
        return False


def training_parameters(
    method: str,
    learner: "Hyperparameters",
    *,
    families: Sequence[str],
    lesson: int,
    population: int | None = None,
    turn: str = "bidding",
    reward: str = "makespan",
    init: str | None = None,
) -> "TrainingParameters":
    """Return what the options ask for, the networks as large as those of `init`."""
    from alloc.allocators.learned.files.policy_file import load_policy
    from alloc.allocators.learned.network.actor_critic import NetworkSize
    from alloc.allocators.learned.training.curriculum import Curriculum
    from alloc.allocators.learned.training.parameters import TrainingParameters
    from alloc.problems.game import Rules

    return TrainingParameters(
        method=method,
        population=(population or 4) if method == "gappo" else 1,
        decisions=lesson,
        network=NetworkSize() if init is None else load_policy(init, None)[0].size,
        learner=learner,
        curriculum=Curriculum(tuple(families)),
        rules=Rules(turn, reward),
    )


def new_trainer(
    parameters: "TrainingParameters",
    seed: int,
    instances: "Sequence[Instance] | None",
    init: str | None,
    checkpoint: Path | None,
) -> "Trainer":
    """Return a trainer on these instances, that begins with the networks of `init` or goes on from `checkpoint`."""
    from dataclasses import replace

    from alloc.allocators.learned.files.policy_file import load_policy
    from alloc.allocators.learned.training.trainer import Trainer
    from alloc.allocators.learned.training.validation import games_on

    boards: list[Board] | None = None
    if instances is not None:
        curriculum, boards = games_on(instances, parameters.curriculum)
        parameters = replace(parameters, curriculum=curriculum)
    weights = [] if init is None else [network.state_dict() for network in load_policy(init, None)]
    trainer = Trainer(parameters, seed, boards, weights)
    if checkpoint is not None:
        trainer.resume(checkpoint)
    if instances is not None:
        _tell_held_out(instances)
    return trainer


def _tell_held_out(instances: "Sequence[Instance]") -> None:
    from alloc.allocators.learned.training.validation import hold_out

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
