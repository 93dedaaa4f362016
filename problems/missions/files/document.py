"""Conversion between missions and JSON documents (alloc-mission/1)."""

import math
import re
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.fields import FloatArray
from alloc.problems.formats import json_columns as columns_of
from alloc.problems.formats.columns import (
    AGENT_FIELDS,
    DEFAULT_NAME,
    INSTANCE_FORMAT,
    TASK_FIELDS,
    plain_numbers,
    require_format,
)
from alloc.problems.formats.document import INSTANCE_FIELDS, from_document, to_document
from alloc.problems.formats.json_columns import Row, require_known
from alloc.problems.formats.json_text import require_object
from alloc.problems.formats.messages import described
from alloc.problems.missions.events import FIELDS, Event, EventKind
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Burst, Pace, Radio

MISSION_FORMAT = "alloc-mission/1"

SETTINGS = ("horizon", "knowledge", "sensing", "radio", "pace", "seed")
HEADER_FIELDS = (*(name for name in INSTANCE_FIELDS if name not in ("agents", "tasks")), *SETTINGS)
MISSION_FIELDS = (*HEADER_FIELDS, "agents", "tasks", "events")
RADIO_FIELDS = ("radius", "period", "loss", "delay", "burst")
BURST_FIELDS = ("good", "bad", "loss_good", "loss_bad")
PACE_FIELDS = ("low", "high", "period")
HOURS_OF_AGENT = ("joins",)
HOURS_OF_TASK = ("appears", "deadline", "growth")

Made = TypeVar("Made")


def mission_from_document(document: object, *, default_name: str = DEFAULT_NAME) -> Mission:
    """Return the mission in a JSON document.

    Parameters
    ----------
    document : dict
        As returned by `json.load`; an instance is a mission without events.
    default_name : str
        Name of the mission if the document gives none.

    Raises
    ------
    InputError
        If the document breaks the rules of the format.
    """
    header = require_object(document)
    if header.get("format") == INSTANCE_FORMAT:
        return Mission(from_document(header, default_name=default_name))
    require_format(header.get("format"), (MISSION_FORMAT, INSTANCE_FORMAT))
    require_known(header, MISSION_FIELDS, "")
    agents = columns_of.rows(header, "agents", (*AGENT_FIELDS, *HOURS_OF_AGENT))
    tasks = columns_of.rows(header, "tasks", (*TASK_FIELDS, *HOURS_OF_TASK))
    events = _Events(header.get("events"), len(agents), len(tasks))
    agents, tasks = [*agents, *events.agents], [*tasks, *events.tasks]
    try:
        instance = from_document(
            {
                **{name: value for name, value in header.items() if name in INSTANCE_FIELDS},
                "format": INSTANCE_FORMAT,
                "agents": [_without(row, HOURS_OF_AGENT) for row in agents],
                "tasks": [_without(row, HOURS_OF_TASK) for row in tasks],
            },
            default_name=default_name,
        )
        return Mission(
            instance,
            joins=columns_of.nullable_numbers(agents, "agents", "joins"),
            **{name: columns_of.nullable_numbers(tasks, "tasks", name) for name in ("appears", "deadline")},
            growth=_growth(tasks),
            events=events.made,
            horizon=_unlimited(header, "horizon"),
            knowledge=_given(header, "knowledge", "full"),
            sensing=_unlimited(header, "sensing"),
            radio=_made(Radio, header.get("radio"), "radio", RADIO_FIELDS),
            pace=_made(Pace, header.get("pace"), "pace", PACE_FIELDS),
            seed=_whole(header, "seed"),
        )
    except InputError as error:
        raise InputError(error.message, events.place(error.place), error.source) from error.__cause__


class _Events:
    """The events of a document, and the agents and tasks defined in them.

    Attributes
    ----------
    made : list of Event
    agents, tasks : list of dict
        In the form of the document's lists, to which they are appended.
    """

    def __init__(self, given: object, n: int, m: int) -> None:
        self.agents: list[Row] = []
        self.tasks: list[Row] = []
        self._owner: dict[str, str] = {}
        self._first = {"agents": n, "tasks": m}
        if given is not None and not isinstance(given, list):
            raise InputError(f"must be a list, got {described(given)}", "events")
        self.made = [self._event(require_object(one, f"events[{row}]"), row) for row, one in enumerate(given or [])]

    def _event(self, row: Row, number: int) -> Event:
        place = f"events[{number}]"
        kind = row.get("event")
        if kind not in list(EventKind):
            problem = "is missing; it must be" if kind is None else f"is {described(kind)}, but must be"
            raise InputError(f"{problem} one of {', '.join(EventKind)}", f"{place}.event")
        kind = EventKind(str(kind))
        require_known(row, ("hour", "event", *FIELDS[kind]), place)
        values = {name: value for name, value in row.items() if name != "event" and value is not None}
        if kind is EventKind.AGENT_JOINS and isinstance(row.get("agent"), dict):
            values["agent"] = self._whole(row["agent"], number, "agent", AGENT_FIELDS)
        if kind is EventKind.TASK_APPEARS and isinstance(row.get("task"), dict):
            fields = (*TASK_FIELDS, *HOURS_OF_TASK[1:])
            values["task"] = self._whole(row["task"], number, "task", fields)
        if "hour" not in values:
            raise InputError("is missing; it must be a number >= 0", f"{place}.hour")
        try:
            return Event(kind=kind, **values)  # type: ignore[arg-type]  # which it checks
        except InputError as error:
            raise InputError(error.message, f"{place}.{error.place}") from error

    def _whole(self, row: object, number: int, kind: str, known: Sequence[str]) -> str:
        """Append an agent or a task defined in its event to the document's list, and return its id."""
        place, rows = f"events[{number}].{kind}", self.agents if kind == "agent" else self.tasks
        fields = require_object(row, place)
        require_known(fields, known, place)
        if not isinstance(fields.get("id"), str):
            raise InputError(f"must be a non-empty string, got {described(fields.get('id'))}", f"{place}.id")
        self._owner[f"{kind}s[{self._first[f'{kind}s'] + len(rows)}]"] = place
        rows.append(fields)
        return str(fields["id"])

    def place(self, place: str) -> str:
        """Return the place in the document of an entry that was appended to the lists of agents and tasks."""
        row = re.match(r"(agents|tasks)\[\d+\]", place)
        return place if row is None else self._owner.get(row[0], row[0]) + place[row.end() :]


