"""State that an allocator must not change: the instance, and the global state of the process."""

import os
import pickle
import random
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import fields

import numpy as np

from alloc.problems import Instance


def instance_state(instance: Instance) -> dict[str, object]:
    """Return every field of `instance`, and its reach, as values that can be compared."""
    state = {field.name: pickle.dumps(getattr(instance, field.name)) for field in fields(instance)}
    for name in ("origin", "distance", "mask"):
        state[f"reach.{name}"] = getattr(instance.reach, name).tobytes()
    return dict(state)


def process_state() -> dict[str, object]:
    """Return global random generators and settings that a method might change, as values that can be compared."""
    state: dict[str, object] = {
        "random": random.getstate(),
        "numpy.random": pickle.dumps(np.random.get_state()),  # noqa: NPY002 (the global state itself is compared)
        "numpy.errstate": tuple(np.geterr().items()),
        "environment": dict(os.environ),
        "working directory": os.getcwd(),
        "signal handlers": (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)),
        "recursion limit": sys.getrecursionlimit(),
    }
    torch = sys.modules.get("torch")
    if torch is not None:
        state["torch.random"] = torch.get_rng_state().numpy().tobytes()
        state["torch.dtype"] = torch.get_default_dtype()
        state["torch.grad"] = torch.is_grad_enabled()
        state["torch.inference"] = torch.is_inference_mode_enabled()
        state["torch.device"] = str(torch.get_default_device())
        state["torch.threads"] = torch.get_num_threads()
        state["torch.threads elsewhere"] = _in_a_new_thread(torch.get_num_threads)
        state["torch.deterministic"] = torch.are_deterministic_algorithms_enabled()
    return state


def _in_a_new_thread(value: Callable[[], object]) -> object:
    """Call `value` in a new thread, which starts with the defaults of the process."""
    answers: list[object] = []
    thread = threading.Thread(target=lambda: answers.append(value()))
    thread.start()
    thread.join()
    return answers[0]


def changed(before: dict[str, object], after: dict[str, object]) -> list[str]:
    """Return the names whose values differ."""
    return [name for name in before if before[name] != after.get(name)]
