"""Units in headers and after numbers, and conversions between them."""

import re
import unicodedata
from dataclasses import dataclass

from alloc.problems.units import LONGEST_LABEL

SCALES: dict[str, dict[str, float]] = {
    "distance": {"m": 1.0, "km": 1000.0, "mi": 1609.344, "nmi": 1852.0, "ft": 0.3048},
    "time": {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0},
    "energy": {"J": 1.0, "kJ": 1e3, "MJ": 1e6, "Wh": 3600.0, "kWh": 3.6e6},
    "mass": {"g": 1e-3, "kg": 1.0, "t": 1e3, "lb": 0.45359237},
    "area": {"m2": 1.0, "ha": 1e4, "km2": 1e6},
    "volume": {"l": 1e-3, "m3": 1.0},
    "power": {"W": 1.0, "kW": 1e3},
    "charge": {"mAh": 1e-3, "Ah": 1.0},
    "share": {"%": 1.0},
    "angle": {"°": 1.0},
}
"""Size of each unit in terms of the first unit of its kind."""

ALIASES = {
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "metros": "m", "kms": "km", "kilometer": "km",
    "kilometers": "km", "kilometre": "km", "kilometres": "km", "mile": "mi", "miles": "mi", "nm": "nmi",
    "feet": "ft", "sec": "s", "second": "s", "seconds": "s", "sek": "s", "mins": "min", "minute": "min",
    "minutes": "min", "hr": "h", "hrs": "h", "hour": "h", "hours": "h", "std": "h", "day": "d", "days": "d",
    "tag": "d", "kmh": "km/h", "kph": "km/h", "kmph": "km/h", "mps": "m/s", "mph": "mi/h", "kn": "nmi/h",
    "kt": "nmi/h", "kts": "nmi/h", "knots": "nmi/h", "whkm": "Wh/km", "joule": "J", "kilo": "kg", "kgs": "kg",
    "tons": "t", "tonnes": "t", "lbs": "lb", "sqm": "m2", "qm": "m2", "liter": "l", "litre": "l", "liters": "l",
    "litres": "l", "deg": "°", "degrees": "°", "percent": "%", "pct": "%", "prozent": "%",
}  # fmt: skip

KINDS = {label.casefold(): (kind, label) for kind, scale in SCALES.items() for label in scale}


@dataclass(frozen=True)
class Measure:
    """A unit, or a ratio of two with a factor: ``kWh/100km`` is kWh per km with factor 1/100."""

    top: str
    bottom: str = ""
    factor: float = 1.0

    def __str__(self) -> str:
        return f"{self.top}/{self.bottom}" if self.bottom else self.top


def kind_of(label: str) -> str:
    """Return the kind of a unit, such as distance, time or energy, ``""`` if unknown."""
    return KINDS.get(label.casefold(), ("", ""))[0]


def proportion(label: str, target: str) -> float | None:
    """Return the size of unit `label` in terms of unit `target`, None if unknown."""
    if label == target:
        return 1.0
    kind = kind_of(label)
    if not kind or kind_of(target) != kind:
        return None
    return SCALES[kind][label] / SCALES[kind][target]


def measure_of(text: str) -> Measure | None:
    """Parse a unit, such as ``km/h``, ``kg per hour`` or ``m²``; None if it is not a unit."""
    plain = unicodedata.normalize("NFKC", text).strip().strip(".").replace("^", "")
    plain = re.sub(r"\s*(?:/|\bper\b|\bpro\b|\bpar\b|\bpor\b)\s*", "/", plain, flags=re.IGNORECASE)
    plain = re.sub(r"[\s·*]*\bh-1$", "/h", re.sub(r"\bs-1$", "/s", plain))
    plain = ALIASES.get(plain.casefold(), plain)
    top, slash, bottom = plain.partition("/")
    factor = 1.0
    if slash:
        match = re.match(r"^(10+)\s*(?=\D)", bottom)
        if match:
            factor, bottom = 1 / float(match[1]), bottom[match.end() :]
    over, under = _label(top), _label(bottom) if slash else ""
    return None if over is None or under is None else Measure(over, under, factor)


def _label(text: str) -> str | None:
    text = text.strip()
    text = ALIASES.get(text.casefold(), text)
    return KINDS[text.casefold()][1] if text.casefold() in KINDS else None


def rate_of(text: str) -> Measure | None:
    """Parse a custom unit of work, alone or per time, such as ``panels/h``; None if it is not a word."""
    found = own_measure(text)
    is_rate = not found.bottom or kind_of(found.bottom) == "time"
    return found if is_rate and 0 < len(found.top) <= LONGEST_LABEL else None


def own_measure(text: str) -> Measure:
    """Parse a text that must be a unit, known or not."""
    top, _, bottom = re.sub(r"\s+per\s+", "/", text.strip()).partition("/")
    return Measure(_label(top) or top.strip(), _label(bottom) or bottom.strip())
