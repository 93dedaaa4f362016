"""With what rows were made: versions and machines, one entry for each combination."""

import json
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from alloc.allocators.experiments.store.key import this_machine
from alloc.problems.formats import write_bytes_atomically

PACKAGES = ("alloc-mrta", "numpy", "torch", "numba", "scipy", "deap", "highspy", "ortools", "matplotlib")


def environment() -> dict[str, str]:
    """Return the machine, and the versions of the packages that decide figures."""
    found = {"machine": this_machine()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def read_manifest(path: Path) -> list[dict[str, str]]:
    """Return all entries of a manifest, none where there is no such file."""
    if not path.exists():
        return []
    entries: list[dict[str, str]] = json.loads(path.read_text(encoding="utf-8"))
    return entries


def note_environment(path: Path) -> None:
    """Add this environment to a manifest, unless it is there."""
    known, here = read_manifest(path), environment()
    if here not in known:
        write_bytes_atomically(path, (json.dumps([*known, here], indent=2) + "\n").encode())
