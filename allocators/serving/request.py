"""Parsing and validation of requests to a service, from documents to arguments of `solve`."""

import math
from dataclasses import dataclass

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.problems import InputError, Instance
from alloc.problems.arguments import real, shown, text, whole
from alloc.problems.formats.document import from_document
from alloc.problems.formats.json_columns import Row, require_known
from alloc.problems.formats.json_text import require_object

REQUEST_FORMAT, ANSWER_FORMAT = "alloc-solve-request/1", "alloc-solve-answer/1"

ARGUMENTS = ("objective", "target_gap", "start", "makespan_slack", "makespan_limit", "move_price", "pins")
"""Fields that are passed to `solve` under the same name and validated there."""

OBJECTS = ("start", "pins")
"""Fields that are passed to `solve` and must be objects."""

COUNTS = {"iterations": 0, "seed": 0, "threads": 1}
"""Fields with integer values, and their minimum."""

OPTIONAL = ("parameters", *ARGUMENTS, *COUNTS)
"""Fields that may be null, as if they were not given."""

FIELDS = ("format", "id", "instance", "method", "limit_ms", *OPTIONAL)

LOCAL_PARAMETERS = ("policy", "device", "plain")
"""Parameters of built-in methods that untrusted clients may not set: they name files or hardware, or allow models of
unlimited size and time."""

LARGEST_WHOLE = 2**53 - 1
"""Largest integer that is exact in every JSON parser, as some use floats."""

LARGEST_PARAMETER = 10_000
"""Largest integer parameter that an untrusted client may set, as larger ones could exhaust memory."""


@dataclass(frozen=True)
class ServiceLimits(CheckedParameters):
    """Limits of a service.

    Attributes
    ----------
    agents, tasks : int
        Maximum number of agents and of tasks of an instance.
    limit_ms : float
        Maximum and default time limit of a request, in milliseconds.
    parallel : int
        Maximum number of parallel runs.
    queue : int
        Maximum number of waiting requests; further ones are rejected.
    strangers : bool
        Whether clients are untrusted, so that requests may not set `LOCAL_PARAMETERS` or large parameters.
    """

    agents: int = bounded(2_000, low=1)
    tasks: int = bounded(500, low=1)
    limit_ms: float = bounded(10_000.0, low=0)
    parallel: int = bounded(1, low=1, high=1024)
    queue: int = bounded(64, low=0)
    strangers: bool = False


@dataclass(frozen=True)
class SolveRequest:
    """A validated request.

    Attributes
    ----------
    instance : Instance
    method : str
    parameters : dict
        Parameters of the method, by name.
    limit_s : float
        Seconds from the arrival of the request to its answer.
    arguments : dict
        Further arguments of `solve`, by name.
    """

    instance: Instance
    method: str
    parameters: dict[str, object]
    limit_s: float
    arguments: dict[str, object]

    @classmethod
    def of(cls, row: Row, limits: ServiceLimits) -> "SolveRequest":
        """Return the request in a document.

        Raises
        ------
        InputError
            If a field is unknown, missing or invalid, or exceeds the limits; `place` names the field.
        """
        require_known(row, FIELDS, "")
        if row.get("format", REQUEST_FORMAT) != REQUEST_FORMAT:
            raise InputError(f"must be {REQUEST_FORMAT}, got {shown(row['format'])}", "format")
        if row.get("id") is not None:
            identity(row["id"], "id")
        given = {name: row[name] for name in OPTIONAL if row.get(name) is not None}
        for name in OBJECTS:
            require_object(given.get(name, {}), name)
        for name, least in COUNTS.items():
            if name in given:
                given[name] = whole(integral(given[name]), name, least, LARGEST_WHOLE)
        parameters = _parameters(require_object(given.pop("parameters", {}), "parameters"), limits)
        limit_ms = limits.limit_ms if row.get("limit_ms") is None else row["limit_ms"]
        return cls(
            instance=_instance(row.get("instance"), limits),
            method=text(row.get("method", "auto"), "method"),
            parameters=parameters,
            limit_s=real(limit_ms, "limit_ms", high=limits.limit_ms) / 1000,
            arguments=given,
        )


def identity(value: object, place: str) -> str | float:
    """Return the id of a request, as repeated in its answer.

    Raises
    ------
    InputError
        If it is neither a string nor a number that can be returned unchanged.
    """
    if isinstance(value, str):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST_WHOLE:  # no NaN
        return int(value) if value == int(value) else value
    words = f"must be a string or a number from -{LARGEST_WHOLE} to {LARGEST_WHOLE}, unique for each request"
    raise InputError(words, place)


def integral(value: object) -> object:
    """Return a float with an integral value as an int; other values unchanged."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _instance(given: object, limits: ServiceLimits) -> Instance:
    """Return the instance; raise an error before parsing it if it is too large."""
    if given is None:
        raise InputError("is missing; give an instance in the format alloc-instance/1", "instance")
    document = require_object(given, "instance")
    for name, most in (("agents", limits.agents), ("tasks", limits.tasks)):
        rows = document.get(name)
        if isinstance(rows, list) and len(rows) > most:
            raise InputError(f"has {len(rows)} {name}; this service accepts at most {most}", f"instance.{name}")
    try:
        return from_document({"format": "alloc-instance/1", **document})
    except InputError as error:
        raise InputError(error.message, f"instance.{error.place}" if error.place else "instance") from error


def _parameters(given: dict[str, object], limits: ServiceLimits) -> dict[str, object]:
    """Return the parameters of the method as Python values."""
    named = {name: _value(value) for name, value in given.items()}
    for name, value in named.items() if limits.strangers else ():
        if name in LOCAL_PARAMETERS:
            raise InputError("cannot be set by requests to this service", f"parameters.{name}")
        if isinstance(value, int) and value > LARGEST_PARAMETER:
            raise InputError(f"must be at most {LARGEST_PARAMETER} in this service", f"parameters.{name}")
    return named


def _value(value: object) -> object:
    if isinstance(value, list):
        return tuple(_value(entry) for entry in value)
    return math.inf if value == "inf" else integral(value)
