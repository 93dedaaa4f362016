"""What ``alloc train`` and ``alloc tune`` ask of the library; what needs no torch is checked before it is loaded."""

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from alloc.cli.options import assignments
from alloc.cli.output.console import STANDARD, note
from alloc.cli.output.files import check_output, check_outputs

if TYPE_CHECKING:
    from alloc.allocators.learned.training.trainer import Trainer, TrainingParameters
    from alloc.problems import Instance
    from alloc.problems.game import Board

MAX_NAMES = 10
"""Number of instances that a note lists at most."""


@dataclass(frozen=True)
class TrainingFiles:
    """Files that a training writes.

    Attributes
    ----------
    policy, checkpoint, log : Path
        The best networks so far, the state of the run, and a CSV line for each generation.
    tensorboard : Path or None
        Folder of event files.
    """

    policy: Path
    checkpoint: Path
    log: Path
    tensorboard: Path | None

    @classmethod
    def of(
        cls, output: str, checkpoint: str | None, log: str | None, tensorboard: str | None, *, read: str | None
    ) -> "TrainingFiles":
        """Return the files that the options name; each can be written, and none is `read` or named twice."""
        check_output(output)
        state = checkpoint or str(Path(output).with_suffix(".checkpoint"))
        lines = log or str(Path(output).with_suffix(".csv"))
        check_outputs(("--output", output), ("--checkpoint", state), ("--log", lines), read=[("--init", read)])
        if STANDARD in (output, state, lines):
            raise typer.BadParameter("policy, checkpoint and log must be files", param_hint="'--output'")
        return cls(Path(output), Path(state), Path(lines), None if tensorboard is None else Path(tensorboard))

    def check(self, init: str | None, *, resume: bool) -> None:
        """Raise an `InputError` if a file would be lost, is not what it should be, or TensorBoard is not installed."""
        from alloc.allocators.learned.files.policy_header import read_header
        from alloc.allocators.learned.training.log import summary_writer

        if init is not None:
            read_header(init)
        check_free(self.policy, self.checkpoint, self.log, resume=resume)
        check_suffix(self.policy)
        if self.tensorboard is not None:
            summary_writer()  # the class alone: a writer would hide what is in the folder


def learner_parameters(
    method: str, families: Sequence[str], settings: Sequence[str] = (), population: int | None = None
) -> object:
    """Return the hyperparameters that the options set.

    Raises
    ------
    InputError
        If there is no such method, family or hyperparameter, or one is out of range.
    BadParameter
        If the method has no population.
    """
    from alloc.allocators.learned.algorithms.registry import method_parameters
    from alloc.allocators.learned.training.families import FAMILIES
    from alloc.problems import InputError
    from alloc.problems.errors import nearest

    parameters = method_parameters(method, assignments(settings))
    for name in families:
        if name not in FAMILIES:
            raise InputError(f"no such family: {name!r}{nearest(name, FAMILIES)}", "family")
    if population is not None and method != "gappo":
        raise typer.BadParameter(f"{method} trains one network; gappo breeds several", param_hint="'--population'")
    return parameters


def read_instances(name: str) -> "list[Instance]":
    """Read an instance, or all instances in a folder."""
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance

    folder = Path(name)
    if not folder.is_dir() or (folder / "agents.csv").exists():
        return [read_instance(name)]
    found = [path for path in sorted(folder.iterdir()) if path.suffix in (".json", ".npz") or path.is_dir()]
    if not found:
        raise InputError("holds no instances", source=name)
    return [read_instance(str(path)) for path in found]


def training_parameters(
    method: str,
    learner: object,
    *,
    families: Sequence[str],
    generation_steps: int,
    population: int | None = None,
    turn: str = "bidding",
    reward: str = "makespan",
    init: str | None = None,
) -> "TrainingParameters":
    """Return the parameters that the options set; the networks are as large as those of `init`."""
    from alloc.allocators.learned.files.policy_file import load_policy
    from alloc.allocators.learned.network.actor_critic import NetworkSize
    from alloc.allocators.learned.training.curriculum import Curriculum
    from alloc.allocators.learned.training.trainer import TrainingParameters
    from alloc.problems.game import Rules

    return TrainingParameters(
        method=method,
        population=(population or 4) if method == "gappo" else 1,
        decisions=generation_steps,
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
    """Return a trainer on these instances that starts from the networks of `init`, or continues from `checkpoint`."""
    from dataclasses import replace

    from alloc.allocators.learned.files.policy_file import load_policy
    from alloc.allocators.learned.training.trainer import Trainer
    from alloc.allocators.learned.training.validation import own_games

    boards: list[Board] | None = None
    if instances is not None:
        curriculum, boards = own_games(instances, parameters.curriculum)
        parameters = replace(parameters, curriculum=curriculum)
    weights = [] if init is None else [network.state_dict() for network in load_policy(init, None)]
    trainer = Trainer(parameters, seed, boards, weights)
    if checkpoint is not None:
        trainer.resume(checkpoint)
    if instances is not None:
        _note_held_out(instances)
    return trainer


def _note_held_out(instances: "Sequence[Instance]") -> None:
    from alloc.allocators.learned.training.validation import hold_out

    train, held = hold_out(instances)
    idle = sum(not (instance.workload > 0).any() for instance in instances)
    if idle:
        note(f"{idle} of {len(instances)} instances left out: there is no work to do")
    if train == held:
        note("validation is on the instances of the training; with five or more, a fifth is held out")
    else:
        names = ", ".join(instance.name for instance in held[:MAX_NAMES])
        more = f" and {len(held) - MAX_NAMES} more" if len(held) > MAX_NAMES else ""
        note(f"{len(held)} of {len(instances)} instances held out for validation: {names}{more}")


def check_free(policy: Path, checkpoint: Path, log: Path, *, resume: bool) -> None:
    """Raise an `InputError` if training would replace a file that it did not write, or a run that it does not resume.

    A run without a complete generation may be replaced.
    """
    from alloc.problems import InputError

    if resume and not checkpoint.exists():
        raise InputError("no such checkpoint; leave --resume out to start one", source=str(checkpoint))
    if not resume and _is_filled(checkpoint):
        if not zipfile.is_zipfile(checkpoint):
            message = "exists and is no checkpoint; name another by --checkpoint, or remove it"
            raise InputError(message, source=str(checkpoint))
        if policy.exists() or _generations(checkpoint):
            message = "holds a training run; continue with --resume, or name another by --checkpoint"
            raise InputError(message, source=str(checkpoint))
    if _is_filled(policy) and not _is_policy(policy):
        message = "exists and is no policy file; name another by --output, or remove it"
        raise InputError(message, source=str(policy))
    if _is_filled(policy) and not resume:
        message = "holds a policy, and there is no checkpoint to continue from; name another by --output, or remove it"
        raise InputError(message, source=str(policy))
    if _is_filled(log) and not _is_log(log):
        message = "exists and is no log of a training; name another by --log, or remove it"
        raise InputError(message, source=str(log))


def check_suffix(policy: Path) -> None:
    """Raise an `InputError` if the policy file has the suffix of another kind of file."""
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
