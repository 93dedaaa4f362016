"""Checkpoints: a whole training run in one file, which says what it is a run of; reading it never runs code."""

import hashlib
import io
import zipfile
from dataclasses import asdict, fields, is_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import torch

from alloc.allocators.learned.training.validation import VALIDATION
from alloc.problems import Instance
from alloc.problems.errors import InputError
from alloc.problems.formats import write_bytes_atomically
from alloc.problems.formats.files import reason
from alloc.problems.game import FEATURE_SET

if TYPE_CHECKING:
    from alloc.allocators.learned.training.trainer import TrainingParameters

CHECKPOINT_FORMAT = "alloc-checkpoint/3"


def described(parameters: "TrainingParameters", seed: int) -> dict[str, str]:
    """Return all that decides a training curve, flat, as text."""
    own = parameters.curriculum.own
    plain = replace(parameters, curriculum=replace(parameters.curriculum, own=()))
    text = {"seed": str(seed), "features": FEATURE_SET, "validation": VALIDATION, **_flat("", asdict(plain))}
    text["instances"] = ", ".join(_digest(aimed.instance) for aimed in own) or "none"
    return text


def _flat(prefix: str, values: dict[str, Any]) -> dict[str, str]:
    flat = {}
    for name, value in values.items():
        if isinstance(value, dict):
            flat.update(_flat(f"{prefix}{name}.", value))
        else:
            flat[prefix + name] = ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)
    return flat


def _digest(instance: Instance) -> str:
    """Short name of an instance that no other one has."""
    assert is_dataclass(instance)
    digest = hashlib.sha256()
    for column in fields(instance):
        value = getattr(instance, column.name)
        digest.update(value.tobytes() if hasattr(value, "tobytes") else repr(value).encode())
    return f"{instance.name} ({digest.hexdigest()[:8]})"


def write_checkpoint(path: Path, description: dict[str, str], state: dict[str, Any]) -> None:
    """Write a checkpoint whole or not at all."""
    buffer = io.BytesIO()
    torch.save({"format": CHECKPOINT_FORMAT, "description": description, **state}, buffer)
    write_bytes_atomically(path, buffer.getvalue())


def generations_in(path: Path) -> int:
    """Return how many generations a checkpoint of any version holds.

    Raises
    ------
    InputError
        If there is none at `path`.
    """
    return len(_stored(path)["history"])


def _stored(path: Path) -> dict[str, Any]:
    """Read a checkpoint of any version; only of a file whose content is wrong it is said that it may be removed."""
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


def _unpacked(file: BinaryIO, source: str) -> dict[str, Any]:
    message = "is no checkpoint, or is damaged; name another checkpoint, or remove it"
    if not zipfile.is_zipfile(file):
        raise InputError(message, "", source)
    file.seek(0)
    try:
        state: dict[str, Any] = torch.load(file, weights_only=True)
    except (OSError, MemoryError, torch.OutOfMemoryError):
        raise
    except Exception as error:  # torch's own words are about pickles, and its kinds of errors are many
        if "allocate memory" in str(error):  # what torch raises where the CPU has none left is a RuntimeError
            raise MemoryError(str(error)) from error
        raise InputError(message, "", source) from error
    if not isinstance(state, dict) or not {"format", "description", "history"} <= state.keys():
        raise InputError(message, "", source)
    return state


def read_checkpoint(path: Path, description: dict[str, str]) -> dict[str, Any]:
    """Return the state that was stored in a checkpoint of a run like this.

    Raises
    ------
    InputError
        If there is no checkpoint of this version at `path`, or it is one of a run with another description.
    """
    source, state = str(path), _stored(path)
    if state["format"] != CHECKPOINT_FORMAT:
        message = f"is a checkpoint of another version ({state['format']}, not {CHECKPOINT_FORMAT}); train anew"
        raise InputError(message, "", source)
    stored = state["description"]
    for name in sorted(stored.keys() | description.keys(), key=lambda name: (name != "method", name)):
        ours, theirs = description.get(name), stored.get(name)
        if ours != theirs:
            message = f"is a run with {name} {theirs}, not {ours}; use the same, or another checkpoint"
            raise InputError(message, "", source)
    return state
