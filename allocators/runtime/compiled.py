"""Decorators for functions that numba compiles to machine code, at their first call or from its cache."""

from collections.abc import Callable
from typing import Literal, TypedDict, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


class _FastMath(TypedDict):
    """Options of `numba.njit` for code that needs no particular order of floating-point operations."""

    nogil: bool
    error_model: Literal["numpy"]
    fastmath: set[str]


def compiled(function: Function) -> Function:
    """Compile `function` at its first call, to run without the interpreter's lock.

    The machine code is cached beside the source, else in the user's cache folder; where neither is writable, every
    process compiles anew.
    """
    try:
        return cast(Function, numba.njit(cache=True, nogil=True)(function))
    except RuntimeError:  # no folder for the cache
        return cast(Function, numba.njit(nogil=True)(function))


def compiled_loosely(function: Function) -> Function:
    """Compile `function` as `compiled` does, with fast math: sums in any order, and unchecked divisions by 0.

    For neural networks. Infinities and NaN keep their meaning.
    """
    options: _FastMath = {
        "nogil": True,
        "error_model": "numpy",
        "fastmath": {"contract", "reassoc", "arcp", "nsz", "afn"},
    }
    try:
        return cast(Function, numba.njit(cache=True, **options)(function))
    except RuntimeError:
        return cast(Function, numba.njit(**options)(function))


def inlined(function: Function) -> Function:
    """Inline `function` into each compiled function that calls it, where a call would cost more than its work."""
    return cast(Function, numba.njit(inline="always", nogil=True)(function))
