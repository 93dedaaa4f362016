"""The fields of an instance as arrays: what they may hold."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from alloc.problems.errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

IDLE = -1
"""The task index of an agent without a task."""


LEAST, MOST = 1e-60, 1e60
"""Magnitudes between which quotients and products of a few numbers neither under- nor overflow."""


def vector(values: ArrayLike, field_name: str, length: int | None = None) -> FloatArray:
    """Return numbers in one row, copied."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError("must be a list of numbers", field_name) from error
    if array.ndim != 1 or (length is not None and len(array) != length):
        expected = "a list" if length is None else f"a list of {length} numbers"
        raise InputError(f"must be {expected}, got shape {array.shape}", field_name)
    return array


def ids(names: Iterable[str] | None, count: int, prefix: str, kind: str) -> tuple[str, ...]:
    """Return names that are unique; `prefix` and a number where none are given."""
    if names is None:
        return tuple(f"{prefix}{index}" for index in range(1, count + 1))
    unique = tuple(names)
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
    """Return three coordinates per row: z = 0 where only x and y are given, a row of NaN where unknown."""
    if values is None:
        return np.full((count, 3), np.nan)
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError("must hold 2 or 3 numbers per row", f"{kind}_position") from error
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


def starts(values: ArrayLike | None, n: int, m: int) -> IntArray:
    """Return the index of the task where each agent begins, -1 for none."""
    if values is None:
        return np.full(n, IDLE, dtype=np.intp)
    array = np.array(values)
    if array.shape != (n,) or not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"must be a list of {n} task indices, -1 for none", "start_task")
    wrong = (array < IDLE) | (array >= m)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(f"is {array[row]}, but tasks run from 0 to {m - 1}", f"agents[{row}].start_task")
    return array.astype(np.intp)


def allowed(lists: Sequence[Iterable[int] | None] | None, n: int, m: int) -> tuple[IntArray | None, ...] | None:
    """Return the tasks that each agent may do, sorted and without repetitions; None where all agents may do all."""
    if lists is None:
        return None
    if len(lists) != n:
        raise InputError(f"needs {n} entries, got {len(lists)}", "allowed_tasks")
    if all(entry is None for entry in lists):
        return None
    listed = [row for row, entry in enumerate(lists) if entry is not None]
    arrays = [_indices(entry, row) for row, entry in enumerate(lists) if entry is not None]
    owner, task = np.repeat(listed, list(map(len, arrays))), np.concatenate(arrays)
    wrong = (task < 0) | (task >= m)
    if wrong.any():
        raise InputError(f"names a task outside 0 to {m - 1}", f"agents[{owner[np.argmax(wrong)]}].tasks")
    pairs = np.sort(owner * m + task)  # one sort for all agents: far faster than one for each
    owner, task = np.divmod(pairs[np.diff(pairs, prepend=-1) > 0], m)
    task.setflags(write=False)
    result: list[IntArray | None] = [None] * n
    bounds = np.searchsorted(owner, [*listed, n]).tolist()
    for row, (first, end) in zip(listed, pairwise(bounds), strict=True):
        result[row] = task[first:end]
    return tuple(result)


def _indices(entry: Iterable[int], row: int) -> IntArray:
    array = np.asarray(entry if isinstance(entry, np.ndarray | list | tuple) else list(entry))
    if array.ndim != 1 or (len(array) and array.dtype.kind not in "iu"):
        raise InputError("must be a list of task indices, or None for all", f"agents[{row}].tasks")
    return array.astype(np.intp)


def require(
    good: NDArray[np.bool_], values: FloatArray, field_name: str, rule: str, owner: tuple[str, tuple[str, ...]]
) -> None:
    """Raise `InputError` for the first value that is not `good`; `owner`: what they belong to, and its ids."""
    if not good.all():
        row = int(np.argmin(good))
        kind, ids = owner
        raise InputError(f"must be {rule}, got {values[row]:g} ({kind} {ids[row]!r})", f"{kind}s[{row}].{field_name}")


def require_magnitude(
    values: FloatArray, field_name: str, owner: tuple[str, tuple[str, ...]], most: float = MOST
) -> None:
    """Raise `InputError` for the first value > 0 that is below `LEAST` or beyond `most`; `owner` as in `require`."""
    good = (values == 0) | ((values >= LEAST) & (values <= most))
    bounds = f">= {LEAST:g}" if most == np.inf else f"from {LEAST:g} to {most:g}"
    require(good, values, field_name, f"{bounds}, in smaller units or larger ones", owner)
