"""Checkpoints: a complete training run in a file, with its description; reading one never executes code."""

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import torch

from alloc.allocators.learned.network.state_dict import StateDict
from alloc.problems import InputError
from alloc.problems.formats import write_bytes_atomically
from alloc.problems.formats.messages import reason

CHECKPOINT_FORMAT = "alloc-checkpoint/3"

STORED_NAMES = {
    "curriculum.energy_weight": "curriculum.price",
    "curriculum.growth_fraction": "curriculum.grown",
    "curriculum.initial_tasks": "curriculum.first_tasks",
    "curriculum.instances": "curriculum.own",
    "curriculum.max_agents": "curriculum.most_agents",
    "curriculum.max_pairs": "curriculum.pairs",
    "curriculum.max_relaxation": "curriculum.easing",
    "curriculum.relaxed_fraction": "curriculum.eased_share",
    "breeding.mutated_fraction": "breeding.mutated_share",
    "breeding.mutation_sigma": "breeding.mutation_size",
    "breeding.tournament_size": "breeding.tournament",
    "learner.actor_lr_fraction": "learner.actor_share",
    "learner.batch_size": "learner.minibatch",
    "learner.buffer_size": "learner.capacity",
    "learner.clip_coef": "learner.clip",
    "learner.double_q": "learner.double",
    "learner.ent_coef": "learner.entropy_weight",
    "learner.exploration_initial_eps": "learner.exploring",
    "learner.final_ent_coef": "learner.final_entropy_weight",
    "learner.final_lr_fraction": "learner.final_share",
    "learner.gae_lambda": "learner.smoothing",
    "learner.gamma": "learner.discount",
    "learner.max_grad_norm": "learner.max_gradient_norm",
    "learner.max_learning_rate": "learner.highest_rate",
    "learner.minibatch_size": "learner.minibatch",
    "learner.num_steps": "learner.steps",
    "learner.replay_ratio": "learner.reuse",
    "learner.softmax_temperature": "learner.softness",
    "learner.target_kl": "learner.kl_target",
    "learner.target_update_interval": "learner.target_period",
    "learner.tau": "learner.target_share",
    "learner.update_epochs": "learner.epochs",
    "learner.vf_coef": "learner.value_weight",
}
"""Names in descriptions of this format of parameters whose names in the program have changed."""

LATER = {
    "learner.breeding_interval": "30",
    "learner.gene_sigma": "0.03",
    "learner.genes": "1",
    "learner.replay_draws": "1",
}
"""Parameters that older descriptions lack, and the values that were then fixed."""


def write_checkpoint(path: Path, description: Mapping[str, str], state: StateDict) -> None:
    """Write a checkpoint atomically.

    Parameters
    ----------
    path : Path
    description : mapping of str to str
        Everything that determines the learning curve.
    state : StateDict
        The state of the run, with the reports of all generations as ``history``.
    """
    stored = {STORED_NAMES.get(name, name): value for name, value in description.items()}
    buffer = io.BytesIO()
    torch.save({"format": CHECKPOINT_FORMAT, "description": stored, **state}, buffer)
    write_bytes_atomically(path, buffer.getvalue())


def generations_in(path: Path) -> int:
    """Return the number of generations in a checkpoint of any version.

    Raises
    ------
    InputError
        If there is no checkpoint at `path`.
    """
    return len(_stored(path)["history"])


def _stored(path: Path) -> StateDict:
    """Read a checkpoint of any version; errors suggest removing the file only if its content is wrong."""
    source = str(path)
    try:
        with path.open("rb") as file:
            return _unpacked(file, source)
    except FileNotFoundError as error:
        raise InputError("no such checkpoint; begin a run without one", "", source) from error
    except PermissionError as error:
        raise InputError("may not be read; change its permissions", "", source) from error
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", "", source) from error
    except MemoryError as error:
        raise InputError("does not fit into memory", "", source) from error


def _unpacked(file: BinaryIO, source: str) -> StateDict:
    message = "is no checkpoint, or is damaged; name another checkpoint, or remove it"
    if not zipfile.is_zipfile(file):
        raise InputError(message, "", source)
    file.seek(0)
    try:
        state: StateDict = torch.load(file, weights_only=True)
    except (OSError, MemoryError, torch.OutOfMemoryError):
        raise
    except Exception as error:  # of many types, with messages about pickling
        if "allocate memory" in str(error):  # torch raises a RuntimeError if it runs out of CPU memory
            raise MemoryError(str(error)) from error
        raise InputError(message, "", source) from error
    if not isinstance(state, dict) or not {"format", "description", "history"} <= state.keys():
        raise InputError(message, "", source)
    return state


def read_checkpoint(path: Path, description: Mapping[str, str]) -> StateDict:
    """Return the state of a run with this description from a checkpoint.

    Raises
    ------
    InputError
        If there is no checkpoint of this version at `path`, or its run has another description.
    """
    source, state = str(path), _stored(path)
    if state["format"] != CHECKPOINT_FORMAT:
        message = f"is a checkpoint of another version ({state['format']}, not {CHECKPOINT_FORMAT}); train anew"
        raise InputError(message, "", source)
    theirs = dict(state["description"])
    ours = {
        name: (value, theirs.pop(STORED_NAMES.get(name, name), LATER.get(name))) for name, value in description.items()
    }
    pairs: dict[str, tuple[str | None, str | None]] = {
        **ours,
        **{name: (None, value) for name, value in theirs.items()},
    }
    for name in sorted(pairs, key=lambda name: (name != "method", name)):
        expected, found = pairs[name]
        if expected != found:
            message = f"is a run with {name} {found}, not {expected}; use the same, or another checkpoint"
            raise InputError(message, "", source)
    return state
