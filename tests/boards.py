"""Boards for tests, with one reference makespan and one weight of energy."""

import numpy as np

from alloc.problems import Allocation, Instance
from alloc.problems.game import Board, State, current_tasks, make_board, reset, step

EXTREMES = {
    "huge": Instance(
        ability=[1e53, 1e60],
        workload=[1e60, 1e-60],
        task_position=[[1e60, 0], [-1e60, 0]],
        agent_position=[[0, 0], [1e60, 0]],
        battery=[1e300, 1e-300],
        speed=[1e-60, 1e300],
        priority=[1e308, 1e308],
        energy_per_distance=1e60,
    ),
    "tiny": Instance(
        ability=[1e-50, 1e-60],
        workload=[1e-60, 1e60],
        task_position=[[1e-300, 0], [-1e-300, 0]],
        agent_position=[[0, 0], [1, 0]],
        priority=[1e-308, 0],
        energy_per_distance=0.0,
        battery=[0, 1],
        tau=1 - 1e-16,
    ),
    "one of each": Instance(ability=[3], workload=[2]),
    "nothing to do": Instance(ability=[1, 2], workload=[0, 0], task_position=[[0, 0], [1, 0]]),
    "nobody can go": Instance(ability=[1, 2], workload=[1, 2], allowed_tasks=[[], []]),
    "no positions": Instance(ability=[1, 2, 3], workload=[1, 2], battery=[0, 1, 2], communication_range=[0, 0, 1]),
}
"""Instances at the ends of what is valid."""


def layout(*instances: Instance, hours: float = 1.0, energy_weight: float = 0.5, seed: int = 0, **options) -> Board:
    """Return a board of games on `instances`; further options are those of `make_board`."""
    size = len(instances)
    return make_board(instances, [hours] * size, [energy_weight] * size, np.random.default_rng(seed), **options)


def state_of(board: Board, plan: np.ndarray) -> State:
    """Return the state after all agents have moved as in `plan`, shape (n,), which must be feasible."""
    places = np.where(plan < 0, board.places - 1, plan)
    slot = ((board.candidates == board.candidates.new_tensor(places)[None, :, None]) & board.legal).int().argmax(2)
    return step(board, reset(board), slot)


def plan_of(board: Board, state: State, game: int = 0) -> Allocation:
    """Return the allocation in one game."""
    task = current_tasks(board, state)[game].numpy()
    return Allocation(np.where(task == board.places - 1, -1, task))
