"""Bases: named places to which agents return."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError
from alloc.problems.fields import BoolArray, FloatArray, IntArray, ReadOnly, flags, positions, references

NO_NAMES = ("", "true", "false")
"""Reserved names, ignoring case and blanks: in tables, they say whether an agent returns to its start."""

Place = Sequence[float] | None


@dataclass(frozen=True, eq=False)
class Bases(ReadOnly):
    """Named places.

    Attributes
    ----------
    ids : tuple of str
        Unique ids.
    position : ndarray, shape (bases, 3)
        Positions; NaN rows where unknown.
    """

    ids: tuple[str, ...] = ()
    position: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))

    @classmethod
    def of(cls, ids: Sequence[str], position: FloatArray | None = None) -> "Bases":
        """Build bases from their ids and, if known, their positions, shape (bases, 2) or (bases, 3).

        Raises
        ------
        InputError
            If an id is invalid, repeated or reserved, or a position is invalid.
        """
        seen: set[str] = set()
        for row, name in enumerate(ids):
            place = f"bases[{row}].id"
            if not isinstance(name, str) or not name:
                raise InputError(f"must be a non-empty string, got {shown(name)}", place)
            if name.strip().lower() in NO_NAMES:
                raise InputError(f"{name!r} cannot be the name of a base; choose another", place)
            if name in seen:
                raise InputError(f"the id {name!r} is used twice; ids must be unique", place)
            seen.add(name)
        bases = cls(tuple(ids), positions(position, len(ids), "base"))
        bases.position.setflags(write=False)
        return bases

    @classmethod
    def fitting(cls, given: "Bases | Mapping[str, Place] | None") -> "Bases":
        """Return `given` as bases; a mapping from ids to places is converted."""
        if given is None:
            return cls.of(())
        if isinstance(given, Bases):
            return given
        if not isinstance(given, Mapping):
            raise InputError(f"must be a dict of ids and places, got {shown(given)}", "bases")
        places = [[np.nan] * 3 if place is None else _three(place, row) for row, place in enumerate(given.values())]
        return cls.of(tuple(given), np.array(places, dtype=np.float64).reshape(-1, 3))

    def with_more(self, ids: Sequence[str], position: FloatArray) -> "Bases":
        """Return the bases with further ones appended; `position` has shape (k, 3)."""
        return Bases.of((*self.ids, *ids), np.vstack([self.position, position]))

    def new_id(self, wanted: str) -> str:
        """Return `wanted`, followed by a number if a base already has this name."""
        name, number = wanted, 1
        while name in self.ids:
            number += 1
            name = f"{wanted} ({number})"
        return name


def _three(place: Sequence[float], row: int) -> list[float]:
    try:
        x, y, *rest = place
        (z,) = rest or (0.0,)
        return [float(x), float(y), float(z)]
    except (TypeError, ValueError) as error:
        raise InputError(f"must be 2 or 3 numbers, got {shown(place)}", f"bases[{row}].position") from error


def returning(
    returns: ArrayLike | None, return_base: ArrayLike | None, n: int, bases: Bases
) -> dict[str, BoolArray | IntArray]:
    """Return the fields `returns` and `return_base` of an instance; by default, agents with a base return.

    Raises
    ------
    InputError
        If a field is not a valid list, or an agent with a `return_base` does not return.
    """
    base = references(return_base, "return_base", n, "base", len(bases.ids))
    if returns is None:
        return {"returns": base >= 0, "return_base": base}
    given = flags(returns, "returns", n)
    wrong = (base >= 0) & ~given
    if wrong.any():
        row = int(np.argmax(wrong))
        message = f"is False, but {bases.ids[base[row]]!r} is the base to which the agent returns"
        raise InputError(message, f"agents[{row}].returns")
    return {"returns": given, "return_base": base}
