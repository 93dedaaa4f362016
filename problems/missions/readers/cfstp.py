"""Instances of coalition formation with spatial and temporal constraints, as the tests of lcpz/cfstp print them."""

import re

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.formats.files import named, read_text
from alloc.problems.instance import Instance
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Pace
from alloc.problems.units import Units

PLACE = re.compile(r"(task|agent)\[\s*(\d+)\] (?:starting )?at \(\s*(-?\d+),\s*(-?\d+)\)")
DEMANDS = re.compile(r"task\[\s*(\d+)\] has demands \[\s*(\d+),\s*(\d+)\]")

PACE = Pace(low=1.0, high=2.0, period=1.0)
"""A coalition does as much work a step as it has agents, times a number from 1 to 2 that is drawn anew each step."""


def read_cfstp(path: str, name: str, seed: int) -> Mission:
    """Read an instance: places on a grid, and deadline and workload of each task.

    Parameters
    ----------
    path : str
        Text with lines such as ``task[  0] at ( 13,   7)``, ``agent[  0] starting at ( 30,  21)`` and ``task[  0] has
        demands [322, 41]``; all other lines are ignored.
    name : str
    seed : int
        Of the pace.

    Raises
    ------
    InputError
        If it cannot be read, or something is missing in it.
    """
    places: dict[str, dict[int, tuple[float, float]]] = {"agent": {}, "task": {}}
    demands: dict[int, tuple[float, float]] = {}
    for line in read_text(path).splitlines():
        if place := PLACE.search(line):
            places[place[1]][int(place[2])] = (float(place[3]), float(place[4]))
        elif demand := DEMANDS.search(line):
            demands[int(demand[1])] = (float(demand[2]), float(demand[3]))
    tasks, agents = sorted(places["task"]), sorted(places["agent"])
    if not tasks or not agents:
        raise InputError("is no CFSTP instance: it has no lines such as 'task[  0] at ( 13,   7)'", source=named(path))
    for task in tasks:
        if task not in demands:
            raise InputError("is missing; add a line such as 'task[  0] has demands [322, 41]'", f"task[{task}]", path)
    return cfstp_mission(
        name,
        np.array([places["agent"][agent] for agent in agents]),
        np.array([places["task"][task] for task in tasks]),
        np.array([demands[task] for task in tasks]),
        seed,
    )


def cfstp_mission(name: str, agents: np.ndarray, tasks: np.ndarray, demands: np.ndarray, seed: int) -> Mission:
    """Return the mission of a CFSTP: time in steps, one cell of the grid per step, agents alike.

    Parameters
    ----------
    name : str
    agents, tasks : ndarray, shape (n, 2) and (m, 2)
        Cells of the grid.
    demands : ndarray, shape (m, 2)
        Deadline and workload of each task.
    seed : int
        Of the pace.
    """
    instance = Instance(
        name=name,
        ability=np.ones(len(agents)),
        agent_position=agents,
        speed=np.ones(len(agents)),
        workload=demands[:, 1],
        task_position=tasks,
        metric="manhattan",
        units=Units(time="steps"),
    )
    return Mission(instance, deadline=demands[:, 0], pace=PACE, seed=seed)
