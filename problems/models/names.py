"""Names of variables and rows from ids of agents and tasks, valid in all readers of LP and MPS files."""

import re
from collections.abc import Sequence

LONGEST = 40
"""Maximum number of characters of an id in a name, as readers reject names of more than about a hundred."""

SEPARATOR = "__"
"""Separator between agent and task, which does not occur in the name of either."""


def plain_names(ids: Sequence[str], default: str) -> list[str]:
    """Return a unique name of letters, digits and single underscores for each id.

    Parameters
    ----------
    ids : sequence of str
    default : str
        Name of ids without any such character.

    Returns
    -------
    list of str
        The id itself if it is valid and not too long, or else a similar name.
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
