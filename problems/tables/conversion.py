"""Conversion of the units of all columns to one unit per quantity."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields

from alloc.problems.distances.geodesic import METRES
from alloc.problems.errors import InputError
from alloc.problems.tables.language.measures import Measure, kind_of, proportion
from alloc.problems.units import Units

DIMENSIONS = {
    "x": ("distance", ""),
    "y": ("distance", ""),
    "z": ("distance", ""),
    "distance": ("distance", ""),
    "range": ("distance", ""),
    "energy_per_distance": ("energy", "distance"),
    "battery": ("energy", ""),
    "ability": ("work", "time"),
    "workload": ("work", ""),
    "speed": ("distance", "time"),
}
"""Quantities in the unit of each field; the first field with a unit determines the common one."""

PLANE = ("x", "y")
DEFAULT_TIME = "h"
FITTING = {"distance": ("distance",), "time": ("time",), "energy": ("energy", "charge", "share", "mass", "volume", "")}
"""Kinds of units that fit a quantity; work may have any unit."""


@dataclass(frozen=True)
class Found:
    """The unit of a column: table and header, for messages, field, and the unit, if any."""

    source: str
    header: str
    field: str
    measure: Measure | None


@dataclass(frozen=True)
class Conversion:
    """Units of an instance, and the factor of each column.

    Attributes
    ----------
    units : Units
    factors : dict of (str, str) to float
        Factors by source and field.
    words : dict of (str, str) to str
        Descriptions of the factors.
    """

    units: Units
    factors: Mapping[tuple[str, str], float]
    words: Mapping[tuple[str, str], str]


def conversion(found: list[Found], given: Units, *, geographic: bool) -> Conversion:
    """Return the common units of all columns.

    Parameters
    ----------
    found : list of Found
        Units of the columns, without altitudes of geographic places, which are in metres.
    given : Units
        Units specified by the user, which take precedence.
    geographic : bool
        Whether distances are along the surface of the earth, by default in km.

    Raises
    ------
    InputError
        If units are incompatible, or the unit of places is unknown.
    """
    labels: dict[str, str] = {}
    for quantity in ("time", "distance", "energy", "work"):
        label = getattr(given, quantity) or _label(quantity, found, geographic=geographic)
        labels[quantity] = label
    units = Units(**{one.name: labels[one.name] for one in fields(Units)})
    factors: dict[tuple[str, str], float] = {}
    words: dict[tuple[str, str], str] = {}
    for one in found:
        if one.measure is None:
            continue
        factor = _factor(one, labels)
        key = (one.source, one.field)
        factors[key] = factor
        top, bottom = DIMENSIONS[one.field]
        target = Measure(labels[top], labels[bottom] if one.measure.bottom else "")
        if factor != 1:
            words[key] = f" in {target}, times {factor:g}"
    return Conversion(units, factors, words)


def _parts(one: Found) -> Iterator[tuple[str, str]]:
    """Yield the quantities in the unit of a column, and their labels."""
    if one.measure is not None:
        top, bottom = DIMENSIONS[one.field]
        yield top, one.measure.top
        if one.measure.bottom:
            yield bottom, one.measure.bottom


def _label(quantity: str, found: list[Found], *, geographic: bool) -> str:
    """Return the unit of a quantity according to the columns."""
    order = list(DIMENSIONS)
    labels = [
        (one.field, label)
        for one in sorted(found, key=lambda one: order.index(one.field))
        for name, label in _parts(one)
        if name == quantity
    ]
    if quantity == "time":  # the unit of speeds does not determine the time unit of abilities
        labels = [(field, DEFAULT_TIME if field == "speed" else label) for field, label in labels]
    if quantity == "distance" and geographic:
        return next((label for field, label in labels if field != "speed" and label in METRES), "km")
    if quantity == "distance" and len({label for _, label in labels}) > 1:
        for one in found:
            if one.field in PLANE and one.measure is None:
                others = ", ".join(dict.fromkeys(label for _, label in labels))
                raise InputError(
                    f"has no unit, and other columns have several ({others}); write it in the header, as '{one.header} "
                    f"[{labels[0][1]}]', or give --units distance=...",
                    f"column {one.header!r}",
                    one.source,
                )
    return labels[0][1] if labels else ""


def _factor(one: Found, labels: Mapping[str, str]) -> float:
    """Return the factor of a column."""
    assert one.measure is not None
    factor = one.measure.factor
    top, bottom = DIMENSIONS[one.field]
    if one.measure.bottom and not bottom:
        raise _unfit(one, one.measure, top)
    factor *= _proportion(one, top, one.measure.top, labels)
    if one.measure.bottom:
        factor /= _proportion(one, bottom, one.measure.bottom, labels)
    elif one.field in ("speed", "energy_per_distance"):
        raise _unfit(one, one.measure, f"{top} per {bottom}")
    return factor


def _proportion(one: Found, quantity: str, label: str, labels: Mapping[str, str]) -> float:
    if kind_of(label) not in FITTING.get(quantity, (kind_of(label),)):
        raise _unfit(one, label, quantity)
    found = proportion(label, labels[quantity])
    if found is None:
        raise InputError(
            f"is in {label}, but {quantity} elsewhere in {labels[quantity]}, which cannot be converted; use one unit",
            f"column {one.header!r}",
            one.source,
        )
    return found


def _unfit(one: Found, unit: object, quantity: str) -> InputError:
    return InputError(
        f"is in {unit}, which is not a unit of {quantity}; map another column", f"column {one.header!r}", one.source
    )
