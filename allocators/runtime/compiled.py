"""Loops that numba compiles to machine code: at their first call, or read from its cache where that may be written."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile `function` at its first call, to run without the interpreter's lock.

    The machine code is kept beside the source, else in the user's cache folder; where neither can be written, every
    process compiles anew.
    """
    try:
        return cast(Function, numba.njit(cache=True, nogil=True)(function))
    except RuntimeError:  # no folder for the cache
        return cast(Function, numba.njit(nogil=True)(function))


def compiled_loosely(function: Function) -> Function:
    """Compile `function` as `compiled` does, with sums in any order and divisions by 0 unchecked: for networks.

    Infinities keep their meaning.
    """
    options: dict[str, Any] = {
        "nogil": True,
        "error_model": "numpy",
        "fastmath": {"contract", "reassoc", "arcp", "nsz", "afn"},
    }
    try:
        return cast(Function, numba.njit(cache=True, **options)(function))
    except RuntimeError:
        return cast(Function, numba.njit(**options)(function))


def inlined(function: Function) -> Function:
    """Put `function` into each compiled loop that calls it, where a call would cost more than its work."""
    return cast(Function, numba.njit(inline="always", nogil=True)(function))
