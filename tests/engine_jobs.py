"""Functions that tests of engines run in other processes, which import them by name.

Torch, which takes a process a second to load, is left to those that need it.
"""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import torch


def square(item: int) -> int:
    """Return the square, taking longer for the first items, so that these do not end first."""
    time.sleep(0.02 if item < 2 else 0)
    return item * item


def step(state: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Multiply a seeded random matrix repeatedly, so that the last bits depend on the computation."""
    import torch

    from alloc.allocators.runtime.torch_state import torch_threads

    generator = torch.Generator().manual_seed(int(state["seed"]))
    with torch_threads(1):
        weight = state["weight"] + torch.rand(state["weight"].shape, generator=generator)
        for _ in range(5):
            weight = torch.softmax(weight @ weight.T, 0) @ weight
    return {"seed": state["seed"] + 1, "weight": weight}


def fail(item: int) -> int:
    raise KeyError(f"item {item}")


class UnpicklableError(Exception):
    def __init__(self, first: int, second: int) -> None:
        super().__init__("of two parts")


def fail_oddly(item: int) -> int:
    raise UnpicklableError(1, 2)


def die_first(item: tuple[int, str]) -> tuple[int, int]:
    """Kill the process if the marker is missing; otherwise return the square and the process id."""
    number, marker = item
    if number % 2 and not Path(marker).exists():
        Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number, os.getpid()


def die(item: str) -> None:
    """Record every attempt, and kill the process."""
    with Path(item).open("a") as file:
        file.write("tried\n")
    os.kill(os.getpid(), signal.SIGKILL)


def sleep_long(item: str) -> None:
    """Write the process id to a file atomically, and sleep."""
    path = Path(item)
    path.with_suffix(".part").write_text(str(os.getpid()))
    path.with_suffix(".part").rename(path)
    time.sleep(60)


def pid(item: int) -> int:
    time.sleep(0.05)
    return os.getpid()


def square_where_it_is_safe(item: tuple[int, str]) -> int:
    """Record the machine of every attempt, and return only on a machine that is not to be killed."""
    import ray

    number, folder = item
    machine, doomed = ray.get_runtime_context().get_node_id(), Path(folder) / "doomed"
    path = Path(folder) / f"{number}-{os.getpid()}"
    path.write_text(machine)
    path.rename(path.with_suffix(".try"))
    while not doomed.exists() or doomed.read_text() in ("", machine):
        time.sleep(0.05)
    return number * number
