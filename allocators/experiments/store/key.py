"""The conditions that determine a run, and their hash, which identifies the run in a store."""

import hashlib
import json
import os
import platform
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path

from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.plugins import plugins
from alloc.allocators.parallel.processors import available_threads
from alloc.allocators.registry import ENTRY_POINT_GROUP
from alloc.problems import Instance
from alloc.problems.formats.files import read_bytes
from alloc.problems.formats.npz import to_npz
from alloc.problems.formats.npz_archive import load
from alloc.problems.missions.files.document import mission_to_document
from alloc.problems.missions.mission import Mission

MISSION = "mission"
"""Objective of a run of a policy on a mission."""

LATER_FIELDS = {"knowledge": "", "deadline_ms": None}
"""Fields added in later versions, with defaults that are left out of the hash, so that older runs keep theirs."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """A run, described by everything that determines its outcome.

    Attributes
    ----------
    instance : str
        Hash of the content of the instance or mission, without its name; see `fingerprint`.
    method : str
        Name of the method, or of the policy.
    parameters : str
        Parameters that were given, as JSON; see `canonical`.
    seed : int
    objective : str
        `MISSION` for a policy.
    time_limit_s : float or None
    iterations : int or None
    target_gap : float or None
    threads : int
    version : str
        Version of this package and, for a plugin, of its package; see `versions`.
    machine : str
        See `this_machine`.
    knowledge : str
        Knowledge of agents in a mission; empty for a method.
    deadline_ms : float or None
        Time limit for each decision of a policy, in milliseconds.
    """

    instance: str = ""
    method: str = ""
    parameters: str = "{}"
    seed: int = 0
    objective: str = ""
    time_limit_s: float | None = None
    iterations: int | None = None
    target_gap: float | None = None
    threads: int = 1
    version: str = ""
    machine: str = ""
    knowledge: str = ""
    deadline_ms: float | None = None

    @property
    def key(self) -> str:
        """Hash of all fields; runs with the same key are identical."""
        values = asdict(self)
        counted = {name: value for name, value in values.items() if LATER_FIELDS.get(name, ...) != value}
        return hashlib.sha256(json.dumps(counted, sort_keys=True).encode()).hexdigest()

    @property
    def is_timed(self) -> bool:
        """Whether the outcome depends on the speed of the machine."""
        return self.time_limit_s is not None or self.deadline_ms is not None


def fingerprint(problem: Instance | Mission) -> str:
    """Return a hash of the content of an instance or a mission, without its name.

    Raises
    ------
    InputError
        If the problem cannot be written to a file.
    """
    if isinstance(problem, Mission):
        document = {**mission_to_document(problem), "name": ""}
        return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
    return fingerprint_of(to_npz(problem))


def fingerprint_of(content: bytes) -> str:
    """Return the `fingerprint` of the instance in the bytes of an .npz file."""
    digest = hashlib.sha256()
    for name, array in sorted(load(content).items()):
        if name != "name":
            digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
            digest.update(array.tobytes())
    return digest.hexdigest()


def canonical(settings: Mapping[str, object]) -> str:
    """Return the parameters of a method or policy as JSON; policy files are represented by their content.

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


def versions(name: str, group: str = ENTRY_POINT_GROUP, built_in: Collection[str] = (*BUILT_IN, "auto")) -> str:
    """Return the version of this package and, for a plugin, after a plus sign, that of its package.

    Parameters
    ----------
    name : str
        Name of a method or policy.
    group : str
        Entry point group of plugins of its kind.
    built_in : collection of str
        Names of built-in methods or policies.
    """
    own, entry = f"alloc {version('alloc-mrta')}", plugins(group, built_in).get(name)
    return own if entry is None or entry.dist is None else f"{own} + {entry.dist.name} {entry.dist.version}"


@cache
def this_machine() -> str:
    """Return a description of what determines the machine's speed: processor, number of processors, and system."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    model = models[0] if models else platform.processor() or platform.machine()
    python = ".".join(platform.python_version_tuple()[:2])
    return f"{model}, {os.cpu_count() or available_threads()} processors, {platform.system()}, Python {python}"
