"""The learning methods by name; knows nothing of torch until one of them is built."""

from dataclasses import fields
from importlib import import_module
from typing import TYPE_CHECKING, Any

from alloc.allocators.learned.algorithms import hyperparameters
from alloc.allocators.learned.algorithms.hyperparameter_ranges import RANGES
from alloc.problems import InputError
from alloc.problems.errors import nearest

if TYPE_CHECKING:
    from alloc.allocators.learned.algorithms.learner import Learner
    from alloc.allocators.learned.network.actor_critic import NetworkSize

METHODS = {
    "gappo": ("ppo", "Ppo", "GappoParameters"),
    "ppo": ("ppo", "Ppo", "PpoParameters"),
    "a2c": ("a2c", "A2c", "A2cParameters"),
    "dqn": ("dqn", "Dqn", "DqnParameters"),
    "ddpg": ("ddpg", "Ddpg", "DdpgParameters"),
}
"""Module, learner and parameters of each; `gappo` breeds a population of learners by `ppo`."""


def _names(method: str) -> tuple[str, str, str]:
    if method not in METHODS:
        raise InputError(f"{method!r} learns nothing{nearest(method, tuple(METHODS))}", "method")
    return METHODS[method]


def new_learner(method: str, size: "NetworkSize", parameters: Any, seed: int) -> "Learner":
    """Return a learner that knows nothing yet.

    Raises
    ------
    InputError
        If there is no such method.
    """
    module, name, _ = _names(method)
    learner: Learner = getattr(import_module(f"alloc.allocators.learned.algorithms.{module}"), name)(
        size, parameters, seed
    )
    return learner


def method_parameters(method: str, settings: dict[str, str] | None = None) -> Any:
    """Return the hyperparameters of a method, with some of them set by the user.

    Parameters
    ----------
    settings : dict of str to str
        Texts as on the command line, by field.

    Raises
    ------
    InputError
        If there is no such method or field, a text does not read as the field's type, or a value is out of its range.
    """
    kind = getattr(hyperparameters, _names(method)[2])
    default = kind()
    known = [field.name for field in fields(kind)]
    values = {}
    for name, text in (settings or {}).items():
        if name not in known:
            defaults = ", ".join(f"{one}={_text(getattr(default, one))}" for one in known)
            raise InputError(f"{method} has no parameter {name!r}; its parameters and defaults: {defaults}", "settings")
        values[name] = _read(name, text, getattr(default, name))
    try:
        return kind(**values)
    except InputError as error:
        raise InputError(f"{error.place} {error.message}", "settings") from error


def _text(value: Any) -> str:
    """Return a value as `_read` takes it."""
    return str(value).lower()


def _read(name: str, text: str, default: Any) -> Any:
    """Read a text as the kind of value that the default is."""
    try:
        if isinstance(default, bool):
            return {"true": True, "false": False}[text.lower()]
        if text.lower() == "none" and None in RANGES[name]:
            return None
        return int(text) if isinstance(default, int) else float(text)
    except (KeyError, ValueError) as error:
        raise InputError(f"{name} must be like {_text(default)}, got {text!r}", "settings") from error
