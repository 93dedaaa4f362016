"""Functions that the tests of the engines run in other processes, which find them by their name.

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
    """Take longer for the first items, so that they are not the first to end."""
    time.sleep(0.02 if item < 2 else 0)
    return item * item


def step(state: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Multiply a seeded random matrix often enough for the last bits to show how it was computed."""
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
    """Kill the process where the marker is missing; else return the number squared and the process."""
    number, marker = item
    if number % 2 and not Path(marker).exists():
        Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number, os.getpid()


def die(item: str) -> None:
    """Leave a line for every try, and die."""
    with Path(item).open("a") as file:
        file.write("tried\n")
    os.kill(os.getpid(), signal.SIGKILL)


def sleep_long(item: str) -> None:
    """Leave the process id in a file, whole from the beginning, and sleep."""
    path = Path(item)
    path.with_suffix(".part").write_text(str(os.getpid()))
    path.with_suffix(".part").rename(path)
    time.sleep(60)


def pid(item: int) -> int:
    time.sleep(0.05)
    return os.getpid()


def square_where_it_is_safe(item: tuple[int, str]) -> int:
    """Leave a file for every try, with the machine in it, and end only where the machine is not the doomed one."""
    import ray

    number, folder = item
    machine, doomed = ray.get_runtime_context().get_node_id(), Path(folder) / "doomed"
    path = Path(folder) / f"{number}-{os.getpid()}"
    path.write_text(machine)
    path.rename(path.with_suffix(".try"))
    while not doomed.exists() or doomed.read_text() in ("", machine):
        time.sleep(0.05)
    return number * number
