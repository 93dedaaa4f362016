"""Exogenous events of a mission, and checks that their sequence is consistent."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from alloc.problems.arguments import choice, real, shown, text
from alloc.problems.changes.move import position
from alloc.problems.errors import InputError, nearest

LATEST = 1e60
"""Largest hour of an event."""


class EventKind(StrEnum):
    """Kinds of events."""

    AGENT_JOINS = "agent-joins"
    AGENT_FAILS = "agent-fails"
    AGENT_RECALLED = "agent-recalled"
    AGENT_RETURNS = "agent-returns"
    AGENT_RECHARGES = "agent-recharges"
    TASK_APPEARS = "task-appears"
    TASK_CANCELLED = "task-cancelled"
    TASK_CHANGES = "task-changes"
    RADIO_SILENT = "radio-silent"


_OF_AGENT, _OF_TASK = ("agent",), ("task",)

FIELDS: Mapping[EventKind, tuple[str, ...]] = {
    EventKind.AGENT_JOINS: _OF_AGENT,
    EventKind.AGENT_FAILS: _OF_AGENT,
    EventKind.AGENT_RECALLED: _OF_AGENT,
    EventKind.AGENT_RETURNS: _OF_AGENT,
    EventKind.AGENT_RECHARGES: ("agent", "amount"),
    EventKind.TASK_APPEARS: _OF_TASK,
    EventKind.TASK_CANCELLED: _OF_TASK,
    EventKind.TASK_CHANGES: ("task", "workload"),
    EventKind.RADIO_SILENT: ("agent", "center", "radius", "until"),
}
"""Fields of each kind besides the hour; a silence has either an agent, or a center and a radius."""


@dataclass(frozen=True)
class Event:
    """One event of a mission.

    Attributes
    ----------
    hour : float
    kind : EventKind or str
    agent, task : str or None
        Id of the agent or task concerned.
    amount : float or None
        Energy added to the agent's battery.
    workload : float or None
        Work left of the task from then on.
    center : tuple of float, or None
        Three coordinates of the centre of the region in which no radio works.
    radius : float or None
    until : float or None
        Hour at which a silence ends.

    Raises
    ------
    InputError
        If a value is invalid, or the kind of event does not have the field; the error's ``place`` is the field.
    """

    hour: float
    kind: EventKind
    agent: str | None = None
    task: str | None = None
    amount: float | None = None
    workload: float | None = None
    center: tuple[float, ...] | None = None
    radius: float | None = None
    until: float | None = None

    def __post_init__(self) -> None:
        self._set("hour", float(real(self.hour, "hour", 0, LATEST)))
        self._set("kind", choice(EventKind, self.kind, "event"))
        fields = FIELDS[self.kind]
        for name in ("agent", "task", "amount", "workload", "center", "radius", "until"):
            value = getattr(self, name)
            if value is not None and name not in fields:
                raise InputError(f"is no field of {self.kind!s}", name)
            if value is None and name in fields and not (self.kind is EventKind.RADIO_SILENT and name != "until"):
                raise InputError(f"is missing; {self.kind!s} needs it", name)
            if value is not None:
                self._set(name, _checked(name, value))
        if self.kind is EventKind.RADIO_SILENT:
            self._check_silence()

    def _check_silence(self) -> None:
        if self.agent is not None and (self.center is not None or self.radius is not None):
            raise InputError("is about an agent or about a region; give either, not both", "agent")
        if self.agent is None and (self.center is None or self.radius is None):
            raise InputError("is missing; a silence needs an agent, or a center and a radius", "agent")
        assert self.until is not None
        if self.until < self.hour:
            raise InputError(f"must not be before the silence begins at {self.hour:g}, got {self.until:g}", "until")

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def to_dict(self) -> dict[str, object]:
        """Return the event as in a mission file."""
        fields: dict[str, object] = {"hour": self.hour, "event": str(self.kind)}
        for name in FIELDS[self.kind]:
            value = getattr(self, name)
            if value is not None:
                fields[name] = list(value) if isinstance(value, tuple) else value
        return fields


def _checked(name: str, value: object) -> object:
    if name in ("agent", "task"):
        return text(value, name)
    if name == "center":
        try:
            place = tuple(position(value))
        except InputError as error:
            raise InputError(error.message, "center") from error
        if not all(math.isfinite(axis) for axis in place):
            raise InputError(f"must be finite numbers, got {shown(value)}", "center")
        return place
    return float(real(value, name, 0, LATEST))


def check_references(events: Iterable[Event], agents: Mapping[str, int], tasks: Mapping[str, int]) -> None:
    """Raise `InputError` for the first event about an unknown agent or task."""
    for number, event in enumerate(events):
        for kind, name, known in (("agent", event.agent, agents), ("task", event.task, tasks)):
            if name is not None and name not in known:
                message = f"there is no {kind} {shown(name)}{nearest(name, tuple(known))}"
                raise InputError(message, f"events[{number}].{kind}")


BEFORE = {
    EventKind.AGENT_JOINS: ({"absent"}, "in the mission"),
    EventKind.AGENT_FAILS: ({"in the mission", "away"}, "failed"),
    EventKind.AGENT_RECALLED: ({"in the mission"}, "away"),
    EventKind.AGENT_RETURNS: ({"away"}, "in the mission"),
    EventKind.AGENT_RECHARGES: ({"in the mission", "away"}, None),
    EventKind.TASK_APPEARS: ({"to come"}, "there"),
    EventKind.TASK_CANCELLED: ({"there"}, "cancelled"),
    EventKind.TASK_CHANGES: ({"there"}, None),
}
"""States of an agent or a task in which an event can happen, and the state after it; None: unchanged."""


def check_sequence(timeline: Iterable[tuple[int, Event]]) -> None:
    """Raise `InputError` for the first event that cannot happen, such as the return of an agent that is not away.

    Parameters
    ----------
    timeline : iterable of (int, Event)
        In chronological order; the number of each event in the file, -1 if it stems from a field of an agent or task.
    """
    now: dict[tuple[str, str | None], str] = {}
    for number, event in timeline:
        if event.kind not in BEFORE:
            continue
        kind, name = ("agent", event.agent) if event.agent is not None else ("task", event.task)
        allowed, then = BEFORE[event.kind]
        was = now.get((kind, name), "absent" if kind == "agent" else "to come")
        if was not in allowed:
            must = " or ".join(sorted(allowed))
            message = f"{event.kind!s} at hour {event.hour:g} needs {kind} {shown(name)} to be {must}, but it is {was}"
            raise InputError(message, f"events[{number}]" if number >= 0 else kind)
        now[kind, name] = then or was
