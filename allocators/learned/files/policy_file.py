"""Policy files: weights in safetensors, with metadata that must match; reading one never executes code."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import torch
from safetensors.torch import load, save

from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.learned.files.policy_header import read_header
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, uninitialised
from alloc.problems import InputError
from alloc.problems.formats import read_bytes, write_bytes_atomically
from alloc.problems.game import AGENT_FEATURES, FEATURE_SET, PAIR_FEATURES, TASK_FEATURES, TurnRule

POLICY_FORMAT = "alloc-policy/1"


def save_policy(
    path: Path | str, networks: Sequence[ActorCritic], method: str, training: Mapping[str, str | float] | None = None
) -> None:
    """Write networks to a policy file, best first.

    Parameters
    ----------
    path : Path or str
    networks : sequence of ActorCritic
        Networks of the same size.
    method : str
        The method that trained them.
    training : mapping, optional
        Figures of the training, stored as informational metadata.
    """
    tensors = {
        f"{number}.{name}": weight.contiguous()
        for number, network in enumerate(networks)
        for name, weight in network.state_dict().items()
    }
    metadata = {
        **_metadata(networks[0].size, len(networks), method),
        "version": version("alloc-mrta"),
        "training": json.dumps(dict(training or {})),
    }
    write_bytes_atomically(path, sorted_metadata(save(tensors, metadata=metadata)))


def sorted_metadata(data: bytes) -> bytes:
    """Return a safetensors file with sorted metadata, which the library writes in random order."""
    end = 8 + int.from_bytes(data[:8], "little")
    header = json.loads(data[8:end])
    header["__metadata__"] = dict(sorted(header["__metadata__"].items()))
    text = json.dumps(header, ensure_ascii=False, separators=(",", ":")).encode()
    return data[:8] + text.ljust(end - 8) + data[end:]


def _metadata(size: NetworkSize, count: int, method: str) -> dict[str, str]:
    return {
        "format": POLICY_FORMAT,
        "method": method,
        "features": FEATURE_SET,
        "feature_counts": json.dumps([PAIR_FEATURES, TASK_FEATURES, AGENT_FEATURES]),
        "networks": str(count),
        "size": json.dumps(asdict(size)),
    }


def load_policy(path: Path | str, method: str | None, device: torch.device | None = None) -> list[ActorCritic]:
    """Read the networks of a policy file, best first, in evaluation mode and without gradients.

    Parameters
    ----------
    path : Path or str
    method : str or None
        The method that must have trained them; None for any.
    device : torch.device, optional

    Raises
    ------
    InputError
        If the file cannot be read, is for another method, has features or sizes that differ from those of this version,
        or contains weights that are not finite.
    """
    source, metadata = str(path), read_header(path)
    tensors = load(read_bytes(path))  # safetensors itself cannot open all file names
    try:
        size, count = NetworkSize(**json.loads(metadata["size"])), int(metadata["networks"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError("does not describe its networks; use a file by `alloc train`", "metadata", source) from error
    theirs = metadata.get("method", "")
    if method not in (None, theirs) and theirs in BUILT_IN:
        raise InputError(f"holds a policy of {theirs}; use it with the method {theirs}", "", source)
    expected = _metadata(size, count, theirs if method is None else method)
    for key in ("format", "method", "features", "feature_counts"):
        if metadata.get(key) != expected[key]:
            raise InputError(f"is {metadata.get(key)!r}, this version needs {expected[key]!r}; train anew", key, source)
    turn = _turn(metadata, source)
    if method is not None and turn != TurnRule.BIDDING:
        raise InputError(f"was trained for turns by {turn}, but plans are made by {TurnRule.BIDDING}", "turn", source)
    if not all(bool(tensor.isfinite().all()) for tensor in tensors.values()):
        raise InputError("weights are not finite; train anew", "", source)
    try:
        return [_network(size, tensors, number, device) for number in range(count)]
    except (RuntimeError, ValueError) as error:
        reason = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(f"holds other weights than its size says ({reason})", "size", source) from error


def _turn(metadata: Mapping[str, str], source: str) -> str:
    try:
        turn: str = json.loads(metadata.get("training", "{}")).get("turn", TurnRule.BIDDING)
    except (AttributeError, ValueError) as error:
        raise InputError("does not describe its training; use a file by `alloc train`", "training", source) from error
    return turn


def _network(
    size: NetworkSize, tensors: dict[str, torch.Tensor], number: int, device: torch.device | None
) -> ActorCritic:
    network = uninitialised(size)
    prefix = f"{number}."
    network.load_state_dict({name.removeprefix(prefix): t for name, t in tensors.items() if name.startswith(prefix)})
    return network.to(device).eval().requires_grad_(False)
