"""What a planner is told: the events of missions, and reports of agents."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from alloc.problems.arguments import of_type, real, shown, text
from alloc.problems.changes.move import position
from alloc.problems.errors import InputError, nearest
from alloc.problems.formats.json_columns import Row, require_known
from alloc.problems.missions.events import FIELDS, LATEST, Event, EventKind

AGENT_REPORTS = "agent-reports"
"""The kind of input that missions do not have, as it depends on what agents were ordered to do."""

REPORT_FIELDS = ("agent", "position", "task", "battery")


@dataclass(frozen=True)
class Report:
    """Where an agent is and what its battery holds, as it says itself.

    Attributes
    ----------
    hour : float
    agent : str
        Its id.
    position : tuple of float, or None
        Two or three coordinates of the place where it is.
    task : str or None
        Id of the task where it is, instead of coordinates.
    battery : float or None
        Energy that is left.

    Raises
    ------
    InputError
        If a value is wrong, or it says nothing.
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
            raise InputError("says where the agent is, as does position; give one of them", "task")
        if (self.position, self.task, self.battery) == (None, None, None):
            raise InputError("says nothing; give position or task, battery, or both", "agent")

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def to_dict(self) -> Row:
        """Return the report as a line of JSON has it."""
        fields: Row = {"hour": self.hour, "event": AGENT_REPORTS}
        for name in REPORT_FIELDS:
            value = getattr(self, name)
            if value is not None:
                fields[name] = list(value) if isinstance(value, tuple) else value
        return fields


@dataclass(frozen=True)
class Input:
    """Something that a planner was told.

    Attributes
    ----------
    said : Event or Report
    whole : dict or None
        The fields of an agent or a task that comes with its event.
    """

    said: Event | Report
    whole: Row | None = None

    @classmethod
    def of(cls, given: object, now: float) -> "Input":
        """Return what was said by an event, a report, or the fields of one.

        Parameters
        ----------
        given : Event, Report or mapping
        now : float
            Hour of what has none.

        Raises
        ------
        InputError
            If it is none of these, a field is unknown or missing, or a value is wrong.
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
        """Return it as a line of JSON has it."""
        fields = self.said.to_dict()
        if self.whole is not None:
            fields["agent" if "agent" in fields else "task"] = self.whole
        return fields
