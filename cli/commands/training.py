"""What ``alloc train`` and ``alloc tune`` ask of the library; what needs no torch is checked before it is loaded."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from alloc.cli.options import assignments
from alloc.cli.output.console import STANDARD, note
from alloc.cli.output.files import check_output, check_outputs

if TYPE_CHECKING:
    from alloc.allocators.learned.algorithms.hyperparameters import Hyperparameters
    from alloc.allocators.learned.training.parameters import TrainingParameters
    from alloc.problems import Instance

MAX_NAMES = 10
"""Number of instances that a note lists at most."""


def check_training_files(
    output: str, checkpoint: str | None, log: str | None, tensorboard: str | None, init: str | None, *, resume: bool
) -> None:
    """Raise an `InputError` if a file cannot be written, would be lost, or is not what it should be.

    No file may be named twice; TensorBoard must be installed where event files are asked for.
    """
    from alloc.allocators.learned.files.policy_header import read_header
    from alloc.allocators.learned.files.run_files import RunFiles
    from alloc.allocators.learned.files.training_log import summary_writer

    check_output(output)
    files = RunFiles.beside(output, checkpoint, log)
    state, lines = str(files.checkpoint), str(files.log)
    check_outputs(("--output", output), ("--checkpoint", state), ("--log", lines), read=[("--init", init)])
    if STANDARD in (output, state, lines):
        raise typer.BadParameter("policy, checkpoint and log must be files", param_hint="'--output'")
    if init is not None:
        read_header(init)
    files.check(resume=resume)
    if tensorboard is not None:
        summary_writer()  # the class alone: a writer would hide what is in the folder


def learner_parameters(
    method: str, families: Sequence[str], settings: Sequence[str] = (), population: int | None = None
) -> "Hyperparameters":
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
    learner: "Hyperparameters",
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
    from alloc.allocators.learned.training.parameters import TrainingParameters
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


def note_held_out(instances: "Sequence[Instance]") -> None:
    """Say which instances the policies are judged on."""
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
