"""The optimum by brute force, from the definitions, independent of the code that it checks."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pyproj import Geod

from alloc.problems import Instance

FloatArray = NDArray[np.float64]

CHUNK = 20_000
"""Plans that are scored at once."""


@dataclass(frozen=True)
class Optimum:
    """Scores of the best plan: fewest tasks unserved, most priority served, least makespan, least energy.

    `lost` is the sum of the priorities of the unserved tasks. `energy` is the least among the plans with that makespan
    (within 1e-9 relative); `plan` is one of them.
    """

    unserved: int
    makespan: float
    energy: float
    plan: tuple[int, ...]
    lost: float


@lru_cache(1024)  # of an instance that is solved by many methods, once
def brute_force(instance: Instance) -> Optimum:
    """Enumerate all (m + 1)^n allocations, without those that assign an agent to a task that it cannot take."""
    plans, unserved, lost, makespan, energy = _scored_plans(instance)
    few = unserved == unserved.min()
    few &= lost <= lost[few].min() * (1 + 1e-12)
    least = makespan[few].min()
    fast = few & (makespan <= least * (1 + 1e-9))
    best = int(np.flatnonzero(fast)[energy[fast].argmin()])
    return Optimum(
        int(unserved[best]), float(least), float(energy[best]), tuple(plans[best].tolist()), float(lost[best])
    )


def least_energy_within(instance: Instance, makespan: float) -> float:
    """Return the least energy of all allocations that serve all tasks within `makespan` hours."""
    _, unserved, _, hours, energy = _scored_plans(instance)
    return float(energy[(unserved == 0) & (hours <= makespan * (1 + 1e-9))].min())


def _scored_plans(
    instance: Instance,
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
    """Return all feasible plans with the unserved tasks, their priority, makespan, and energy of each."""
    distance, able = reachable(instance)
    energy_of = flight_energies(instance, distance)
    options = [[-1, *np.flatnonzero(row).tolist()] for row in able]
    plans = np.array(np.meshgrid(*options, indexing="ij"), dtype=np.int64).reshape(instance.n, -1).T
    scores = [_score(instance, distance, energy_of, plans[row : row + CHUNK]) for row in range(0, len(plans), CHUNK)]
    unserved, lost, makespan, energy = (np.concatenate(part) for part in zip(*scores, strict=True))
    return plans, unserved, lost, makespan, energy


def reachable(instance: Instance) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return distances (1) and reachability, shape (n, m), including the return to bases."""
    distance, able = np.zeros((instance.n, instance.m)), np.ones((instance.n, instance.m), dtype=bool)
    for i in range(instance.n):
        for j in range(instance.m):
            away, given = _distance(instance, i, j)
            distance[i, j] = away
            if instance.distances is not None and instance.distances.missing == "unreachable":
                able[i, j] = given and (instance.return_base[i] < 0 or _way_home(instance, i, j)[1])
            if instance.allowed_tasks is not None and instance.allowed_tasks[i] is not None:
                able[i, j] &= j in instance.allowed_tasks[i]
            if instance.needs is not None:
                able[i, j] &= set(instance.needs[j]) <= set(() if instance.skills is None else instance.skills[i])
    able &= distance <= instance.communication_range[:, None] + 1e-9
    able &= flight_energies(instance, distance) <= instance.battery[:, None] + 1e-9
    return distance, able


def flight_energies(instance: Instance, distance: FloatArray) -> FloatArray:
    """Return the energy of each agent's flight to each task, and back where it returns, shape (n, m)."""
    energy = np.zeros((instance.n, instance.m))
    for i in range(instance.n):
        for j in range(instance.m):
            back = _way_home(instance, i, j)[0] if instance.returns[i] else 0.0
            energy[i, j] = instance.agent_energy_per_distance[i] * (distance[i, j] + back)
    return energy


