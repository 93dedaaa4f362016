"""Labels of the units that an instance is in, for text, tables and pictures; nothing is converted by them."""

from dataclasses import dataclass, fields

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError


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


def labelled(value: str, unit: str) -> str:
    """Return a number with its unit behind it, if it has one."""
    return f"{value} {unit}" if unit else value
