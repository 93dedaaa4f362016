"""Exploration of random places, compiled: see `alloc.allocators.online.policies.exploring`."""

import numpy as np

from alloc.allocators.missions.chance import fraction, keyed
from alloc.allocators.missions.layout import NOBODY, STAY, TO_PLACE, TO_TASK, MissionArrays
from alloc.allocators.missions.motion import battery_of, can_fly, distance_between, place_of
from alloc.allocators.missions.orders import order
from alloc.allocators.online.policies.exploring import BATTERY_SHARE, TRIES
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import FloatArray, IntArray


@compiled_in_place
def draw(area: FloatArray, axis: int, number: int, key: int, drawn: IntArray) -> float:
    """Return a random coordinate in the area."""
    drawn[number] += 1
    chance = fraction(keyed(keyed(key, number + 1), drawn[number]))
    return float(area[0, axis] + (area[1, axis] - area[0, axis]) * chance)


@compiled_in_place
def explore(state: MissionArrays, number: int, key: int, drawn: IntArray) -> None:
    """Send an agent that knows of nothing to do to a random place, as `Explorer` does.

    Parameters
    ----------
    state : MissionArrays
    number : int
        Index of the agent.
    key : int
        State of the hash after the seed of the run.
    drawn : ndarray of int, shape (n,)
        How many random numbers each agent has drawn.
    """
    head, agent = state.head[0], state.agents[number]
    nowhere = (0.0, 0.0, 0.0)
    if not head.is_local or head.sensing == np.inf:
        order(state, number, STAY, NOBODY, nowhere)
        return
    if agent.flight != 0 and agent.order != TO_TASK:
        return
    here, battery = place_of(agent, head.hour), battery_of(agent, head.hour)
    for _ in range(TRIES):
        place = (
            draw(state.area, 0, number, key, drawn),
            draw(state.area, 1, number, key, drawn),
            draw(state.area, 2, number, key, drawn),
        )
        energy = agent.energy_per_distance * distance_between(head.is_manhattan, here, place)
        is_cheap = battery == np.inf or energy <= BATTERY_SHARE * battery
        if is_cheap and can_fly(head.is_manhattan, agent, here, battery, place):
            order(state, number, TO_PLACE, NOBODY, place)
            return
    order(state, number, STAY, NOBODY, nowhere)
