"""Descriptions of the parameters of a method: type, range, default and meaning."""

import inspect
import math
import re
import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from alloc.allocators.contract.base import Allocator

NAMES = {int: "whole number", float: "number", bool: "true or false", str: "text", Path: "file"}
"""Names of the types of values."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a method.

    Attributes
    ----------
    name : str
        As in ``--set NAME=VALUE``, and as keyword argument of the method's class.
    kind : str
        Type and range of its values, such as ``whole number >= 4, or none``.
    default : object
    meaning : str
        From the docstring.
    """

    name: str
    kind: str
    default: object
    meaning: str


def described(kind: type[Allocator]) -> tuple[Parameter, ...]:
    """Return descriptions of the parameters of a method, given its class.

    Parameters
    ----------
    kind : type
        A subclass of `Allocator`.

    Returns
    -------
    tuple of Parameter
        Options of the constructor first, then the fields of its `parameters_type`.
    """
    options = [_option(kind, name) for name in kind.method.options if name in _arguments(kind)]
    if kind.parameters_type is None:
        return tuple(options)
    hints, meanings = get_type_hints(kind.parameters_type), _meanings(kind.parameters_type)
    own = [
        Parameter(field.name, _kind(hints[field.name], field.metadata), field.default, meanings.get(field.name, ""))
        for field in fields(kind.parameters_type)
    ]
    return (*options, *own)


def _arguments(kind: type[Allocator]) -> Mapping[str, inspect.Parameter]:
    return inspect.signature(kind).parameters


def _option(kind: type[Allocator], name: str) -> Parameter:
    """Return the description of an option that is an argument of the constructor itself."""
    hint = get_type_hints(kind.__init__)[name]
    return Parameter(name, _kind(hint, {}), _arguments(kind)[name].default, _meanings(kind).get(name, ""))


def _kind(hint: Any, limits: Mapping[str, Any]) -> str:
    """Return the type and range of the values in words."""
    kinds = get_args(hint) if get_origin(hint) is types.UnionType else (hint,)
    none = " or none" if types.NoneType in kinds else ""
    first = next(kind for kind in kinds if kind is not types.NoneType)
    several = get_origin(first) is tuple
    name = NAMES.get(get_args(first)[0] if several else first, "value")
    words = f"{name}s with commas" if several else name
    return f"{words}{_range(limits)}{none}"


def _range(limits: Mapping[str, Any]) -> str:
    low, high = limits.get("low", -math.inf), limits.get("high", math.inf)
    least = "" if low == -math.inf else f" {'>' if limits['above'] else '>='} {low:g}"
    most = "" if high == math.inf else f"{',' if least else ''} <= {high:g}"
    return f"{least}{most}{', inf' if limits.get('infinite') else ''}"


def _meanings(kind: type) -> dict[str, str]:
    """Return the explanation of each name in the sections Parameters and Attributes of a class and its bases."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        found.update(_entries(inspect.cleandoc(vars(base).get("__doc__") or "")))
    return found


def _entries(docstring: str) -> Iterator[tuple[str, str]]:
    """Yield each name in the numpydoc sections Parameters and Attributes, with its explanation."""
    for section in re.split(r"\n\n(?=\w[\w ]*\n---)", docstring):
        title, _, body = section.partition("\n")
        if title not in ("Parameters", "Attributes"):
            continue
        for part in re.split(r"\n(?=\S)", body.partition("\n")[2]):
            names, _, text = part.partition("\n")
            for name in names.partition(" : ")[0].split(","):
                yield name.strip(), " ".join(text.split())
