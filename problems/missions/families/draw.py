"""Generation of random missions: positions, workloads and events."""

from dataclasses import dataclass

import numpy as np

from alloc.problems.arguments import checked_seed, of_type
from alloc.problems.changes.remove import replaced
from alloc.problems.errors import InputError
from alloc.problems.fields import BoolArray
from alloc.problems.generate.paper_scenarios import paper
from alloc.problems.instance import FloatArray, Instance
from alloc.problems.missions.events import Event, EventKind
from alloc.problems.missions.families.parameters import MissionParameters
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Radio
from alloc.problems.vocabulary import MissionFamily

AGENTS, TASKS = 20, 40
SPEED = 0.5
ENERGY_PER_DISTANCE = 6.0
BATTERY, SMALL_BATTERY = 40.0, 10.0
WAVES = (0.3, 0.7, 1.1)
"""Hours at which waves of tasks appear, relative to the ideal mission time."""
SPOTS, SPREAD = 3, 0.06
"""Number of hot spots, and standard deviation of the tasks' positions around them."""
PAPER = {MissionFamily.PAPER_1: 1, MissionFamily.PAPER_2: 2, MissionFamily.PAPER_3: 3, MissionFamily.PAPER_4: 4}


@dataclass
class _Draft:
    """A mission under construction.

    Attributes
    ----------
    ideal : float
        Hours that all agents together would need for all work if flights took no time: the time unit of a family.
    """

    place: FloatArray
    workload: FloatArray
    appears: FloatArray
    deadline: FloatArray
    growth: FloatArray
    joins: FloatArray
    battery: FloatArray
    events: list[Event]
    ideal: float


def random_mission(parameters: MissionParameters, seed: int, *, name: str | None = None) -> Mission:
    """Return a random mission, reproducible by its seed.

    Parameters
    ----------
    parameters : MissionParameters
    seed : int
        Seed of all random numbers, >= 0.
    name : str, optional

    Raises
    ------
    InputError
        If the seed is invalid, or sizes are given for a scenario of the paper, which fixes them.
    """
    of_type(parameters, MissionParameters, "parameters")
    number = checked_seed(seed)
    rng = np.random.default_rng(number)
    family = MissionFamily(parameters.family)
    called = name if name is not None else f"mission-{family}-seed-{number}"
    radio = Radio(radius=parameters.radius, loss=parameters.loss)
    if family in PAPER:
        mission = _paper(parameters, PAPER[family], number, called, rng)
    else:
        mission = _drawn(parameters, family, called, rng)
    return Mission(
        mission.instance,
        **{field: getattr(mission, field) for field in ("joins", "appears", "deadline", "growth", "events", "horizon")},
        knowledge=parameters.knowledge,
        sensing=parameters.sensing,
        radio=radio,
        seed=number,
    )


def _drawn(parameters: MissionParameters, family: MissionFamily, name: str, rng: np.random.Generator) -> Mission:
    n, m = parameters.agents or AGENTS, parameters.tasks or TASKS
    ability = rng.integers(1, 11, n).astype(np.float64)
    start = rng.random((n, 2))
    workload = np.round(rng.uniform(5, 60, m), 2)
    ideal = float(workload.sum() / ability.sum())
    later = np.arange(m) >= (m + 1) // 2
    draft = _Draft(
        place=rng.random((m, 2)),
        workload=workload,
        appears=np.where(later, rng.uniform(0, 1.2 * ideal, m), 0.0),
        deadline=np.full(m, np.inf),
        growth=np.zeros(m),
        joins=np.zeros(n),
        battery=np.full(n, BATTERY),
        events=[],
        ideal=ideal,
    )
    _CHANGES[family](draft, later, rng)
    instance = Instance(
        name=name,
        ability=ability,
        workload=draft.workload,
        agent_position=start,
        task_position=draft.place,
        battery=draft.battery,
        speed=np.full(n, SPEED),
        energy_per_distance=ENERGY_PER_DISTANCE,
    )
    fields = {field: getattr(draft, field) for field in ("joins", "appears", "deadline", "growth", "events")}
    return Mission(instance, **fields, horizon=float(np.ceil(6 * ideal + 6)))


def _steady(draft: _Draft, later: BoolArray, rng: np.random.Generator) -> None:
    """Leave the draft unchanged."""


def _waves(draft: _Draft, later: BoolArray, rng: np.random.Generator) -> None:
    wave = np.array(WAVES)[rng.integers(0, len(WAVES), len(later))]
    draft.appears = np.where(later, draft.ideal * (wave + rng.uniform(0, 0.05, len(later))), 0.0)


