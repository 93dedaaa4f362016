"""Validation of networks in missions that are never used for training."""

from collections.abc import Sequence

import numpy as np

from alloc.allocators.learned.missions.network import MissionNetwork, compiled_weights
from alloc.allocators.learned.missions.play import new_buffers, play
from alloc.allocators.learned.missions.training.curriculum import PackedMission
from alloc.allocators.learned.training.validation import Validation
from alloc.allocators.missions.layout import DONE, MissionArrays
from alloc.allocators.missions.pack import begun, records

MISSED_WEIGHT = 3.0
"""Cost of completing no priority in a mission, in ideal mission times."""

DISTANCE_WEIGHT = 0.02
"""Cost of the distance per agent, measured in diagonals of the area."""


def validate(network: MissionNetwork, missions: list[tuple[PackedMission, int]]) -> Validation:
    """Return the performance of a network in missions.

    The cost of a mission is the mission time over the ideal mission time, plus the costs of missed or unfinished tasks
    and of distance. The total cost is the geometric mean, so that relative changes count equally in all missions.
    ``unserved`` counts tasks that are not done, and ``reward`` is the negative cost.

    Parameters
    ----------
    network : MissionNetwork
    missions : list of (PackedMission, int)
        Missions and the seeds of their runs.
    """
    weights, rows = compiled_weights(network), []
    for mission, seed in missions:
        state = begun(mission.arrays, seed)
        play(state, new_buffers(len(state.agents), len(state.tasks), mission.periods), weights, seed)
        rows.append(figures(state, mission.ideal))
    time, unserved, _, distance = np.mean(rows, axis=0).tolist()
    cost = cost_of(rows)
    return Validation(cost, unserved, time, distance, 0.0, -cost)


def cost_of(rows: Sequence[tuple[float, ...]]) -> float:
    """Return the total cost of missions, given the `figures` of each."""
    time, _, undone, distance = np.array(rows).T
    return float(np.exp(np.log(time + MISSED_WEIGHT * undone + DISTANCE_WEIGHT * distance).mean()))


def figures(state: MissionArrays, ideal: float) -> tuple[float, float, float, float]:
    """Return mission time, tasks not done, their share of all priority, and distance per agent."""
    tasks, agents, head = records(state.tasks), records(state.agents), state.head[0]
    undone = tasks["status"] != DONE
    is_closed, priority = tasks["closed"] < np.inf, tasks["priority"]
    time = tasks["closed"].max() if is_closed.all() else head.end
    share = priority[undone].sum() / priority.sum() if priority.any() else undone.mean()
    return time / ideal, undone.sum(), share, agents["distance"].mean() / max(head.span, 1e-9)
