"""Policy files for missions: networks in safetensors, with metadata that must match."""

import json
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from safetensors.torch import load, save

from alloc.allocators.learned.files.policy_file import sorted_metadata
from alloc.allocators.learned.files.policy_header import read_header
from alloc.allocators.learned.missions.feature_names import FEATURE_SET, FEATURES
from alloc.allocators.learned.missions.network import MissionNetwork
from alloc.allocators.learned.missions.network_arrays import HIDDEN
from alloc.problems import InputError
from alloc.problems.formats import read_bytes, write_bytes_atomically

POLICY_FORMAT = "alloc-mission-policy/1"

SHIPPED = Path(__file__).parents[1] / "files" / "policies" / "missions.safetensors"
SHIPPED_PPO = SHIPPED.with_name("missions-ppo.safetensors")
"""The policies that are used if none is given."""


def save_network(
    path: Path | str, network: MissionNetwork, method: str, training: Mapping[str, str | float] | None = None
) -> None:
    """Write a network to a policy file.

    Parameters
    ----------
    path : Path or str
    network : MissionNetwork
    method : str
        The method that trained it.
    training : mapping, optional
        Figures of the training, stored as informational metadata.
    """
    tensors = {name: weight.contiguous() for name, weight in network.state_dict().items()}
    metadata = {
        **_expected(),
        "method": method,
        "version": version("alloc-mrta"),
        "training": json.dumps(dict(training or {})),
    }
    write_bytes_atomically(path, sorted_metadata(save(tensors, metadata=metadata)))


def load_network(path: Path | str | None = None) -> MissionNetwork:
    """Read the network of a policy file; the shipped one by default.

    Raises
    ------
    InputError
        If the file cannot be read, is not for missions, has features or sizes that differ from those of this version,
        or contains weights that are not finite.
    """
    path = SHIPPED if path is None else path
    source, metadata = str(path), read_header(path)
    for key, expected in _expected().items():
        if metadata.get(key) != expected:
            hint = "train anew with alloc train gappo --missions"
            raise InputError(f"is {metadata.get(key)!r}, missions need {expected!r}; {hint}", key, source)
    tensors = load(read_bytes(path))
    if not all(bool(tensor.isfinite().all()) for tensor in tensors.values()):
        raise InputError("weights are not finite; train anew", "", source)
    network = MissionNetwork()
    try:
        network.load_state_dict(tensors)
    except RuntimeError as error:
        reason = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(f"holds other weights than its size says ({reason})", "size", source) from error
    return network.eval().requires_grad_(False)


def _expected() -> dict[str, str]:
    return {"format": POLICY_FORMAT, "features": FEATURE_SET, "size": json.dumps([FEATURES, HIDDEN])}
