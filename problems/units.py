"""Labels of an instance's units, for text, tables and pictures; only speeds are converted."""

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
    """Labels of the units of an instance; empty if not given.

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
        """Raise `InputError` for a label that is not a short printable string."""
        for field in fields(self):
            label = getattr(self, field.name)
            if not isinstance(label, str) or not label.isprintable() or len(label) > LONGEST_LABEL:
                raise InputError(
                    f"must be a text of at most {LONGEST_LABEL} characters, got {shown(label)}", f"units.{field.name}"
                )


LONGEST_LABEL = 20
"""Maximum number of characters of a label."""


def labels(instance: "Instance") -> Units:
    """Return the labels of an instance's units; geographic distances are in km unless it says otherwise."""
    units = instance.units
    return replace(units, distance=instance.distance_unit) if instance.metric == GEOGRAPHIC else units


def common_units(units: Iterable[Units]) -> Units:
    """Return the labels that are the same in all `units`, and empty ones elsewhere."""
    given = list(units)
    found = {field.name: {getattr(one, field.name) for one in given} for field in fields(Units)}
    return Units(**{name: names.pop() for name, names in found.items() if len(names) == 1})


METRES = {name: Fraction(length) for name, length in (
    ("m", "1"), ("km", "1000"), ("mi", "1609.344"), ("nmi", "1852"), ("ft", "0.3048"),
)}  # fmt: skip
"""Metres per unit of distance, for the conversion of speeds."""

SECONDS = {"s": 1, "min": 60, "h": 3600, "d": 86_400}
"""Seconds per unit of time, for the conversion of speeds."""

SHORT_SPEEDS = {"kn": ("nmi", "h"), "mph": ("mi", "h")}
"""Units of speed that are not written as distance per time."""


def speed_factor(unit: str, units: Units) -> float:
    """Return the factor that converts a speed in `unit` to distance per time in `units`.

    Parameters
    ----------
    unit : str
        Such as ``m/s``, ``km/h``, ``kn`` or ``mph``.
    units : Units

    Raises
    ------
    InputError
        If `unit`, or the unit of distance or time in `units`, is unknown.
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
            raise InputError(f"is missing; it is needed to convert speeds in {unit}", f"units.{name}")
        if label not in known:
            message = f"must be one of {', '.join(known)} to convert speeds in {unit}, got {shown(label)}"
            raise InputError(message, f"units.{name}")
    length, duration = METRES[distance] / METRES[units.distance], Fraction(SECONDS[units.time], SECONDS[time])
    return float(length * duration)