def mission_to_document(mission: Mission) -> Row:
    """Return `mission` as a document for `json.dump`; `mission_from_document` is the inverse.

    Agents that join and tasks that appear by an event are defined in it.

    Raises
    ------
    InputError
        If an id contains characters that no file can hold.
    """
    document = to_document(mission.instance)
    agents, tasks = document.pop("agents"), document.pop("tasks")
    distances = {"distances": document.pop("distances")} if "distances" in document else {}
    joined, appeared = _owners(mission, EventKind.AGENT_JOINS), _owners(mission, EventKind.TASK_APPEARS)
    _add(agents, "joins", mission.joins, 0.0)
    _add(tasks, "appears", mission.appears, 0.0)
    _add(tasks, "deadline", mission.deadline, math.inf)
    _add(tasks, "growth", mission.growth, 0.0)
    assert isinstance(agents, list)
    assert isinstance(tasks, list)
    events = [event.to_dict() for event in mission.events]
    for names, rows, kind in ((joined, agents, "agent"), (appeared, tasks, "task")):
        for row in rows:
            if row["id"] in names:
                events[names[row["id"]]][kind] = _without(row, ("joins", "appears"))
    return {
        **document,
        "format": MISSION_FORMAT,
        **_settings(mission),
        **distances,
        "agents": [row for row in agents if row["id"] not in joined],
        "tasks": [row for row in tasks if row["id"] not in appeared],
        "events": events,
    }


def _owners(mission: Mission, kind: EventKind) -> dict[str, int]:
    """Return the number of the event by which each agent joins, or each task appears."""
    events = enumerate(mission.events)
    return {str(event.agent or event.task): number for number, event in events if event.kind is kind}


def _settings(mission: Mission) -> Row:
    def limit(value: float) -> float | None:
        return None if value == math.inf else value

    radio, pace = mission.radio, mission.pace
    return {
        "horizon": limit(mission.horizon),
        "knowledge": str(mission.knowledge),
        "sensing": limit(mission.sensing),
        "radio": {
            "radius": limit(radio.radius),
            "period": radio.period,
            "loss": radio.loss,
            "delay": radio.delay,
            "burst": None if radio.burst is None else {name: getattr(radio.burst, name) for name in BURST_FIELDS},
        },
        "pace": None if pace is None else {name: getattr(pace, name) for name in PACE_FIELDS},
        "seed": mission.seed,
    }


def _add(rows: object, name: str, values: FloatArray, usual: float) -> None:
    """Add a field to rows, unless it has its default value everywhere."""
    assert isinstance(rows, list)
    if (values != usual).any():
        for row, value in zip(rows, plain_numbers(values), strict=True):
            row[name] = value


def _without(row: Row, names: Sequence[str]) -> Row:
    return {name: value for name, value in row.items() if name not in names}


def _growth(tasks: list[Row]) -> FloatArray:
    values = columns_of.numbers(tasks, "tasks", "growth")
    return np.where(np.isnan(values), 0.0, values)


def _unlimited(header: Row, name: str) -> float:
    value = columns_of.nullable_numbers([header], "", name)
    if value is not None and value[0] == math.inf:
        raise InputError("must be a finite number, or null for no limit", name)
    return math.inf if value is None else float(value[0])


def _given(header: Row, name: str, default: str) -> str:
    value = header.get(name)
    if not isinstance(value, str | None):
        raise InputError(f"must be a string, got {described(value)}", name)
    return default if value is None else value


def _whole(header: Row, name: str) -> int:
    value = header.get(name)
    if value is None:
        return 0
    if isinstance(value, float) and value.is_integer():  # not NaN or infinity
        return int(value)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"must be a whole number >= 0, got {described(value)}", name)
    return value


def _made(kind: Callable[..., Made], given: object, place: str, known: Sequence[str]) -> Made | None:
    """Return the settings in an object, with defaults for null fields; None if there is no object."""
    if given is None:
        return None
    fields = require_object(given, place)
    require_known(fields, known, place)
    values = {name: value for name, value in fields.items() if value is not None and name != "burst"}
    if fields.get("burst") is not None:
        values["burst"] = _made(Burst, fields["burst"], f"{place}.burst", BURST_FIELDS)
    try:
        return kind(**values)
    except TypeError as error:
        missing = ", ".join(re.findall(r"'(\w+)'", str(error)))
        raise InputError(f"needs {missing}", place) from error