def _way_home(instance: Instance, i: int, j: int) -> tuple[float, bool]:
    """Return the distance from task j to the place to which agent i returns, and whether a table gives it."""
    base, table = int(instance.return_base[i]), instance.distances
    if base < 0:
        return _distance(instance, i, j, back=True)
    if table is not None:
        rows = dict(zip(zip(table.source.tolist(), table.target.tolist(), strict=True), table.distance, strict=True))
        node, task = table.n + table.m + base, table.n + j
        for pair in ((task, node), (node, task)):
            if pair in rows:
                return float(rows[pair]), True
    return _by_metric(instance, instance.bases.position[base], instance.task_position[j]), False


def _distance(instance: Instance, i: int, j: int, *, back: bool = False) -> tuple[float, bool]:
    """Return the distance from the start of agent i to task j, or back, and whether a table gives it."""
    starts_at_task = np.isnan(instance.agent_position[i]).any() and instance.start_task[i] >= 0
    start = int(instance.start_task[i]) if starts_at_task else None
    place = instance.agent_position[i] if start is None else instance.task_position[start]
    table = instance.distances
    if table is not None:
        rows = dict(zip(zip(table.source.tolist(), table.target.tolist(), strict=True), table.distance, strict=True))
        for node in [i] + ([] if start is None else [table.n + start]):
            there, home = (node, table.n + j), (table.n + j, node)
            for pair in (home, there) if back else (there, home):
                if pair in rows:
                    return float(rows[pair]), True
        if start == j:
            return 0.0, True
    return _by_metric(instance, place, instance.task_position[j]), False


def _by_metric(instance: Instance, place: FloatArray, goal: FloatArray) -> float:
    """Return the distance between two places, 0 if one is unknown."""
    if np.isnan(place).any() or np.isnan(goal).any():
        return 0.0
    if instance.metric == "manhattan":
        return float(np.abs(place - goal).sum())
    if instance.metric == "geographic":
        metres = Geod(ellps="WGS84").inv(place[0], place[1], goal[0], goal[1])[2]
        metres_in = {"m": 1.0, "km": 1e3, "mi": 1609.344, "nmi": 1852.0}[instance.units.distance or "km"]
        return float(np.hypot(metres, place[2] - goal[2]) / metres_in)
    return float(np.linalg.norm(place - goal))


def _score(
    instance: Instance, distance: FloatArray, energy_of: FloatArray, plans: NDArray[np.int64]
) -> tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
    """Unserved tasks, their priority, makespan of the served ones and energy, each of shape (len(plans),)."""
    unserved, lost, makespan = np.zeros(len(plans), dtype=np.int64), np.zeros(len(plans)), np.zeros(len(plans))
    for j in np.flatnonzero(instance.workload > 0).tolist():
        there = plans == j
        served = there.any(axis=1)
        unserved += ~served
        lost += ~served * instance.priority[j]
        time = _finished(instance.workload[j], instance.ability, distance[:, j] / instance.speed, there)
        makespan = np.maximum(makespan, np.where(served, time, 0.0))
    energy = np.where(plans >= 0, energy_of[np.arange(instance.n), plans], 0.0).sum(axis=1)
    return unserved, lost, makespan, energy


def _finished(
    workload: float, ability: NDArray[np.float64], arrival: NDArray[np.float64], there: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Root T of sum_i w_i max(0, T - arrival_i) = h: walk through the arrivals in order, each group at its own rate."""
    done, rate, clock = np.zeros(len(there)), np.zeros(len(there)), np.zeros(len(there))
    finish = np.full(len(there), np.inf)
    for i in [*np.argsort(arrival, kind="stable").tolist(), None]:
        until = np.inf if i is None else arrival[i]
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.where(rate > 0, clock + (workload - done) / rate, np.inf)
        finish = np.where(np.isinf(finish) & (root <= until), root, finish)
        if i is not None:
            done, clock = done + rate * (until - clock), np.full(len(there), until)
            rate = rate + ability[i] * there[:, i]
    return finish
