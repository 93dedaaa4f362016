"""The compiled simulation agrees with the reference, event by event."""

import dataclasses
import math
import random

import numpy as np
import pytest

from alloc.allocators.missions.advance import advance
from alloc.allocators.missions.layout import MESSAGES, NOBODY, ORDERS, OVER, STAY, TO_PLACE, TO_TASK, MissionArrays
from alloc.allocators.missions.orders import order
from alloc.allocators.missions.pack import begun, measure, pack
from alloc.allocators.missions.reports import NOTHING
from alloc.problems.instance import Instance
from alloc.problems.missions.events import Event, EventKind
from alloc.problems.missions.families.draw import random_mission as generated
from alloc.problems.missions.families.parameters import MissionParameters
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Burst, Pace, Radio
from alloc.problems.missions.simulation.agenda import Wanted
from alloc.problems.missions.simulation.measures import DecisionTimes, MissionResult, measured
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import AgentStatus, Order, TaskStatus
from alloc.problems.vocabulary import Knowledge

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]  # loops are compiled first: half a minute, more under load

TASK_STATUS = tuple(TaskStatus)
AGENT_STATUS = tuple(AgentStatus)


def random_events(rng: random.Random, n: int, m: int) -> list[Event]:
    """Return events of all kinds in a feasible order."""
    events = []
    for agent in map("a{}".format, range(1, n + 1)):
        if rng.random() < 0.3:
            events.append(Event(rng.uniform(0.5, 6), EventKind.AGENT_RECHARGES, agent=agent, amount=rng.uniform(0, 3)))
        if rng.random() < 0.3:
            out = rng.uniform(0.5, 4)
            events.append(Event(out, EventKind.AGENT_RECALLED, agent=agent))
            if rng.random() < 0.8:
                events.append(Event(out + rng.choice([0, 0.1, 1.7]), EventKind.AGENT_RETURNS, agent=agent))
        if rng.random() < 0.2:
            events.append(Event(rng.uniform(6, 8), EventKind.AGENT_FAILS, agent=agent))
        if rng.random() < 0.2:
            begin = rng.uniform(0, 4)
            events.append(Event(begin, EventKind.RADIO_SILENT, agent=agent, until=begin + rng.uniform(0, 2)))
    for task in map("t{}".format, range(1, m + 1)):
        if rng.random() < 0.4:
            work = rng.choice([0.0, 1.0, 5.0, 12.5])
            events.append(Event(rng.uniform(1.5, 6), EventKind.TASK_CHANGES, task=task, workload=work))
        if rng.random() < 0.15:
            events.append(Event(rng.uniform(6, 8), EventKind.TASK_CANCELLED, task=task))
    if rng.random() < 0.3:
        events.append(Event(1.0, EventKind.RADIO_SILENT, center=(0.5, 0.5, 0.0), radius=0.4, until=3.0))
    return events


def random_radio(rng: random.Random) -> Radio:
    """Return a random radio."""
    burst = Burst(rng.uniform(0.1, 2), rng.uniform(0.1, 2), rng.uniform(0, 0.3), rng.uniform(0.5, 1))
    return Radio(
        radius=rng.choice([0.3, 0.6, math.inf, 0.0]),
        period=rng.choice([0.1, 0.25, 0.37]),
        loss=rng.choice([0.0, 0.2, 0.8]),
        delay=rng.choice([0.0, 0.0, 0.05, 0.31]),
        burst=burst if rng.random() < 0.3 else None,
    )


def random_mission(seed: int) -> Mission:
    """Return a small random mission with all features that the compiled simulation supports."""
    rng = random.Random(seed)
    n, m = rng.randint(1, 5), rng.randint(1, 6)
    joins = [rng.choice([0.0, 0.0, rng.uniform(0, 0.4)]) for _ in range(n)]
    appears = [rng.choice([0.0, 0.0, rng.uniform(0, 1.4)]) for _ in range(m)]
    grid = rng.random() < 0.3
    place = (
        (lambda: (float(rng.randint(0, 4)), float(rng.randint(0, 4))))
        if grid
        else (lambda: (rng.random(), rng.random()))
    )
    known = rng.random() < 0.9
    returns = [rng.random() < 0.3 for _ in range(n)]
    instance = Instance(
        ability=[rng.choice([1.0, 2.0, rng.uniform(0.5, 4)]) for _ in range(n)],
        workload=[rng.choice([0.0, rng.uniform(1, 9), rng.uniform(1, 9)]) for _ in range(m)],
        agent_position=[place() for _ in range(n)],
        task_position=[place() for _ in range(m)] if known else None,
        speed=[rng.choice([0.5, 1.0, math.inf, rng.uniform(0.3, 2)]) for _ in range(n)],
        battery=[rng.choice([math.inf, rng.uniform(2, 20)]) for _ in range(n)],
        communication_range=[rng.choice([math.inf, math.inf, 0.7]) for _ in range(n)],
        energy_per_distance=6.0,
        returns=returns,
        return_base=[rng.choice([-1, 0, 1]) if one else -1 for one in returns],
        bases={"dock": place(), "yard": place()},
        priority=[rng.choice([0.0, 1.0, 3.0]) for _ in range(m)],
        skills=[rng.choice([["x"], ["x", "y"]]) for _ in range(n)],
        needs=[rng.choice([[], [], ["y"]]) for _ in range(m)],
        metric=rng.choice(["euclidean", "manhattan"]),
    )
    return Mission(
        instance,
        joins=joins,
        appears=appears,
        deadline=[rng.choice([math.inf, hour + rng.uniform(1, 9)]) for hour in appears],
        growth=[rng.choice([0.0, rng.uniform(0, 2)]) for _ in range(m)],
        events=random_events(rng, n, m),
        horizon=rng.choice([math.inf, 20.0, 6.0]),
        knowledge=rng.choice(["local", "local", "full"]),
        sensing=rng.choice([0.3, 0.7, math.inf]),
        radio=random_radio(rng),
        pace=rng.choice([None, None, Pace(1, 2, 1), Pace(0, 1.5, 0.3)]),
        seed=rng.randrange(2**63),
    )


