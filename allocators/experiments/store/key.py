"""What decides a run, and the hash by which the store knows it."""

import hashlib
import json
import os
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import entry_points, version
from pathlib import Path

from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.parallel.processors import available_threads
from alloc.problems import Instance
from alloc.problems.formats.files import read_bytes
from alloc.problems.formats.npz import to_npz
from alloc.problems.formats.npz_archive import load


@dataclass(frozen=True, kw_only=True)
class Run:
    """What is to be run, and all that decides its outcome.

    Attributes
    ----------
    instance : str
        Hash of the content of the instance, which is not its name; see `fingerprint`.
    method : str
        Name of the method.
    parameters : str
        Those that were given, as JSON; see `canonical`.
    seed : int
    objective : str
    time_limit_s : float or None
    iterations : int or None
    target_gap : float or None
    threads : int
    version : str
        Of this package and, for a plugin, of its own; see `versions`.
    machine : str
        See `this_machine`.
    """

    instance: str
    method: str
    parameters: str
    seed: int
    objective: str
    time_limit_s: float | None
    iterations: int | None
    target_gap: float | None
    threads: int
    version: str
    machine: str

    @property
    def key(self) -> str:
        """A hash of all fields: two runs with the same key are the same run."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()


def fingerprint(instance: Instance) -> str:
    """Return a hash of all that an instance holds but for its name.

    Raises
    ------
    InputError
        If it cannot be written as .npz.
    """
    return fingerprint_of(to_npz(instance))


def fingerprint_of(content: bytes) -> str:
    """Return the `fingerprint` of the instance in the bytes of an .npz file."""
    digest = hashlib.sha256()
    for name, array in sorted(load(content).items()):
        if name != "name":
            digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
            digest.update(array.tobytes())
    return digest.hexdigest()


def canonical(settings: Mapping[str, object]) -> str:
    """Return the parameters of a method as JSON; a file, such as a policy, counts by its content.

    Raises
    ------
    InputError
        If a policy cannot be read.
    """
    known = dict(settings)
    policy = known.get("policy")
    if isinstance(policy, str) and os.path.exists(policy):
        known["policy"] = f"sha256:{hashlib.sha256(read_bytes(policy)).hexdigest()}"
    return json.dumps(known, sort_keys=True, default=str)


def versions(method: str) -> str:
    """Return the version of this package and, behind a plus sign, of the package that a plugin comes from."""
    own = f"alloc {version('alloc-mrta')}"
    if method in BUILT_IN or method == "auto":
        return own
    found = [entry.dist for entry in entry_points(group="alloc.allocators") if entry.name == method]
    return own if not found or found[0] is None else f"{own} + {found[0].name} {found[0].version}"


@cache
def this_machine() -> str:
    """Return what the machine is as far as it decides how fast runs are: its processor, how many, and the system."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    model = models[0] if models else platform.processor() or platform.machine()
    python = ".".join(platform.python_version_tuple()[:2])
    return f"{model}, {os.cpu_count() or available_threads()} processors, {platform.system()}, Python {python}"
