"""Conversion of batteries in percent, by the capacity in another column."""

import numpy as np

from alloc.problems.fields import FloatArray
from alloc.problems.tables.conversion import Found
from alloc.problems.tables.language.digits import Mark
from alloc.problems.tables.language.measures import Measure, kind_of
from alloc.problems.tables.matching import Match
from alloc.problems.tables.numeric import Numbers

ENERGIES = ("energy", "charge")
"""Kinds of units of battery capacities."""


def charged(
    match: Match, numbers: dict[str, FloatArray], found: list[Found], decimal: Mark | None, *, is_percent: bool
) -> str | None:
    """Convert batteries in percent to energy, by the capacity in an otherwise unused column; return a remark.

    Parameters
    ----------
    match : Match
    numbers : dict of str to ndarray
        Numbers by field; those of the battery are replaced.
    found : list of Found
        Units of the columns; that of the battery is replaced.
    decimal : {",", "."}, optional
    is_percent : bool
        Whether the user has specified that all energies are in percent.

    Raises
    ------
    InputError
        If the capacity is unknown.
    """
    place = next(
        (number for number, one in enumerate(found) if one.field == "battery" and _is_share(one.measure)), None
    )
    if place is None or is_percent or any(one.field != "battery" and _is_share(one.measure) for one in found):
        return None
    table, column = match.table, match.columns["battery"]
    taken = set(match.columns.values())
    capacities = [
        number
        for number, header in enumerate(table.headers)
        if number not in taken and "battery" in header.ranks and header.measure and _is_energy(header.measure)
    ]
    if len(capacities) != 1:
        raise table.error(
            "is in percent, but the capacity is unknown; add a column such as 'Battery capacity [Wh]', or name one "
            "with the energy by --map battery=...; if consumption is in percent, too, give --units energy=%",
            column=column,
        )
    (capacity,) = capacities
    whole, measure = Numbers(table, {"battery": capacity}, decimal).read("battery")
    with np.errstate(invalid="ignore"):
        numbers["battery"] = numbers["battery"] / 100 * whole
    name = table.headers[capacity].text
    match.columns["capacity of the battery"] = capacity
    found[place] = Found(table.source, name, "battery", measure)
    return f"{table.headers[column].text} is a percentage of {name}"


def _is_share(measure: Measure | None) -> bool:
    return measure is not None and kind_of(measure.top) == "share"


def _is_energy(measure: Measure) -> bool:
    return kind_of(measure.top) in ENERGIES and not measure.bottom
