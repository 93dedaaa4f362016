"""Coalition formation with spatial and temporal constraints (CFSTP) as missions."""

import numpy as np

from alloc.problems.arguments import checked_seed, whole
from alloc.problems.fields import FloatArray
from alloc.problems.instance import Instance
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Pace
from alloc.problems.units import Units

SIDE = 50
WORKLOAD, DEADLINE = (10, 50), (5, 600)

PACE = Pace(low=1.0, high=2.0, period=1.0)
"""In each step, a coalition does as much work as it has agents, times a factor drawn uniformly from 1 to 2."""


def random_cfstp(agents: int = 20, tasks: int = 300, seed: int = 0, *, name: str | None = None) -> Mission:
    """Return a random CFSTP instance, distributed as in lcpz/cfstp: uniform positions, workloads and deadlines.

    Positions are cells of a 50 x 50 grid, workloads range from 10 to 50, deadlines from 5 to 600 steps.

    Parameters
    ----------
    agents, tasks : int
    seed : int
        Seed of all random numbers, >= 0.
    name : str, optional

    Raises
    ------
    InputError
        If a number is out of its range.

    References
    ----------
    Ramchurn et al. (2010), coalition formation with spatial and temporal constraints, AAMAS; Capezzuto, Tarapore and
    Ramchurn (2020), arXiv:2003.13806.
    """
    n, m = whole(agents, "agents", 1), whole(tasks, "tasks", 1)
    number = checked_seed(seed)
    rng = np.random.default_rng(number)
    workload = rng.integers(*WORKLOAD, m, endpoint=True)
    starts, places = rng.integers(0, SIDE, (n, 2)), rng.integers(0, SIDE, (m, 2))
    demands = np.stack([rng.integers(*DEADLINE, m, endpoint=True), workload], axis=1)
    called = f"cfstp-seed-{number}" if name is None else name
    return cfstp_mission(called, starts.astype(float), places.astype(float), demands.astype(float), number)


def cfstp_mission(name: str, agents: FloatArray, tasks: FloatArray, demands: FloatArray, seed: int) -> Mission:
    """Return a CFSTP instance as a mission: time in steps, speed one cell per step, identical agents.

    Parameters
    ----------
    name : str
    agents, tasks : ndarray, shape (n, 2) and (m, 2)
        Cells of the grid.
    demands : ndarray, shape (m, 2)
        Deadline and workload of each task.
    seed : int
        Seed of the pace.
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
