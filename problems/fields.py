"""Conversion and validation of the fields of an instance as arrays."""

from collections.abc import Iterable, Set
from decimal import Decimal
from itertools import pairwise
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from alloc.problems.arguments import listed, shown
from alloc.problems.errors import InputError
from alloc.problems.vocabulary import IDLE, METRICS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]

LARGEST_INDEX = 2**62
"""Largest number that is accepted as an index."""

MATRIX = "a matrix of who may do what, not lists of task indices; give those, as numpy.flatnonzero(row) does"


class ReadOnly:
    """Mixin that keeps arrays read-only through pickling and deep copies, which lose the flag."""

    def __setstate__(self, state: dict[str, object]) -> None:
        for value in state.values():
            for array in value if isinstance(value, tuple) else (value,):
                if isinstance(array, np.ndarray):
                    array.setflags(write=False)
        self.__dict__.update(state)


def numbers(values: ArrayLike, field_name: str, message: str = "must be a list of numbers") -> FloatArray:
    """Return a copy as an array of floats; None and missing values of pandas become NaN, strings are rejected."""
    try:
        array = np.asarray(values)
        if array.dtype.kind == "O":
            array = np.array([_number(value) for value in array.flat], dtype=np.float64).reshape(array.shape)
        if array.dtype.kind in "fiu":
            return np.array(array, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(message, field_name) from error
    raise InputError(message, field_name)


def _number(value: object) -> float:
    if value is None or type(value).__name__ == "NAType":  # pandas.NA, without importing pandas
        return float("nan")
    if isinstance(value, Real | Decimal) and not isinstance(value, bool):
        return float(value)
    raise TypeError(f"{value!r} is not a number")


LEAST, MOST = 1e-60, 1e60
"""Range of magnitudes within which products and quotients of a few numbers neither underflow nor overflow."""


def vector(values: ArrayLike, field_name: str, length: int | None = None) -> FloatArray:
    """Return a copy as a one-dimensional array of floats."""
    array = numbers(values, field_name)
    if array.ndim != 1 or (length is not None and len(array) != length):
        expected = "a list" if length is None else f"a list of {length} numbers"
        raise InputError(f"must be {expected}, got shape {array.shape}", field_name)
    return array


def limits(values: ArrayLike | None, field_name: str, length: int) -> FloatArray:
    """Return the limit of each agent; None and NaN become ``inf``, no limit."""
    if values is None:
        return np.full(length, np.inf)
    array = vector(values, field_name, length)
    array[np.isnan(array)] = np.inf
    return array


def rates(values: ArrayLike | None, usual: float, length: int) -> FloatArray:
    """Return the rate of each agent; None and NaN become `usual`."""
    if values is None:
        return np.full(length, float(usual))
    array = vector(values, "agent_energy_per_distance", length)
    array[np.isnan(array)] = usual
    return array


def flags(values: ArrayLike | None, field_name: str, length: int) -> BoolArray:
    """Return a boolean for each agent; None becomes False."""
    if values is None:
        return np.zeros(length, dtype=np.bool_)
    given = [False if value is None else value for value in np.asarray(values, dtype=object).ravel().tolist()]
    if len(given) != length or not all(isinstance(value, bool | np.bool_) for value in given):
        raise InputError(f"must be a list of {length} booleans", field_name)
    return np.array(given, dtype=np.bool_)


def require_geographic(position: FloatArray, kind: str) -> None:
    """Raise `InputError` for the first position that is not a longitude and a latitude in degrees."""
    lon, lat = position[:, 0], position[:, 1]
    wrong = (np.abs(lat) > 90) | (lon < -180) | (lon > 360)
    if wrong.any():
        row = int(np.argmax(wrong))
        message = f"must be longitude (-180 to 360) and latitude (-90 to 90) in degrees, got {position[row].tolist()}"
        raise InputError(message, f"{kind}s[{row}].position")


def ids(names: Iterable[str] | None, count: int, prefix: str, kind: str) -> tuple[str, ...]:
    """Return unique ids; by default `prefix` and a number."""
    if names is None:
        return tuple(f"{prefix}{index}" for index in range(1, count + 1))
    unique = tuple(listed(names, f"{kind}_ids", "strings"))
    if len(unique) != count:
        raise InputError(f"needs {count} ids, got {len(unique)}", f"{kind}_ids")
    seen: set[str] = set()
    for index, name in enumerate(unique):
        if not isinstance(name, str) or not name:
            raise InputError(f"must be a non-empty string, got {name!r}", f"{kind}s[{index}].id")
        if name in seen:
            raise InputError(f"the id {name!r} is used twice; ids must be unique", f"{kind}s[{index}].id")
        seen.add(name)
    return unique


def positions(values: ArrayLike | None, count: int, kind: str) -> FloatArray:
    """Return three coordinates per row: z = 0 if only x and y are given, NaN for unknown positions."""
    if values is None:
        return np.full((count, 3), np.nan)
    array = numbers(values, f"{kind}_position", "must hold 2 or 3 numbers per row")
    if array.ndim != 2 or array.shape[0] != count or array.shape[1] not in (2, 3):
        raise InputError(f"must have shape ({count}, 2) or ({count}, 3), got {array.shape}", f"{kind}_position")
    if array.shape[1] == 2:
        array = np.column_stack([array, np.where(np.isnan(array[:, 0]), np.nan, 0.0)])
    blank = np.isnan(array).all(axis=1)
    for wrong, rule in (
        (~blank & ~np.isfinite(array).all(axis=1), "finite numbers"),
        (~blank & (np.abs(array) > MOST).any(axis=1), f"numbers from {-MOST:g} to {MOST:g}; use larger units"),
    ):
        if wrong.any():
            row = int(np.argmax(wrong))
            raise InputError(f"must be {rule}, got {array[row].tolist()}", f"{kind}s[{row}].position")
    return array


def indices(values: ArrayLike, field_name: str, message: str = "must be a list of task indices") -> IntArray:
    """Return a copy as an array of indices; floats are accepted if they are whole, without truncation or wrapping."""
    try:
        array = np.asarray(values)
    except ValueError as error:  # rows of unequal length
        raise InputError(message, field_name) from error
    if array.dtype.kind not in "iu":
        array = numbers(array, field_name, message)
        if not (np.isfinite(array) & (array == np.round(array))).all():
            raise InputError(message, field_name)
    if array.size and (array.min() < -LARGEST_INDEX or array.max() > LARGEST_INDEX):
        raise InputError(f"{message}, got {array.flat[np.argmax(np.abs(array.astype(np.float64)))]}", field_name)
    return array.astype(np.intp)


def references(values: ArrayLike | None, field_name: str, n: int, kind: str, count: int) -> IntArray:
    """Return the index of a task or a base for each agent; None and NaN become -1, none."""
    if values is None:
        return np.full(n, IDLE, dtype=np.intp)
    message = f"must be a list of {n} {kind} indices, -1 for none"
    given = np.asarray(values)
    if given.dtype.kind not in "iu":  # a column of integers with missing values is one of floats or objects
        given = numbers(given, field_name, message)
        given[np.isnan(given)] = IDLE
    array = indices(given, field_name, message)
    if array.shape != (n,):
        raise InputError(message, field_name)
    wrong = (array < IDLE) | (array >= count)
    if wrong.any():
        row = int(np.argmax(wrong))
        known = f"{kind}s run from 0 to {count - 1}" if count else f"there are no {kind}s"
        raise InputError(f"is {array[row]}, but {known}", f"agents[{row}].{field_name}")
    return array


def allowed(lists: Iterable[Iterable[int] | None] | None, n: int, m: int) -> tuple[IntArray | None, ...] | None:
    """Return the sorted unique tasks that each agent may do; None if all agents may do all tasks."""
    if lists is None:
        return None
    if isinstance(lists, np.ndarray) and lists.dtype.kind == "b":
        raise InputError(f"is {MATRIX}", "allowed_tasks")
    entries = [_unless_missing(entry) for entry in listed(lists, "allowed_tasks", "lists of task indices, or None")]
    if len(entries) != n:
        raise InputError(f"needs {n} entries, got {len(entries)}", "allowed_tasks")
    if all(entry is None for entry in entries):
        return None
    rows = [row for row, entry in enumerate(entries) if entry is not None]
    arrays = [_indices(entry, row) for row, entry in enumerate(entries) if entry is not None]
    if _is_matrix(arrays, n, m, always=isinstance(lists, np.ndarray)):
        raise InputError(f"is {MATRIX}", "allowed_tasks")
    owner, task = np.repeat(rows, list(map(len, arrays))), np.concatenate(arrays)
    wrong = (task < 0) | (task >= m)
    if wrong.any():
        raise InputError(f"names a task outside 0 to {m - 1}", f"agents[{owner[np.argmax(wrong)]}].tasks")
    pairs = np.sort(owner * m + task)  # one sort for all agents is far faster than one per agent
    owner, task = np.divmod(pairs[np.diff(pairs, prepend=-1) > 0], m)
    task.setflags(write=False)
    result: list[IntArray | None] = [None] * n
    bounds = np.searchsorted(owner, [*rows, n]).tolist()
    for row, (first, end) in zip(rows, pairwise(bounds), strict=True):
        result[row] = task[first:end]
    return tuple(result)


def _unless_missing(entry: Iterable[int] | None) -> Iterable[int] | None:
    """Return `entry`, or None if it is the NaN that pandas uses for a missing list."""
    return None if isinstance(entry, float) and np.isnan(entry) else entry


def _is_matrix(arrays: list[IntArray], n: int, m: int, *, always: bool) -> bool:
    """Return whether the rows look like a 0/1 matrix: as indices, a row would repeat a task, or all would name all.

    `always`: whether rows that name all tasks count as a matrix as well.
    """
    if m < 2 or len(arrays) != n or any(len(array) != m or array.max() > 1 or array.min() < 0 for array in arrays):
        return False
    return always or m > 2 or any(array[0] == array[1] for array in arrays)


def _indices(entry: Iterable[int], row: int) -> IntArray:
    """Return the task indices of one agent; unlike elsewhere, a set is accepted, as order does not matter."""
    place, message = f"agents[{row}].tasks", "must be a list of task indices, or None for all"
    if not isinstance(entry, np.ndarray | list | tuple):
        entry = listed(list(entry) if isinstance(entry, Set) else entry, place, "task indices, or None for all")
    array = np.asarray(entry)
    if array.dtype.kind == "b":
        raise InputError(f"is {MATRIX}", place)
    if array.ndim != 1 or (len(array) and array.dtype.kind not in "iu"):
        raise InputError(message, place)
    return indices(array, place, message)


def metric(name: object) -> str:
    """Return `name` if it is the name of a metric."""
    if name in METRICS:
        return str(name)
    raise InputError(f"must be one of {', '.join(METRICS)}, got {shown(name)}", "metric")


def unit_share(tau: float) -> float:
    """Return `tau` if it is a number strictly between 0 and 1."""
    if isinstance(tau, Real) and not isinstance(tau, bool) and 0 < tau < 1:
        return float(tau)
    raise InputError(f"must lie strictly between 0 and 1, got {shown(tau)}", "tau")


def require(
    good: NDArray[np.bool_], values: FloatArray, field_name: str, rule: str, owner: tuple[str, tuple[str, ...]]
) -> None:
    """Raise `InputError` for the first value that is not `good`; `owner` is ``agent`` or ``task``, and the ids."""
    if not good.all():
        row = int(np.argmin(good))
        kind, ids = owner
        raise InputError(f"must be {rule}, got {values[row]:g} ({kind} {ids[row]!r})", f"{kind}s[{row}].{field_name}")


def require_magnitude(
    values: FloatArray, field_name: str, owner: tuple[str, tuple[str, ...]], most: float = MOST
) -> None:
    """Raise `InputError` for the first value > 0 that is below `LEAST` or above `most`; `owner` as in `require`."""
    good = (values == 0) | ((values >= LEAST) & (values <= most))
    bounds = f">= {LEAST:g}" if most == np.inf else f"from {LEAST:g} to {most:g}"
    require(good, values, field_name, f"{bounds}, in smaller units or larger ones", owner)
