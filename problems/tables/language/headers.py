"""Parsing of column headers into name and unit."""

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal

from alloc.problems.tables.language.measures import Measure, kind_of, measure_of
from alloc.problems.tables.language.synonyms import AGENTS, BASES, DISTANCES, KINDS, TASKS, Synonyms

Kind = Literal["agents", "tasks", "bases", "distances"]

SYNONYMS: Mapping[Kind, Synonyms] = {"agents": AGENTS, "tasks": TASKS, "bases": BASES, "distances": DISTANCES}

BRACKETS = re.compile(r"^(.*?)\s*[\[(<]\s*([^\])>]*?)\s*[\])>]\s*(.*)$", re.DOTALL)
TAIL = re.compile(
    r"^(.*?)(?:[\s_,;:/-]+in\s+|\s*[,;:/]\s*|[\s_-]+)([^\s_,;:]+(?:\s+per\s+\w+)?)$", re.IGNORECASE | re.DOTALL
)
FILLERS = re.compile(
    r"^(?:max|maximum|maximal\w*|nominal|net|rated|est|estimated|required|the|our|mean|avg|average|home|base|start|depot"
    r"|launch|current|initial|agent|drone|robot|vehicle|task|job|site|target|customer)\s+"
    r"|\s+(?:max|maximum|nominal|net|rated|est|estimated)$"
)
"""Words that do not change the meaning of a column name."""

USED = ("energy", "charge", "volume")
"""Kinds of units of what agents consume."""

ENDINGS = frozenset(("id", "lat", "lon"))
"""Fields that are recognised by the last word of a name alone, as in `Standort Lat` and `Asset ID`."""


@dataclass(frozen=True)
class Header:
    """A parsed header.

    Attributes
    ----------
    text : str
        Original text.
    ranks : dict of str to int
        Fields that the column may be, with the rank of each; 0 is most certain.
    measure : Measure, optional
        Unit of the column, if any.
    label : str
        Text in square brackets or parentheses that is not a known unit: a custom unit, or a remark.
    """

    text: str
    ranks: Mapping[str, int]
    measure: Measure | None = None
    label: str = ""


def plain(text: str) -> str:
    """Return a name in lower case without accents, with words separated by single spaces."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    decomposed = unicodedata.normalize("NFKD", text).casefold()
    letters = "".join(letter for letter in decomposed if not unicodedata.combining(letter))
    return " ".join(re.findall(r"[^\W_]+|#", letters))


@cache
def names(kind: Kind) -> dict[str, dict[str, int]]:
    """Return the possible fields of each column name, with their ranks."""
    found: dict[str, dict[str, int]] = {}
    for field, ranks in SYNONYMS[kind].items():
        for rank, texts in enumerate(ranks):
            for text in texts.split(","):
                found.setdefault(text.strip(), {}).setdefault(field, rank)
    for noun in KINDS.get(kind, "").split(", "):
        for rank, suffixes in enumerate(("id", "name", "no nr number nummer numero code #")):
            for suffix in suffixes.split():
                found.setdefault(f"{noun} {suffix}", {}).setdefault("id", rank)
    found.setdefault("#", {}).setdefault("id", 2)
    return found


def ranks_of(text: str, kind: Kind) -> dict[str, int]:
    """Return the possible fields of a name; exact names of fields rank first, other wordings last."""
    name, known = plain(text), names(kind)
    for candidate in (name, name.replace(" ", "")):
        if candidate in known:
            return known[candidate]
    without = re.sub(FILLERS, "", name)
    if without in known:
        return {field: max(rank, 1) for field, rank in known[without].items() if field != "id"}
    last = name.split()[-1] if " " in name else ""
    return dict.fromkeys(ENDINGS & known.get(last, {}).keys(), 2) if kind != "distances" else {}


def _ranks_by_unit(measure: Measure | None, kind: Kind, ranks: Mapping[str, int]) -> Mapping[str, int]:
    """Return the possible fields by name, or by a more specific unit, such as consumption per distance."""
    if measure is None or kind != "agents" or kind_of(measure.top) not in USED:
        return ranks
    if not ranks and kind_of(measure.bottom) == "distance":
        return {"energy_per_distance": 2}
    is_capacity = not measure.bottom and ranks == names(kind).get("capacity") and kind_of(measure.top) != "volume"
    return {"battery": 1} if is_capacity else ranks


def header_of(text: str, kind: Kind) -> Header:
    """Parse a header with a unit in brackets or after its name."""
    bracket = BRACKETS.match(text)
    if bracket and (bracket[1] or bracket[3]):
        measure = measure_of(bracket[2])
        inner = header_of(f"{bracket[1]} {bracket[3]}".strip(), kind)
        label = "" if measure else bracket[2]
        return Header(text, _ranks_by_unit(measure, kind, inner.ranks), measure or inner.measure, label)
    tail = TAIL.match(text)
    measure = measure_of(tail[2]) if tail else None
    if tail and measure:
        ranks = _ranks_by_unit(measure, kind, ranks_of(tail[1], kind))
        if ranks:
            return Header(text, ranks, measure)
    whole = measure_of(text) if kind == "distances" else None  # "km" is a distance in km
    return Header(text, ranks_of(text, kind), whole)
