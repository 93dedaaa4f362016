"""Policy files for missions: networks in safetensors, with metadata that must match."""

import json
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from safetensors.torch import load, save
from torch import Tensor, nn

from alloc.allocators.learned.files.policy_file import sorted_metadata
from alloc.allocators.learned.files.policy_header import read_header
from alloc.allocators.learned.missions.feature_names import FEATURE_SET, FEATURES, FORMER_FEATURES, FORMER_SET
from alloc.allocators.learned.missions.network import MissionNetwork
from alloc.allocators.learned.missions.network_arrays import HIDDEN
from alloc.problems import InputError
from alloc.problems.formats import read_bytes, write_bytes_atomically

POLICY_FORMAT = "alloc-mission-policy/1"

SHIPPED = Path(__file__).parents[1] / "files" / "policies" / "missions.safetensors"
SHIPPED_PPO = SHIPPED.with_name("missions-ppo.safetensors")
"""The policies that are used where none is given."""


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
        Figures of the training, for information.
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
        If the file cannot be read, is not for missions, has other features or sizes than this version, or weights that
        are not finite.
    """
    path = SHIPPED if path is None else path
    source, metadata = str(path), read_header(path)
    is_former = metadata.get("features") == FORMER_SET
    for key, expected in (_expected(FORMER_SET, FORMER_FEATURES) if is_former else _expected()).items():
        if metadata.get(key) != expected:
            hint = "train anew with alloc train gappo --missions"
            raise InputError(f"is {metadata.get(key)!r}, missions need {expected!r}; {hint}", key, source)
    tensors = load(read_bytes(path))
    if not all(bool(tensor.isfinite().all()) for tensor in tensors.values()):
        raise InputError("weights are not finite; train anew", "", source)
    if is_former:
        tensors = {name: _widened(name, tensor) for name, tensor in tensors.items()}
    network = MissionNetwork()
    try:
        network.load_state_dict(tensors)
    except RuntimeError as error:
        reason = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(f"holds other weights than its size says ({reason})", "size", source) from error
    return network.eval().requires_grad_(False)


def _expected(features: str = FEATURE_SET, count: int = FEATURES) -> dict[str, str]:
    return {"format": POLICY_FORMAT, "features": features, "size": json.dumps([count, HIDDEN])}


def _widened(name: str, weight: Tensor) -> Tensor:
    """Return a weight of a network that knew the first features only, with 0 for the later ones."""
    is_of_features = name in ("inner.weight", "skip.weight")
    return nn.functional.pad(weight, (0, FEATURES - FORMER_FEATURES)) if is_of_features else weight
