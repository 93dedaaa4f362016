"""Inputs of a planner: events of missions, and reports of agents."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from alloc.problems.arguments import of_type, real, shown, text
from alloc.problems.changes.move import position
from alloc.problems.errors import InputError, nearest
from alloc.problems.formats.json_columns import Row, require_known
from alloc.problems.missions.events import FIELDS, LATEST, Event, EventKind

AGENT_REPORTS = "agent-reports"
"""Kind of input that is not an event of missions, as it depends on agents' orders."""

REPORT_FIELDS = ("agent", "position", "task", "battery")


@dataclass(frozen=True)
class Report:
    """An agent's own report of its place and battery.

    Attributes
    ----------
    hour : float
    agent : str
        Id of the agent.
    position : tuple of float, or None
        Two or three coordinates of its place.
    task : str or None
        Id of the task where it is, instead of coordinates.
    battery : float or None
        Energy left.

    Raises
    ------
    InputError
        If a value is invalid, or all are None.
    """

    hour: float
    agent: str
    position: tuple[float, ...] | None = None
    task: str | None = None
    battery: float | None = None

    def __post_init__(self) -> None:
        self._set("hour", float(real(self.hour, "hour", 0, LATEST)))
        self._set("agent", text(self.agent, "agent"))
        if self.position is not None:
            place = tuple(position(self.position))
            if not all(math.isfinite(axis) for axis in place):
                raise InputError(f"must be finite numbers, got {list(place)}", "position")
            self._set("position", place)
        if self.task is not None:
            self._set("task", text(self.task, "task"))
        if self.battery is not None:
            self._set("battery", float(real(self.battery, "battery", 0, LATEST)))
        if self.position is not None and self.task is not None:
            raise InputError("gives the place of the agent, as does position; give one of them", "task")
        if (self.position, self.task, self.battery) == (None, None, None):
            raise InputError("reports nothing; give position or task, battery, or both", "agent")

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def to_dict(self) -> Row:
        """Return the report as in a JSON line."""
        fields: Row = {"hour": self.hour, "event": AGENT_REPORTS}
        for name in REPORT_FIELDS:
            value = getattr(self, name)
            if value is not None:
                fields[name] = list(value) if isinstance(value, tuple) else value
        return fields


@dataclass(frozen=True)
class Input:
    """An input of a planner.

    Attributes
    ----------
    said : Event or Report
    whole : dict or None
        The fields of a new agent or task, if its event defines one.
    """

    said: Event | Report
    whole: Row | None = None

    @classmethod
    def of(cls, given: object, now: float) -> "Input":
        """Return the input given as an event, a report, or the fields of one.

        Parameters
        ----------
        given : Event, Report or mapping
        now : float
            Hour of an input without one.

        Raises
        ------
        InputError
            If it is none of these, a field is unknown or missing, or a value is invalid.
        """
        if isinstance(given, Event | Report):
            return cls(given)
        row = dict(of_type(given, Mapping, "event"))
        kind = row.pop("event", None)
        kinds = (*map(str, EventKind), AGENT_REPORTS)
        if kind is None:
            raise InputError(f"is missing; it must be one of {', '.join(kinds)}", "event")
        kind = text(kind, "event")
        if kind not in kinds:
            raise InputError(f"there is no event {shown(kind)}{nearest(kind, kinds)}", "event")
        fields = REPORT_FIELDS if kind == AGENT_REPORTS else FIELDS[EventKind(kind)]
        require_known(row, ("hour", *fields), "")
        values = {"hour": now, **{name: value for name, value in row.items() if value is not None}}
        if kind == AGENT_REPORTS:
            if "agent" not in values:
                raise InputError(f"is missing; {kind} needs it", "agent")
            return cls(Report(**values))
        return cls._event(EventKind(kind), values)

    @classmethod
    def _event(cls, kind: EventKind, values: Row) -> "Input":
        subject = {EventKind.AGENT_JOINS: "agent", EventKind.TASK_APPEARS: "task"}.get(kind)
        whole = None if subject is None else values.get(subject)
        if not isinstance(whole, Mapping):
            return cls(Event(kind=kind, **values))  # type: ignore[arg-type]  # which it checks
        if not isinstance(whole.get("id"), str):
            raise InputError(f"must be a non-empty string, got {shown(whole.get('id'))}", f"{subject}.id")
        event = Event(kind=kind, **{**values, str(subject): whole["id"]})
        return cls(event, dict(whole))

    def to_dict(self) -> Row:
        """Return the input as in a JSON line."""
        fields = self.said.to_dict()
        if self.whole is not None:
            fields["agent" if "agent" in fields else "task"] = self.whole
        return fields