def require_same_knowledge(view: View, state: MissionArrays, row: int, mission: Mission) -> None:
    """Assert that an agent knows the same in both simulations."""
    hours, left = state.task_hour[row], state.task_left[row]
    assert {mission.instance.task_index[name] for name in view.tasks} == set(np.flatnonzero(hours >= 0).tolist())
    for name, task in view.tasks.items():
        j = mission.instance.task_index[name]
        assert hours[j] == pytest.approx(task.hour, rel=1e-9)
        if task.status is TaskStatus.OPEN:
            assert left[j] == pytest.approx(task.left, rel=1e-9, abs=1e-9)
        else:
            assert TASK_STATUS[int(-left[j])] is task.status
    reports = {i: report for i, report in enumerate(state.known_report[row].tolist()) if report != NOTHING}
    assert state.known[row] == len(reports)
    assert {mission.instance.agent_index[name] for name in view.agents} == set(reports)
    for name, agent in view.agents.items():
        report = state.reports[reports[mission.instance.agent_index[name]]]
        assert report.hour == pytest.approx(agent.hour, rel=1e-9)
        assert AGENT_STATUS[report.status] is agent.status
        if agent.place.position is not None:
            assert (report.x, report.y, report.z) == pytest.approx(agent.place.position, rel=1e-9, abs=1e-9)
        assert report.battery == pytest.approx(agent.battery, rel=1e-9, abs=1e-9)
        assert report.task == (NOBODY if agent.task is None else mission.instance.task_index[agent.task])


def random_order(rng: random.Random, mission: Mission) -> tuple[Order, int, int, tuple[float, float, float]]:
    """Return a random order for both simulations, feasible or not."""
    kind = rng.choice([STAY, TO_TASK, TO_TASK, TO_TASK, TO_PLACE])
    task = rng.randrange(mission.instance.m)
    place = rng.choice([(0.1, 0.2, 0.0), (rng.random(), rng.random(), 0.0)])
    given = {STAY: Order(), TO_TASK: Order(mission.instance.task_ids[task]), TO_PLACE: Order(position=place)}
    return given[kind], kind, task, place


def run_both(mission: Mission, seed: int, patience: float) -> tuple[MissionResult, MissionResult]:
    """Run a mission in both simulations with the same random orders, and return both results.

    At every request, the knowledge of all agents and the outcome of every order are compared.
    """
    reference, state = Simulation(mission, seed=seed), begun(pack(mission), seed)
    rng, head = random.Random(seed), state.head[0]
    index = mission.instance.agent_index
    while True:
        request, wanted = reference.advance(), advance(state)
        if request is None:
            assert wanted == OVER
            break
        assert wanted == (MESSAGES if request.wanted is Wanted.MESSAGES else ORDERS)
        assert head.hour == pytest.approx(request.hour, rel=1e-9)
        numbers = [index[name] for name in request.agents]
        if request.wanted is Wanted.MESSAGES:
            for agent in state.agents:
                agent.speaks = 0
            for name, number in zip(request.agents, numbers, strict=True):
                if rng.random() < 0.8:
                    state.agents[number].speaks = 1
                    reference.send(name, reference.view(name, is_glance=True).message())
            continue
        assert state.deciding[: head.deciding].tolist() == numbers
        for name, number in zip(request.agents, numbers, strict=True):
            row = number if reference.knowledge is Knowledge.LOCAL else 0
            require_same_knowledge(reference.view(name), state, row, mission)
            if rng.random() < patience:
                continue
            given, *order_of = random_order(rng, mission)
            assert order(state, number, *order_of) == (reference.order(name, given) is None), given
    return measured(reference, "random", seed, DecisionTimes()), measure(mission, state, "random", seed)


def require_equal(reference: MissionResult, compiled: MissionResult) -> None:
    """Assert that both results are the same."""
    for field in dataclasses.fields(MissionResult):
        expected, found = getattr(reference, field.name), getattr(compiled, field.name)
        if isinstance(expected, float):
            assert found == pytest.approx(expected, rel=1e-9, abs=1e-9), field.name
        else:
            assert found == expected, field.name


@pytest.mark.parametrize("seed", range(60))
def test_both_simulations_agree(seed: int) -> None:
    """On small random missions, knowledge, accepted orders and results agree at all hours."""
    require_equal(*run_both(random_mission(seed), seed, random.Random(seed).choice([0.5, 0.9, 0.98])))


def test_tasks_exactly_at_the_sensing_radius_are_seen_in_both() -> None:
    """An agent at the sensing radius from a task, up to rounding errors, sees it in both simulations."""
    drawn = generated(MissionParameters("steady", 3, 6, loss=0.0), 131)
    require_equal(*run_both(drawn, 131, random.Random(131).choice([0.5, 0.9, 0.98])))
