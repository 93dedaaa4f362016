"""Validation of networks in missions that are never trained on."""

import numpy as np

from alloc.allocators.learned.missions.network import MissionNetwork, compiled_weights
from alloc.allocators.learned.missions.play import play, room_for
from alloc.allocators.learned.missions.training.curriculum import PackedMission
from alloc.allocators.learned.training.validation import Validation
from alloc.allocators.missions.layout import DONE, MissionArrays
from alloc.allocators.missions.pack import begun

MISSED_WEIGHT = 3.0
"""Cost of a mission without any priority done, in ideal mission times."""

DISTANCE_WEIGHT = 0.02
"""Cost of the distance per agent, in diagonals of the area."""


def validate(network: MissionNetwork, missions: list[tuple[PackedMission, int]]) -> Validation:
    """Return how well a network leads missions.

    Its cost is the hour at which the last task is done, over the ideal mission time, with what is missed or left, and a
    little for distance; ``unserved`` counts tasks that are not done, and ``reward`` is minus the cost.

    Parameters
    ----------
    network : MissionNetwork
    missions : list of (PackedMission, int)
        And the seeds of their runs.
    """
    weights, rows = compiled_weights(network), []
    for mission, seed in missions:
        state = begun(mission.arrays, seed)
        play(state, room_for(len(state.agents), len(state.tasks)), weights, seed)
        rows.append(_figures(state, mission.ideal))
    time, unserved, undone, distance = np.array(rows).mean(axis=0).tolist()
    cost = time + MISSED_WEIGHT * undone + DISTANCE_WEIGHT * distance
    return Validation(cost, unserved, time, distance, 0.0, -cost)


def _figures(state: MissionArrays, ideal: float) -> tuple[float, float, float, float]:
    """Return mission time, tasks not done, their share of all priority, and distance per agent."""
    done = [task.status == DONE for task in state.tasks]
    priority = [float(task.priority) for task in state.tasks]
    undone = sum(weight for weight, is_done in zip(priority, done, strict=True) if not is_done)
    last = max((float(task.closed) for task in state.tasks if task.closed < np.inf), default=0.0)
    time = last if all(task.closed < np.inf for task in state.tasks) else float(state.head[0].end)
    flown = sum(float(agent.distance) for agent in state.agents) / len(state.agents)
    share = undone / sum(priority) if sum(priority) > 0 else 1.0 - float(np.mean(done))
    return time / ideal, len(done) - sum(done), share, flown / max(float(state.head[0].span), 1e-9)
