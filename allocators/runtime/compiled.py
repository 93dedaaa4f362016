"""Decorators for functions that numba compiles at the first call, or loads from its cache."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from inspect import signature
from typing import TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])
Type = object  # numba has no type stubs

CALL_TEMPLATE_PARAMETERS = ["args", "kws"]
"""Parameters that numba's `get_call_template` must have for `_compiled_once` to replace it."""

_FAST_MATH = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "arcp", "nsz", "afn"}}

_IN_PLACE = {"_nrt": False, "error_model": "numpy"}
"""`_nrt` is an undocumented option of numba: references are not counted, and no arrays can be allocated."""


def _cached(function: Function, **options: object) -> Function:
    njit = cast(Callable[..., Callable[[Function], Function]], numba.njit)
    try:
        return njit(cache=True, nogil=True, **options)(function)
    except RuntimeError:  # no writable folder for the cache
        return njit(nogil=True, **options)(function)


def _compiled_once(loop: Function) -> Function:
    """Let compiled callers share one specialisation of `loop`, whatever constants and integer types they pass.

    Numba specialises a function for each constant argument, including initial values of variables, and for 32-bit and
    64-bit integers, which took a tenth of the total compilation time. `get_call_template` is undocumented: if its
    parameters have changed, loops are specialised for each caller, with the same behaviour.
    """
    resolve = getattr(loop, "get_call_template", None)  # missing if numba's compiler is disabled
    if resolve is None or list(signature(resolve).parameters) != CALL_TEMPLATE_PARAMETERS:
        return loop

    def resolve_alike(args: Sequence[Type], kws: Mapping[str, Type]) -> object:
        return resolve(tuple(map(_whole_type, args)), {name: _whole_type(one) for name, one in kws.items()})

    with contextlib.suppress(AttributeError):
        loop.get_call_template = resolve_alike  # type: ignore[attr-defined]
    return loop


def _whole_type(argument: Type) -> Type:
    """Return the type of a constant in place of its literal type, and int64 in place of int32."""
    whole = cast(Callable[[Type], Type], numba.types.unliteral)(argument)
    return numba.types.int64 if whole == numba.types.int32 else whole


def compiled(function: Function) -> Function:
    """Compile `function` at its first call, to run without the global interpreter lock.

    The machine code is cached beside the source, or else in the user's cache folder; if neither is writable, every
    process compiles it again.
    """
    return _compiled_once(_cached(function))


def compiled_in_place(function: Function) -> Function:
    """Compile `function` as `compiled` does, without reference counting; it must not allocate arrays.

    Division by zero gives infinity or NaN, not an error. Without reference counting, missions, whose many small
    functions pass many arrays, take less than half of the time.
    """
    return _compiled_once(_cached(function, **_IN_PLACE))


def compiled_fast_math(function: Function) -> Function:
    """Compile `function` as `compiled` does, with fast math: reassociated sums, and unchecked division by zero.

    For neural networks. Infinities and NaN are still handled correctly.
    """
    return _cached(function, **_FAST_MATH)


def compiled_fast_math_in_place(function: Function) -> Function:
    """Compile `function` as both `compiled_fast_math` and `compiled_in_place` do."""
    return _cached(function, **(_IN_PLACE | _FAST_MATH))


def inlined(function: Function) -> Function:
    """Inline `function` into the compiled functions that call it; for functions cheaper than a call."""
    return cast(Function, numba.njit(inline="always", nogil=True)(function))
