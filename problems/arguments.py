"""Validation of arguments at the public interface, so that errors name the parameter and nothing fails deep inside.

Equivalent types are accepted and converted: numpy scalars, and strings for members of enumerations.
"""

import math
from collections.abc import Iterable, Mapping, Set
from enum import StrEnum
from numbers import Integral, Real
from typing import TypeVar

import numpy as np

from alloc.problems.errors import InputError

LARGEST_SEED = 2**63 - 1

Kind = TypeVar("Kind")
Choice = TypeVar("Choice", bound=StrEnum)


def whole(value: object, name: str, low: int | None = 0, high: int | None = None) -> int:
    """Return `value` as an int if it is a whole number from `low` to `high`; None means no limit."""
    if isinstance(value, Integral) and not isinstance(value, bool):
        number = int(value)
        if (low is None or low <= number) and (high is None or number <= high):
            return number
    least, most = "" if low is None else f" >= {low}", "" if high is None else f" and at most {high}"
    ends = f" from {low} to {high}" if low is not None and high is not None else least + most
    raise InputError(f"must be a whole number{ends}, got {shown(value)}", name)


def checked_seed(value: object, name: str = "seed") -> int:
    """Return a seed of random numbers as an int if it is a whole number from 0 to 2^63 - 1."""
    return whole(value, name, 0, LARGEST_SEED)


def real(value: object, name: str, low: float = 0.0, high: float = math.inf, *, above: bool = False) -> float:
    """Return `value` as a Python number if it is finite and from `low` to `high`; `above` excludes `low` itself."""
    if isinstance(value, Real) and not isinstance(value, bool | np.bool_):
        plain: Real = value.item() if isinstance(value, np.generic) else value
        number = plain if isinstance(plain, int | float) else float(plain)
        if (low < number if above else low <= number) and number <= high and -math.inf < number < math.inf:
            return number
    least = "" if low == -math.inf else f" {'>' if above else '>='} {low:g}"
    ends = least + (f"{' and' if least else ''} at most {high:g}" if high < math.inf else "")
    raise InputError(f"must be a finite number{ends}, got {shown(value)}", name)


def flag(value: object, name: str) -> bool:
    """Return `value` as a bool if it is a Python or numpy boolean."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise InputError(f"must be True or False, got {shown(value)}", name)


def text(value: object, name: str) -> str:
    """Return `value` as a plain str if it is a string."""
    if isinstance(value, str):
        return str(value)
    raise InputError(f"must be a string, got {shown(value)}", name)


def choice(kind: type[Choice], value: object, name: str) -> Choice:
    """Return the member of the enumeration `kind` that `value` is or names."""
    try:
        return kind(value)  # type: ignore[arg-type]
    except ValueError as error:
        raise InputError(f"must be one of {', '.join(kind)}; got {shown(value)}", name) from error


def of_type(value: object, kind: type[Kind] | tuple[type[Kind], ...], name: str) -> Kind:
    """Return `value` if it is an instance of `kind`, or of one of several types."""
    if isinstance(value, kind):
        return value
    kinds = kind if isinstance(kind, tuple) else (kind,)
    expected = " or ".join(("an " if one.__name__[0] in "AEIO" else "a ") + one.__name__ for one in kinds)
    raise InputError(f"must be {expected}, got {shown(value)}", name)


def function(value: Kind, name: str) -> Kind:
    """Return `value` if it is callable or None."""
    if value is None or callable(value):
        return value
    raise InputError(f"must be a function, got {shown(value)}", name)


def event(value: Kind, name: str) -> Kind:
    """Return `value` if it is None or has the methods `set` and `is_set` of a `threading.Event`."""
    if value is None or all(callable(getattr(value, method, None)) for method in ("is_set", "set")):
        return value
    raise InputError(f"must be a threading.Event, got {shown(value)}", name)


def listed(values: Iterable[Kind], name: str, what: str) -> list[Kind]:
    """Return the entries of a list, an array or a generator; `what` describes them in error messages.

    Strings, bytes, mappings and sets are rejected: a string counts as one value, and a set has no order.
    """
    if not isinstance(values, str | bytes | Mapping | Set):
        try:
            return list(values)
        except TypeError as error:
            raise InputError(f"must be a list of {what}, got {shown(values)}", name) from error
    raise InputError(f"must be a list of {what}, got {shown(values)}", name)


def shown(value: object) -> str:
    """Return the text for a value in an error message: a scalar, cut to 60 characters, or else its type."""
    if value is None or isinstance(value, str | int | float | np.number | np.bool_):
        words = str(value) if isinstance(value, np.generic) and not isinstance(value, str) else repr(value)
        return words if len(words) <= 60 else f"{words[:57]}..."
    return f"a {type(value).__name__}"
