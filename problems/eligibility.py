"""Eligibility of agents for tasks, by lists of allowed tasks and by skills."""

from collections.abc import Iterable, Sequence

import numpy as np

from alloc.problems.arguments import listed, shown
from alloc.problems.errors import InputError
from alloc.problems.fields import IntArray

Names = tuple[str, ...]


def name_sets(
    lists: Iterable[Iterable[str] | None] | None, count: int, kind: str, field_name: str
) -> tuple[Names, ...] | None:
    """Return the sorted unique names of each agent or task, empty for None; None if all are empty.

    Raises
    ------
    InputError
        If the number of entries is not `count`, or an entry is not a list of non-empty strings.
    """
    if lists is None:
        return None
    entries = listed(lists, field_name, "lists of strings, or None")
    if len(entries) != count:
        raise InputError(f"needs {count} entries, got {len(entries)}", field_name)
    known: dict[tuple[str, ...], Names] = {}  # equal sets of names share one tuple
    named = tuple(_names(entry, f"{kind}s[{row}].{field_name}", known) for row, entry in enumerate(entries))
    return named if any(named) else None


def _names(entry: Iterable[str] | None, place: str, known: dict[tuple[str, ...], Names]) -> Names:
    if entry is None or (isinstance(entry, float) and np.isnan(entry)):
        return ()
    if isinstance(entry, str) or not isinstance(entry, Iterable):
        raise InputError(f"must be a list of strings, got {shown(entry)}", place)
    names = tuple(entry)
    try:
        return known[names]
    except (KeyError, TypeError):  # not seen before, or not strings
        pass
    for name in names:
        if not isinstance(name, str) or not name:
            raise InputError(f"must be non-empty strings, got {shown(name)}", place)
    known[names] = tuple(sorted(set(names)))
    return known[names]


def eligible_tasks(
    allowed: Sequence[IntArray | None] | None, skills: Sequence[Names] | None, needs: Sequence[Names] | None, n: int
) -> Sequence[IntArray | None] | None:
    """Return the tasks that each agent may do by its list and its skills; None stands for all tasks.

    An agent may do a task if it has all skills that the task needs and its list, if any, contains the task.
    """
    if needs is None:
        return allowed
    held: Sequence[Names] = skills if skills is not None else [()] * n
    needed = [frozenset(names) for names in needs]
    distinct = {kind: frozenset(kind) for kind in set(held)}
    skilled = {kind: _tasks([names <= have for names in needed]) for kind, have in distinct.items()}
    combined: dict[tuple[Names, bytes], IntArray] = {}
    result: list[IntArray | None] = []
    for agent, kind in enumerate(held):
        tasks, listed_tasks = skilled[kind], None if allowed is None else allowed[agent]
        if listed_tasks is None:
            result.append(tasks if len(tasks) < len(needs) else None)
            continue
        key = (kind, listed_tasks.tobytes())
        if key not in combined:
            combined[key] = np.intersect1d(tasks, listed_tasks, assume_unique=True)
        result.append(combined[key])
    return None if all(tasks is None for tasks in result) else result


def _tasks(able: list[bool]) -> IntArray:
    return np.flatnonzero(np.array(able))
