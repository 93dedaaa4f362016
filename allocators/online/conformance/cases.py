"""Small missions for the conformance tests, and pairs that differ only in what no agent can know yet."""

from functools import cache

import numpy as np

from alloc.problems import Event, Instance, Mission, MissionParameters, Radio, random_mission
from alloc.problems.missions.events import EventKind
from alloc.problems.vocabulary import Knowledge, MissionFamily

FAMILIES = (MissionFamily.STEADY, MissionFamily.RECHARGING, MissionFamily.DEADLINES, MissionFamily.SILENCE)

CHANGE = 2.0
"""Hour from which the missions of a pair differ."""

HIDDEN_UNTIL = 1.5
"""Hour before which no agent can have seen or heard of the task in which the missions of a pair differ."""


@cache
def case(family: MissionFamily, knowledge: Knowledge) -> Mission:
    """Return a mission of 3 agents and 5 tasks."""
    parameters = MissionParameters(family=family, agents=3, tasks=5, knowledge=knowledge, radius=0.5, sensing=0.6)
    return random_mission(parameters, seed=4)


def short_of_energy(knowledge: Knowledge, horizon: float = 8.0) -> Mission:
    """Return a mission in which agents see all tasks, but their batteries last only for the nearest ones."""
    instance = _instance((0.9, 0.9), 3.0, battery=2.0)
    return Mission(instance, knowledge=knowledge, horizon=horizon, seed=3)


def _instance(last: tuple[float, float], workload: float, battery: float = 30.0) -> Instance:
    places: list[tuple[float, float]] = [(0, 0), (0.1, 0.2), (0.3, 0.1), (0.2, 0.4), (1, 1), last]
    return Instance(
        ability=[1, 2, 3],
        workload=[2, 3, 4, 2, 3, workload],
        agent_position=[[0.1, 0.1], [0.2, 0.1], [0.1, 0.3]],
        task_position=places,
        speed=[0.4, 0.4, 0.4],
        battery=[battery] * 3,
        energy_per_distance=6.0,
    )


def _mission(instance: Instance, knowledge: Knowledge, **fields: object) -> Mission:
    radio = Radio(radius=0.4, period=0.25, loss=0.2)
    return Mission(instance, knowledge=knowledge, sensing=0.2, radio=radio, horizon=12.0, seed=3, **fields)  # type: ignore[arg-type]


def futures(knowledge: Knowledge) -> tuple[Mission, Mission]:
    """Return two missions that are identical up to `CHANGE`; afterwards tasks, workloads and failures differ."""
    appears = np.array([0, 0, 0, 0, 0, CHANGE])
    calm = _mission(_instance((0.9, 0.2), 5), knowledge, appears=appears)
    events = [
        Event(CHANGE, EventKind.AGENT_FAILS, agent="a1"),
        Event(CHANGE, EventKind.TASK_CHANGES, task="t5", workload=30),
    ]
    return calm, _mission(_instance((0.2, 0.9), 1), knowledge, appears=appears, events=events)


def hidden() -> tuple[Mission, Mission]:
    """Return two missions with local knowledge that differ only in a task far from all agents."""
    return tuple(_mission(_instance((0.9, 0.9), work), Knowledge.LOCAL) for work in (1.0, 40.0))  # type: ignore[return-value]
