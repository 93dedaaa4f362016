"""Instances of coalition formation with spatial and temporal constraints (CFSTP), as the tests of lcpz/cfstp print."""

import re

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.formats.files import named, read_text
from alloc.problems.missions.families.cfstp import cfstp_mission
from alloc.problems.missions.mission import Mission

PLACE = re.compile(r"(task|agent)\[\s*(\d+)\] (?:starting )?at \(\s*(-?\d+),\s*(-?\d+)\)")
DEMANDS = re.compile(r"task\[\s*(\d+)\] has demands \[\s*(\d+),\s*(\d+)\]")


def read_cfstp(path: str, name: str, seed: int) -> Mission:
    """Read a CFSTP instance: grid positions, and deadline and workload of each task.

    Parameters
    ----------
    path : str
        Text with lines such as ``task[  0] at ( 13,   7)``, ``agent[  0] starting at ( 30,  21)`` and ``task[  0] has
        demands [322, 41]``; all other lines are ignored.
    name : str
    seed : int
        Seed of the pace.

    Raises
    ------
    InputError
        If it cannot be read or is incomplete.
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
        raise InputError("is not a CFSTP instance: no lines such as 'task[  0] at ( 13,   7)'", source=named(path))
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
