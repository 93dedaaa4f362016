"""Labels of the units that an instance is in, for text, tables and pictures; nothing is converted by them."""

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError
from alloc.problems.vocabulary import GEOGRAPHIC

if TYPE_CHECKING:
    from alloc.problems.instance import Instance


@dataclass(frozen=True)
class Units:
    """What one of each quantity is called; empty where the user does not say.

    Attributes
    ----------
    time, distance, energy, work : str
        Such as ``h``, ``km``, ``kWh`` and ``m2``.
    """

    time: str = ""
    distance: str = ""
    energy: str = ""
    work: str = ""

    def __post_init__(self) -> None:
        """Raise `InputError` for a label that is no short text in one line."""
        for field in fields(self):
            label = getattr(self, field.name)
            if not isinstance(label, str) or not label.isprintable() or len(label) > LONGEST_LABEL:
                raise InputError(
                    f"must be a text of at most {LONGEST_LABEL} characters, got {shown(label)}", f"units.{field.name}"
                )


LONGEST_LABEL = 20
"""Characters of a label."""


def labels(instance: "Instance") -> Units:
    """Return what the units of an instance are called: as it says, and km for distances on the earth."""
    units = instance.units
    return replace(units, distance=instance.distance_unit) if instance.metric == GEOGRAPHIC else units
