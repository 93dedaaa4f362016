"""Labels of the units that an instance is in, for text, tables and pictures; only speeds can be in others."""

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from fractions import Fraction
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


def common_units(units: Iterable[Units]) -> Units:
    """Return the labels on which all of some units agree."""
    given = list(units)
    found = {field.name: {getattr(one, field.name) for one in given} for field in fields(Units)}
    return Units(**{name: names.pop() for name, names in found.items() if len(names) == 1})


METRES = {name: Fraction(length) for name, length in (
    ("m", "1"), ("km", "1000"), ("mi", "1609.344"), ("nmi", "1852"), ("ft", "0.3048"),
)}  # fmt: skip
"""Metres in each unit of distance that speeds are converted from and to."""

SECONDS = {"s": 1, "min": 60, "h": 3600, "d": 86_400}
"""Seconds in each unit of time that speeds are converted from and to."""

SHORT_SPEEDS = {"kn": ("nmi", "h"), "mph": ("mi", "h")}
"""Units of speed that do not name distance and time."""


def speed_factor(unit: str, units: Units) -> float:
    """Return what a speed in `unit` is multiplied by to be distance per time in `units`.

    Parameters
    ----------
    unit : str
        Such as ``m/s``, ``km/h``, ``kn`` or ``mph``.
    units : Units

    Raises
    ------
    InputError
        If `unit`, or that of distance or time, is not known.
    """
    distance, slash, time = unit.partition("/")
    distance, time = (distance, time) if slash else SHORT_SPEEDS.get(unit, ("", ""))
    if distance not in METRES or time not in SECONDS:
        names = f"one of {', '.join(METRES)} per one of {', '.join(SECONDS)}, such as 'm/s'"
        raise InputError(
            f"must be {names}, or {' or '.join(map(repr, SHORT_SPEEDS))}, got {shown(unit)}", "units.speed"
        )
    for name, label, known in (("distance", units.distance, METRES), ("time", units.time, SECONDS)):
        if not label:
            raise InputError(f"is missing; speeds in {unit} are converted by it", f"units.{name}")
        if label not in known:
            message = f"must be one of {', '.join(known)}, as speeds in {unit} are converted by it, got {shown(label)}"
            raise InputError(message, f"units.{name}")
    length, duration = METRES[distance] / METRES[units.distance], Fraction(SECONDS[units.time], SECONDS[time])
    return float(length * duration)
