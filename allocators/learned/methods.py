"""The learning methods by name."""

from dataclasses import fields
from importlib import import_module
from typing import Any

from alloc.allocators.learned.learner import Learner
from alloc.allocators.learned.network import NetworkSize
from alloc.problems import InputError
from alloc.problems.errors import nearest

METHODS = {
    "gappo": ("gappo", "Ppo", "GappoParameters"),
    "ppo": ("ppo", "Ppo", "PpoParameters"),
    "a2c": ("a2c", "A2c", "A2cParameters"),
    "dqn": ("dqn", "Dqn", "DqnParameters"),
    "ddpg": ("ddpg", "Ddpg", "DdpgParameters"),
}
"""Module, learner and parameters of each; `gappo` breeds a population of learners by `ppo`."""


def _part(method: str, number: int) -> Any:
    if method not in METHODS:
        raise InputError(f"{method!r} learns nothing{nearest(method, tuple(METHODS))}", "METHOD")
    names = METHODS[method]
    return getattr(import_module(f"alloc.allocators.learned.{names[0]}"), names[number])


def new_learner(method: str, size: NetworkSize, parameters: Any, seed: int) -> Learner:
    """Return a learner that knows nothing yet.

    Raises
    ------
    InputError
        If there is no such method.
    """
    learner: Learner = _part(method, 1)(size, parameters, seed)
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
        If there is no such method or field, or a text does not read as the field's type.
    """
    kind = _part(method, 2)
    given = settings or {}
    known = {field.name: field for field in fields(kind)}
    default = kind()
    values = {}
    for name, text in given.items():
        if name not in known:
            raise InputError(f"{method} has no parameter {name!r}{nearest(name, tuple(known))}", "--set")
        values[name] = _read(name, text, getattr(default, name))
    return kind(**values)


def _read(name: str, text: str, default: Any) -> Any:
    """Read a text as the kind of value that the default is."""
    try:
        if isinstance(default, bool):
            return {"true": True, "false": False}[text.lower()]
        if text.lower() == "none":
            return None
        return int(text) if isinstance(default, int) else type(default)(text) if default is not None else float(text)
    except (KeyError, ValueError):
        raise InputError(f"{name} must be like {default!r}, got {text!r}", "--set") from None
