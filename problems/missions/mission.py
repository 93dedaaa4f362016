"""Definition of a mission: agents, tasks, and events over time."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from alloc.problems import fields
from alloc.problems.arguments import checked_seed, choice, listed, of_type, real
from alloc.problems.errors import InputError
from alloc.problems.fields import FloatArray
from alloc.problems.instance import Instance
from alloc.problems.missions.events import LATEST, Event, EventKind, check_references, check_sequence
from alloc.problems.missions.radio import Pace, Radio
from alloc.problems.vocabulary import Knowledge

PATIENCE = 2.0
"""A mission without a horizon lasts this many times the hours that the weakest agent needs for all tasks."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Mission(fields.ReadOnly):
    """An instance at hour 0, and events over time; validated once and read-only from then on.

    The instance holds all agents and tasks of the mission; `joins` and `appears` say from which hour on. At equal
    hours, agents join and tasks appear by these arrays first, then `events` happen in the given order.

    Parameters
    ----------
    instance : Instance
    joins : array_like, shape (n,), optional
        Hour at which each agent joins; NaN for 0, or for the hour of its event.
    appears : array_like, shape (m,), optional
        Hour at which each task appears; NaN as for `joins`.
    deadline : array_like, shape (m,), optional
        Hour after which a task can no longer be worked on; NaN or ``inf`` for none.
    growth : array_like, shape (m,), optional
        Work added per hour until an agent first works there, >= 0.
    events : iterable of Event
    horizon : float
        Hour at which the mission ends, > 0; see `end` for the meaning of ``inf``.
    knowledge : {"full", "local"}
        What agents know.
    sensing : float
        Sensing radius, within which an agent sees tasks and agents, >= 0; ``inf`` for all.
    radio : Radio, optional
    pace : Pace, optional
    seed : int
        Seed of pace and radio, which are the same for all policies, from 0 to 2^63 - 1.

    Raises
    ------
    InputError
        If a value breaks one of these rules, or an event cannot happen.
    """

    instance: Instance
    joins: FloatArray
    appears: FloatArray
    deadline: FloatArray
    growth: FloatArray
    events: tuple[Event, ...]
    horizon: float
    knowledge: Knowledge
    sensing: float
    radio: Radio
    pace: Pace | None
    seed: int

    def __init__(
        self,
        instance: Instance,
        *,
        joins: ArrayLike | None = None,
        appears: ArrayLike | None = None,
        deadline: ArrayLike | None = None,
        growth: ArrayLike | None = None,
        events: Iterable[Event] = (),
        horizon: float = math.inf,
        knowledge: Knowledge | str = Knowledge.FULL,
        sensing: float = math.inf,
        radio: Radio | None = None,
        pace: Pace | None = None,
        seed: int = 0,
    ) -> None:
        of_type(instance, Instance, "instance")
        given = tuple(of_type(one, Event, "events") for one in listed(events, "events", "Event"))
        check_references(given, instance.agent_index, instance.task_index)
        n, m = instance.n, instance.m
        values: dict[str, object] = {
            "instance": instance,
            "joins": _hours(joins, instance.agent_ids, "agents[{}].joins", given, EventKind.AGENT_JOINS),
            "appears": _hours(appears, instance.task_ids, "tasks[{}].appears", given, EventKind.TASK_APPEARS),
            "deadline": fields.limits(deadline, "deadline", m),
            "growth": np.zeros(m) if growth is None else np.nan_to_num(fields.vector(growth, "growth", m), posinf=-1),
            "events": given,
            "horizon": math.inf if horizon == math.inf else float(real(horizon, "horizon", 0, LATEST, above=True)),
            "knowledge": choice(Knowledge, knowledge, "knowledge"),
            "sensing": math.inf if sensing == math.inf else float(real(sensing, "sensing")),
            "radio": Radio() if radio is None else of_type(radio, Radio, "radio"),
            "pace": None if pace is None else of_type(pace, Pace, "pace"),
            "seed": checked_seed(seed),
        }
        assert len(instance.ability) == n
        for key, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, key, value)
        self._check()

    @classmethod
    def from_instance(cls, instance: Instance) -> "Mission":
        """Return the mission with all agents and tasks of an instance from hour 0, full knowledge and no events.

        Parameters
        ----------
        instance : Instance
        """
        return cls(instance)

    def _check(self) -> None:
        _require(self.growth, (self.growth >= 0) & (self.growth <= LATEST), "tasks[{}].growth", "a finite number >= 0")
        late = self.deadline > self.appears
        _require(self.deadline, late, "tasks[{}].deadline", "after the hour at which the task appears")
        if self.instance.distances is not None and self.instance.returns.any():
            row = int(np.argmax(self.instance.returns))
            message = "cannot be combined with own distances: an agent that stops on the way has no distance home"
            raise InputError(message, f"agents[{row}].returns")
        check_sequence(self._numbered_timeline)

    def __repr__(self) -> str:
        return f"Mission(name={self.name!r}, n={self.instance.n}, m={self.instance.m}, events={len(self.events)})"

    @property
    def name(self) -> str:
        """Name of the instance."""
        return self.instance.name

    @cached_property
    def timeline(self) -> tuple[Event, ...]:
        """All events in order, including agents that join and tasks that appear."""
        return tuple(event for _, event in self._numbered_timeline)

    @property
    def _numbered_timeline(self) -> list[tuple[int, Event]]:
        """The timeline, with the number of each event in `events`, or -1."""
        begun = [
            *_beginnings(EventKind.AGENT_JOINS, self.instance.agent_ids, self.joins, self.events),
            *_beginnings(EventKind.TASK_APPEARS, self.instance.task_ids, self.appears, self.events),
        ]
        numbered = [*((-1, event) for event in begun), *enumerate(self.events)]
        return sorted(numbered, key=lambda entry: entry[1].hour)

    @cached_property
    def end(self) -> float:
        """Latest hour at which the mission ends.

        The horizon; without one, the last event plus twice the time in which the weakest agent could do all tasks one
        after another.
        """
        if self.horizon < math.inf:
            return self.horizon
        instance, slowest = self.instance, float(self.instance.speed.min())
        last = max(0.0, *(event.hour for event in self.timeline))
        with np.errstate(over="ignore", invalid="ignore"):
            work = instance.workload + self.growth * (last + 1)
            weakest = float(instance.ability.min()) * (self.pace.low or self.pace.high if self.pace else 1.0)
            longest = 0.0 if slowest == math.inf else self.longest_flight / slowest
            return float(min(last + PATIENCE * (work.sum() / weakest + instance.m * longest) + 1, LATEST))

    @cached_property
    def longest_flight(self) -> float:
        """Upper bound on the length of flights between agents' starts and tasks."""
        low, high = self.area
        if self.instance.metric == "geographic":
            from alloc.problems.distances.geodesic import METRES
            from alloc.problems.distances.geometry import LONGEST_GEODESIC_M

            return (LONGEST_GEODESIC_M + high[2] - low[2]) / METRES[self.instance.distance_unit]
        table = self.instance.distances
        given = 0.0 if table is None or not len(table.distance) else float(table.distance.max())
        return max(given, sum(end - begin for begin, end in zip(low, high, strict=True)))

    @cached_property
    def area(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Smallest and largest coordinates of all places of agents and tasks, which all agents know."""
        places = np.concatenate([self.instance.start_position, self.instance.task_position])
        places = places[~np.isnan(places[:, 0])]
        if not len(places):
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        return tuple(places.min(axis=0).tolist()), tuple(places.max(axis=0).tolist())


def _beginnings(kind: EventKind, ids: Sequence[str], hours: FloatArray, events: Sequence[Event]) -> list[Event]:
    """Return events for agents that join, or tasks that appear, without an explicit event."""
    own = {_subject(event) for event in events if event.kind is kind}
    make: Callable[[float, str], Event] = (
        (lambda hour, name: Event(hour, kind, agent=name))
        if kind is EventKind.AGENT_JOINS
        else (lambda hour, name: Event(hour, kind, task=name))
    )
    return [make(hour, name) for name, hour in zip(ids, hours.tolist(), strict=True) if name not in own]


def _subject(event: Event) -> str | None:
    return event.task if event.agent is None else event.agent


def _hours(
    given: ArrayLike | None, ids: Sequence[str], place: str, events: Sequence[Event], kind: EventKind
) -> FloatArray:
    """Return the hour at which each agent joins or each task appears, from its event if it has one."""
    hours = np.full(len(ids), np.nan) if given is None else fields.vector(given, place.partition("}].")[2], len(ids))
    index = {name: row for row, name in enumerate(ids)}
    for event in events:
        if event.kind is kind:
            row = index[str(_subject(event))]
            if not np.isnan(hours[row]) and hours[row] != event.hour:
                message = f"is hour {hours[row]:g}, but an event says {event.hour:g}; remove one of them"
                raise InputError(message, place.format(row))
            hours[row] = event.hour
    hours[np.isnan(hours)] = 0.0
    _require(hours, (hours >= 0) & (hours <= LATEST), place, "a finite number >= 0")
    return hours


def _require(values: FloatArray, good: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], place: str, rule: str) -> None:
    if not good.all():
        row = int(np.argmin(good))
        raise InputError(f"must be {rule}, got {values[row]:g}", place.format(row))
