"""Engines by name, for options of commands and parameters of functions."""

from importlib.util import find_spec

from alloc.allocators.parallel.engine import Engine
from alloc.allocators.parallel.processes import ProcessEngine
from alloc.allocators.parallel.ray import RAY_MISSING, RayEngine
from alloc.allocators.parallel.serial import SerialEngine
from alloc.problems import InputError, MissingPackageError
from alloc.problems.errors import nearest

ENGINES = ("serial", "processes", "ray")


def check_engine(name: str, workers: int | None = None, address: str | None = None) -> None:
    """Raise the errors of `make_engine` that can be found without a connection."""
    if name not in ENGINES:
        raise InputError(f"no such engine: {name!r}{nearest(name, ENGINES)}", "engine")
    if workers is not None and name != "processes":
        raise InputError("belongs to the engine processes", "workers")
    if address is not None and name != "ray":
        raise InputError("belongs to the engine ray", "address")
    if name == "ray" and find_spec("ray") is None:
        raise MissingPackageError(RAY_MISSING, "engine")


def make_engine(
    name: str = "serial", workers: int | None = None, address: str | None = None, threads: int = 1
) -> Engine:
    """Return a new engine.

    Parameters
    ----------
    name : str
        One of `ENGINES`.
    workers : int, optional
        Number of processes, for ``processes`` only; by default the number of available processors.
    address : str, optional
        Head of the cluster, for ``ray`` only; see `RayEngine`.
    threads : int
        Threads that each item may use.

    Raises
    ------
    InputError
        If there is no such engine, an option does not belong to it, Ray is not installed, or there is no cluster at
        `address`.
    """
    check_engine(name, workers, address)
    if name == "ray":
        return RayEngine(address, threads)
    if name == "processes":
        return ProcessEngine(workers, threads)
    return SerialEngine(threads)
