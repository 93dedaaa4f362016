"""The learning methods by name; torch is not imported until a learner is created."""

from collections.abc import Mapping
from dataclasses import fields
from importlib import import_module
from typing import TYPE_CHECKING

from alloc.allocators.learned.algorithms.hyperparameter_ranges import RANGES
from alloc.allocators.learned.algorithms.hyperparameters import (
    A2cParameters,
    DdpgParameters,
    DqnParameters,
    GappoParameters,
    Hyperparameters,
    PpoParameters,
)
from alloc.problems import InputError
from alloc.problems.errors import nearest

if TYPE_CHECKING:
    from alloc.allocators.learned.algorithms.learner import Learner
    from alloc.allocators.learned.network.actor_critic import NetworkSize

METHODS: dict[str, tuple[str, str, type[Hyperparameters]]] = {
    "gappo": ("genes", "GeneticPpo", GappoParameters),
    "ppo": ("ppo", "Ppo", PpoParameters),
    "a2c": ("a2c", "A2c", A2cParameters),
    "dqn": ("dqn", "Dqn", DqnParameters),
    "ddpg": ("ddpg", "Ddpg", DdpgParameters),
}
"""Module, learner and hyperparameters of each method; `gappo` breeds a population of `ppo` learners."""


def _entry(method: str) -> tuple[str, str, type[Hyperparameters]]:
    if method not in METHODS:
        raise InputError(f"{method!r} learns nothing{nearest(method, tuple(METHODS))}", "method")
    return METHODS[method]


def new_learner(method: str, size: "NetworkSize", parameters: Hyperparameters | None, seed: int) -> "Learner":
    """Return an untrained learner, with default hyperparameters if `parameters` is None.

    Raises
    ------
    InputError
        If there is no such method.
    """
    module, name, _ = _entry(method)
    learner: Learner = getattr(import_module(f"alloc.allocators.learned.algorithms.{module}"), name)(
        size, parameters, seed
    )
    return learner


def method_parameters(method: str, settings: Mapping[str, object] | None = None) -> Hyperparameters:
    """Return the hyperparameters of a method: the defaults with changes by `settings`.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    settings : mapping of str to object
        Values by field; text is parsed as on the command line.

    Raises
    ------
    InputError
        If there is no such method or field, a text does not parse as the field's type, or a value is out of range.
    """
    kind = _entry(method)[2]
    default = kind()
    known = [field.name for field in fields(kind)]
    values: dict[str, object] = {}
    for name, value in (settings or {}).items():
        if name not in known:
            defaults = ", ".join(f"{one}={_text(getattr(default, one))}" for one in known)
            raise InputError(f"{method} has no parameter {name!r}; its parameters and defaults: {defaults}", "settings")
        values[name] = _parse(name, value, getattr(default, name)) if isinstance(value, str) else value
    try:
        return kind(**values)  # type: ignore[arg-type]
    except InputError as error:
        raise InputError(f"{error.place} {error.message}", "settings") from error


def _text(value: object) -> str:
    """Return a value in the syntax that `_parse` reads."""
    return str(value).lower()


def _parse(name: str, text: str, default: object) -> object:
    """Convert text to a value of the default's type."""
    try:
        if isinstance(default, bool):
            return {"true": True, "false": False}[text.lower()]
        if text.lower() == "none" and None in RANGES[name]:
            return None
        return int(text) if isinstance(default, int) else float(text)
    except (KeyError, ValueError) as error:
        raise InputError(f"{name} must be like {_text(default)}, got {text!r}", "settings") from error
