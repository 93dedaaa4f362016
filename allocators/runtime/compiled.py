"""Decorators for functions that numba compiles to machine code, at their first call or from its cache."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from inspect import signature
from typing import TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])
Type = object  # those of numba have no stubs

RESOLVED = ["args", "kws"]
"""Parameters of what numba asks a function for, when another one that is compiled calls it."""

_LOOSELY = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "arcp", "nsz", "afn"}}

_IN_PLACE = {"_nrt": False}
"""Not among the options that numba documents: no references are counted, and no arrays can be made."""


def _cached(function: Function, **options: object) -> Function:
    njit = cast(Callable[..., Callable[[Function], Function]], numba.njit)
    try:
        return njit(cache=True, nogil=True, **options)(function)
    except RuntimeError:  # no folder for the cache
        return njit(nogil=True, **options)(function)


def _compiled_once(loop: Function) -> Function:
    """Let compiled callers share one compilation of `loop`, whatever constants and integers they call it with.

    Numba compiles a function anew for each constant that is an argument, also for the value that a variable has at
    first, and for integers of 32 and of 64 bits: a tenth of the time that all loops took. `get_call_template` is not
    among what numba documents: where it is not as it was, loops are compiled for each caller, and do the same.
    """
    resolve = getattr(loop, "get_call_template", None)  # not where numba is told to compile nothing
    if resolve is None or list(signature(resolve).parameters) != RESOLVED:
        return loop

    def resolve_alike(args: Sequence[Type], kws: Mapping[str, Type]) -> object:
        return resolve(tuple(map(_whole_type, args)), {name: _whole_type(one) for name, one in kws.items()})

    with contextlib.suppress(AttributeError):
        loop.get_call_template = resolve_alike  # type: ignore[attr-defined]
    return loop


def _whole_type(argument: Type) -> Type:
    """Return the type of a constant, and 64 bits for integers of 32."""
    whole = cast(Callable[[Type], Type], numba.types.unliteral)(argument)
    return numba.types.int64 if whole == numba.types.int32 else whole


def compiled(function: Function) -> Function:
    """Compile `function` at its first call, to run without the interpreter's lock.

    The machine code is cached beside the source, else in the user's cache folder; where neither is writable, every
    process compiles anew.
    """
    return _compiled_once(_cached(function))


def compiled_in_place(function: Function) -> Function:
    """Compile `function` as `compiled` does, where it makes no arrays, but works on those that it is given.

    Who uses an array is then not counted. That matters where many small functions pass on many arrays: in missions,
    counting took more than half of the time.
    """
    return _compiled_once(_cached(function, **_IN_PLACE))


def compiled_loosely(function: Function) -> Function:
    """Compile `function` as `compiled` does, with fast math: sums in any order, and unchecked divisions by 0.

    For neural networks. Infinities and NaN keep their meaning.
    """
    return _cached(function, **_LOOSELY)


def compiled_loosely_in_place(function: Function) -> Function:
    """Compile `function` as both `compiled_loosely` and `compiled_in_place` do."""
    return _cached(function, **_IN_PLACE, **_LOOSELY)


def inlined(function: Function) -> Function:
    """Inline `function` into each compiled function that calls it, where a call would cost more than its work."""
    return cast(Function, numba.njit(inline="always", nogil=True)(function))