def _hot_spots(draft: _Draft, later: BoolArray, rng: np.random.Generator) -> None:
    spot = np.minimum((draft.appears / (1.2 * draft.ideal) * SPOTS).astype(np.intp), SPOTS - 1)
    near = rng.random((SPOTS, 2))[spot] + rng.normal(0, SPREAD, draft.place.shape)
    draft.place = np.where(later[:, None], np.clip(near, 0, 1), draft.place)


def _failures(draft: _Draft, later: BoolArray, rng: np.random.Generator) -> None:
    for agent in _some(len(draft.joins), 0.2, rng):
        hour = float(rng.uniform(0.05, 1.2) * draft.ideal)
        draft.events.append(Event(hour, EventKind.AGENT_FAILS, agent=f"a{agent + 1}"))


def _recharging(draft: _Draft, later: BoolArray, rng: np.random.Generator) -> None:
    n = len(draft.joins)
    order, share = rng.permutation(n).tolist(), max(1, n // 5)
    late = [] if n == 1 else order[:share]
    draft.joins[late] = rng.uniform(0.1, 0.6, len(late)) * draft.ideal
    for agent in order[share : 2 * share]:
        hour = float(rng.uniform(0.2, 0.6) * draft.ideal)
        back = hour + float(rng.uniform(0.1, 0.3) * draft.ideal)
        draft.events += [
            Event(hour, EventKind.AGENT_RECALLED, agent=f"a{agent + 1}"),
            Event(back, EventKind.AGENT_RECHARGES, agent=f"a{agent + 1}", amount=SMALL_BATTERY),
            Event(back, EventKind.AGENT_RETURNS, agent=f"a{agent + 1}"),
        ]
    draft.battery[:] = SMALL_BATTERY
    for agent in range(n):
        for part in (0.8, 1.6, 2.4):
            hour = float((part + rng.uniform(0, 0.2)) * draft.ideal)
            draft.events.append(Event(hour, EventKind.AGENT_RECHARGES, agent=f"a{agent + 1}", amount=SMALL_BATTERY))


def _growth(draft: _Draft, later: BoolArray, rng: np.random.Generator) -> None:
    draft.growth = rng.uniform(0, 0.5, len(later)) * draft.workload / draft.ideal


def _deadlines(draft: _Draft, later: BoolArray, rng: np.random.Generator) -> None:
    given = rng.random(len(later)) < 0.8
    hours = rng.uniform(0.5, 2.0, len(later)) * draft.ideal + 1
    draft.deadline = np.where(given, draft.appears + hours, np.inf)


def _silence(draft: _Draft, later: BoolArray, rng: np.random.Generator) -> None:
    for agent in _some(len(draft.joins), 0.2, rng):
        hour = float(rng.uniform(0, 0.8) * draft.ideal)
        until = hour + float(rng.uniform(0.2, 0.6) * draft.ideal)
        draft.events.append(Event(hour, EventKind.RADIO_SILENT, agent=f"a{agent + 1}", until=until))
    hour, (x, y) = float(rng.uniform(0, 0.6) * draft.ideal), rng.random(2).tolist()
    until = hour + 0.5 * draft.ideal
    draft.events.append(Event(hour, EventKind.RADIO_SILENT, center=(x, y, 0.0), radius=0.3, until=until))


_CHANGES = {
    MissionFamily.STEADY: _steady,
    MissionFamily.WAVES: _waves,
    MissionFamily.HOT_SPOTS: _hot_spots,
    MissionFamily.FAILURES: _failures,
    MissionFamily.RECHARGING: _recharging,
    MissionFamily.GROWTH: _growth,
    MissionFamily.DEADLINES: _deadlines,
    MissionFamily.SILENCE: _silence,
}
"""Change that each family makes to the draft."""


def _paper(parameters: MissionParameters, scenario: int, seed: int, name: str, rng: np.random.Generator) -> Mission:
    """Return a scenario of the paper as a mission; speed, emergence and failures are ours."""
    for field in ("agents", "tasks"):
        if getattr(parameters, field) is not None:
            raise InputError(f"is fixed by scenario {scenario} of the paper", field)
    still = paper(scenario, seed)
    instance = replaced(still, name=name, speed=np.full(still.n, SPEED))
    appears = np.zeros(instance.m)
    emerging = _some(instance.m, 0.3, rng)
    appears[emerging] = rng.uniform(0, 1, len(emerging))
    failing = _some(instance.n, 0.2, rng)
    hours = rng.uniform(0.05, 1.2, len(failing)).tolist()
    events = [
        Event(hour, EventKind.AGENT_FAILS, agent=f"a{agent + 1}") for agent, hour in zip(failing, hours, strict=True)
    ]
    return Mission(instance, appears=appears, events=events, horizon=24.0)


def _some(count: int, share: float, rng: np.random.Generator) -> list[int]:
    """Return a random share of the indices below `count`, but never all of them."""
    order: list[int] = rng.permutation(count).tolist()
    return order[: min(round(share * count), count - 1)]
