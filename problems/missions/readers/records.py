"""Conversion of records of calls or fires into a mission: each is a task that appears at its hour."""

from collections import Counter
from dataclasses import dataclass, field
from datetime import datetime, time, timedelta

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.fields import FloatArray
from alloc.problems.instance import Instance
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.readers.options import RecordOptions
from alloc.problems.units import Units

AGENTS = 10

HOUR = timedelta(hours=1)


@dataclass(frozen=True)
class Record:
    """One call, or one fire.

    Attributes
    ----------
    id : str
    when : datetime
    place : tuple of two floats
        Coordinates in km.
    work : float
    district : str
        District, used to place the agents; empty if the source has none.
    """

    id: str
    when: datetime
    place: tuple[float, float]
    work: float
    district: str = ""


@dataclass
class Records:
    """All records of a file.

    Attributes
    ----------
    source : str
        Name of the file in messages.
    work : str
        Unit of work.
    speed : float
        Default speed of agents in km per hour.
    records : list of Record
    notes : list of str
        Remarks on what was left out or filled in.
    vehicles : list of str
        Names of the agents; empty if there is no file of the fleet.
    """

    source: str
    work: str
    speed: float
    records: list[Record] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    vehicles: list[str] = field(default_factory=list)


def mission_of_records(found: Records, options: RecordOptions, name: str, seed: int) -> Mission:
    """Return the mission of the selected records.

    Parameters
    ----------
    found : Records
    options : RecordOptions
    name : str
    seed : int
        Seed of the agents' starts, which are drawn if the records have no districts.

    Raises
    ------
    InputError
        If there is no record in the selected days.
    """
    kept = sorted((one for one in found.records if _is_wanted(one, options)), key=lambda one: one.when)
    if not kept:
        raise InputError("has no record in the selected days", source=found.source)
    begin = kept[0].when if options.first is None else datetime.combine(options.first, time())
    vehicles = _vehicles(found, options)
    places = np.array([one.place for one in kept])
    instance = Instance(
        name=name,
        agent_ids=vehicles,
        ability=np.full(len(vehicles), options.ability),
        agent_position=_starts(kept, places, len(vehicles), np.random.default_rng(seed)),
        speed=np.full(len(vehicles), found.speed if options.speed is None else options.speed),
        task_ids=_ids(kept),
        workload=[one.work for one in kept],
        task_position=places,
        units=Units(time="h", distance="km", work=found.work),
    )
    appears = [(one.when - begin) / HOUR / options.compress for one in kept]
    return Mission(instance, appears=appears, seed=seed)


def _is_wanted(record: Record, options: RecordOptions) -> bool:
    day = record.when.date()
    return (options.first is None or options.first <= day) and (options.last is None or day <= options.last)


def _vehicles(found: Records, options: RecordOptions) -> list[str]:
    if not found.vehicles:
        return [f"a{number + 1}" for number in range(options.agents or AGENTS)]
    if options.agents is not None and options.agents > len(found.vehicles):
        raise InputError(f"must be at most {len(found.vehicles)}, the vehicles in the list of the fleet", "agents")
    return found.vehicles[: options.agents]


def _starts(kept: list[Record], places: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Return the agents' starts: centroids of districts, those with most records first, or random places of records."""
    districts = [name for name, _ in Counter(one.district for one in kept).most_common() if name]
    if not districts:
        return places[rng.choice(len(places), count, replace=len(places) < count)]
    middle = {name: places[[one.district == name for one in kept]].mean(axis=0) for name in districts[:count]}
    return np.array([middle[districts[agent % len(districts)]] for agent in range(count)])


def _ids(kept: list[Record]) -> list[str]:
    """Return the ids of the records, with a number appended to repeated ones."""
    ids: dict[str, None] = {}
    for one in kept:
        name, number = one.id, 1
        while name in ids:
            number += 1
            name = f"{one.id}-{number}"
        ids[name] = None
    return list(ids)
