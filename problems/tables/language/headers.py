"""Headers of columns: the name and the unit that each holds."""

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
"""Words that change nothing of what a column is."""

USED = ("energy", "charge", "volume")
"""Kinds of units of what agents use up."""

ENDINGS = frozenset(("id", "lat", "lon"))
"""Fields that a name is of where its last word alone is, such as `Standort Lat` and `Asset ID`."""


@dataclass(frozen=True)
class Header:
    """What a header says.

    Attributes
    ----------
    text : str
        As it stands in the table.
    ranks : dict of str to int
        Fields that the column may be, and how sure its name is of each: 0 is surest.
    measure : Measure, optional
        Its unit, if it has one.
    label : str
        What stands in square brackets or round ones and is no known unit: a unit of the user's own, or a remark.
    """

    text: str
    ranks: Mapping[str, int]
    measure: Measure | None = None
    label: str = ""


def plain(text: str) -> str:
    """Return a name in small letters without accents, its words separated by single blanks."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    decomposed = unicodedata.normalize("NFKD", text).casefold()
    letters = "".join(letter for letter in decomposed if not unicodedata.combining(letter))
    return " ".join(re.findall(r"[^\W_]+|#", letters))


@cache
def names(kind: Kind) -> dict[str, dict[str, int]]:
    """Return the fields, with their ranks, that each name of a column may be."""
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
    """Return the fields that a name may be; the names of fields themselves come first, other wordings last."""
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
    """Return what a column may be by its name, or by a unit that says more: of what is used per distance, or held."""
    if measure is None or kind != "agents" or kind_of(measure.top) not in USED:
        return ranks
    if not ranks and kind_of(measure.bottom) == "distance":
        return {"energy_per_distance": 2}
    is_capacity = not measure.bottom and ranks == names(kind).get("capacity") and kind_of(measure.top) != "volume"
    return {"battery": 1} if is_capacity else ranks


def header_of(text: str, kind: Kind) -> Header:
    """Return what a header says, its unit in brackets or behind its name."""
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
