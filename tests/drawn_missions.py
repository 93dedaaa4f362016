"""Random small missions of every kind, and random orders, for tests of invariants."""

from typing import Any

import numpy as np
from hypothesis import strategies as st

from alloc.problems import Burst, Event, Instance, Mission, Pace, Radio
from alloc.problems.changes.remove import replaced
from alloc.problems.missions.simulation.agenda import Wanted
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import STAY, Order


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """Draw a mission with up to 4 agents, 5 tasks and any events that are possible in their order."""
    seed = draw(st.integers(0, 2**32))
    return random_mission_of_any_kind(np.random.default_rng(seed), bases=draw(st.booleans()))


def random_mission_of_any_kind(rng: np.random.Generator, *, bases: bool = False) -> Mission:
    """Return a mission with all settings random; with `bases`, some of the returning agents return to a base."""

    def chance(share: float = 0.5) -> bool:
        return bool(rng.random() < share)

    n, m = int(rng.integers(1, 5)), int(rng.integers(1, 6))
    instance = _instance(rng, n, m)
    if bases:
        homes = np.where(instance.returns, rng.integers(-1, 1, n), -1)
        instance = replaced(instance, return_base=homes, bases={"dock": rng.random(3)})
    limit = (lambda high: np.where(rng.random(m) < 0.5, rng.uniform(3, high, m), np.nan)) if chance() else None
    joins = np.where(rng.random(n) < 0.3, rng.uniform(0, 2, n), np.nan)
    appears = np.where(rng.random(m) < 0.4, rng.uniform(0, 3, m), np.nan)
    burst = Burst(float(rng.uniform(0.1, 2)), float(rng.uniform(0.1, 2)), 0.1, 0.9) if chance(0.3) else None
    return Mission(
        instance,
        joins=joins,
        appears=appears,
        deadline=None if limit is None else limit(9),
        growth=rng.uniform(0, 2, m) * (rng.random(m) < 0.5) if chance() else None,
        events=_events(rng, n, m),
        horizon=float(rng.uniform(3, 12)),
        knowledge="local" if chance() else "full",
        sensing=float(rng.uniform(0, 1)) if chance() else np.inf,
        radio=Radio(
            radius=float(rng.uniform(0, 1)) if chance() else np.inf,
            period=float(rng.choice([0.25, 0.5, 1.0])),
            loss=float(rng.choice([0, 0.3])),
            delay=float(rng.choice([0, 0.1, 0.7])),
            burst=burst,
        ),
        pace=Pace(float(rng.uniform(0, 1)), float(rng.uniform(1, 2)), 0.5) if chance(0.3) else None,
        seed=int(rng.integers(0, 2**31)),
    )


def _instance(rng: np.random.Generator, n: int, m: int) -> Instance:
    def some(values: Any, count: int) -> Any:
        return np.where(rng.random(count) < 0.5, values, np.inf)

    metric = str(rng.choice(["euclidean", "euclidean", "manhattan", "geographic"]))
    agents, tasks = rng.random((n, 3)), rng.random((m, 3))
    if rng.random() < 0.2:
        tasks[0] = np.nan
    distances = None
    if rng.random() < 0.3:
        pairs = [(f"a{i + 1}", f"t{j + 1}") for i in range(n) for j in range(m)]
        pairs += [(f"t{i + 1}", f"t{j + 1}") for i in range(m) for j in range(m) if i != j]
        distances = [(*pair, float(rng.random())) for pair in pairs if rng.random() < 0.7]
    scale = 100.0 if metric == "geographic" else 1.0  # degrees are some 100 km
    return Instance(
        ability=rng.uniform(1, 5, n),
        workload=rng.uniform(0, 6, m) * (rng.random(m) < 0.9),
        agent_position=agents,
        task_position=tasks,
        start_task=rng.integers(-1, m, n),
        battery=some(rng.uniform(0, 4, n) * scale, n),
        communication_range=some(rng.uniform(0.3, 2, n) * scale, n),
        speed=some(rng.uniform(0.2, 2, n) * scale, n),
        priority=rng.integers(0, 3, m),
        allowed_tasks=[None if rng.random() < 0.7 else [0] for _ in range(n)],
        agent_energy_per_distance=rng.uniform(0, 2, n),
        returns=(rng.random(n) < 0.3) & (distances is None),
        skills=[["lift"] if rng.random() < 0.7 else [] for _ in range(n)],
        needs=[["lift"] if rng.random() < 0.3 else [] for _ in range(m)],
        metric=metric,
        distances=distances,
    )


def _events(rng: np.random.Generator, n: int, m: int) -> list[Event]:
    """Return possible events of every kind after hour 3, when all agents and tasks exist."""
    events = []
    for i in range(n):
        name, hours = f"a{i + 1}", sorted(rng.uniform(3, 10, 3).tolist())
        if rng.random() < 0.3:
            events += [Event(hours[0], "agent-recalled", agent=name), Event(hours[1], "agent-returns", agent=name)]
        if rng.random() < 0.3:
            events.append(Event(hours[1], "agent-recharges", agent=name, amount=float(rng.uniform(0, 3))))
        if rng.random() < 0.3:
            events.append(Event(hours[2], "agent-fails", agent=name))
        if rng.random() < 0.2:
            events.append(Event(hours[0], "radio-silent", agent=name, until=hours[2]))
    for j in range(m):
        name, hours = f"t{j + 1}", sorted(rng.uniform(3, 10, 2).tolist())
        if rng.random() < 0.3:
            amount = float(rng.uniform(0, 4) * (rng.random() < 0.8))
            events.append(Event(hours[0], "task-changes", task=name, workload=amount))
        if rng.random() < 0.2:
            events.append(Event(hours[1], "task-cancelled", task=name))
    if rng.random() < 0.2:
        events.append(Event(1.0, "radio-silent", center=(0.5, 0.5, 0.5), radius=0.4, until=2.0))
    return events


def run_wildly(mission: Mission, seed: int = 0) -> Simulation:
    """Simulate a mission under random orders: to any task, feasible or not, to places, or to stay."""
    simulation, rng = Simulation(mission, seed=seed), np.random.default_rng(seed)
    tasks = mission.instance.task_ids
    while (request := simulation.advance()) is not None:
        for name in request.agents:
            if request.wanted is Wanted.MESSAGES:
                if rng.random() < 0.8:
                    simulation.send(name, simulation.view(name, is_glance=True).message(("bid", 1.5)))
            elif (draw := rng.random()) < 0.5:
                simulation.order(name, Order(str(rng.choice(tasks))))
            elif draw < 0.6:
                x, y, z = rng.random(3).tolist()
                simulation.order(name, Order(position=(x, y, z)))
            elif draw < 0.7:
                simulation.order(name, STAY)
    return simulation
