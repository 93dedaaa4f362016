"""Names of variables and rows that every reader of LP and MPS files takes, by the ids of agents and tasks."""

import re
from collections.abc import Sequence

LONGEST = 40
"""Characters of an id that enter a name: readers refuse names of more than about a hundred."""

SEPARATOR = "__"
"""Stands between agent and task; no single name has it."""


def plain_names(ids: Sequence[str], default: str) -> list[str]:
    """Return one name of letters, digits and single underscores for each id, no two alike.

    Parameters
    ----------
    ids : sequence of str
    default : str
        What ids without a single such letter are called.

    Returns
    -------
    list of str
        The id itself where it is such a name and not too long.
    """
    names = [re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")[:LONGEST].rstrip("_") or default for name in ids]
    taken = {name for name, own in zip(names, ids, strict=True) if name == own}
    for number, (name, own) in enumerate(zip(names, ids, strict=True), 1):
        if name == own:
            continue
        candidate, extra = name, number
        while candidate in taken:
            candidate, extra = f"{name}_{extra}", extra + len(ids)
        taken.add(candidate)
        names[number - 1] = candidate
    return names
