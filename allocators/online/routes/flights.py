"""Flights of agents in a schedule: distances, feasibility, departures and landings."""

import numpy as np

from alloc.allocators.online.routes.queue import push
from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.situation import FIXED, MANHATTAN, Ints, Situation
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.distances.reach import TOLERANCE

IDLE, FLYING, PRESENT, AWAY = 0, 1, 2, 3
"""States of an agent."""

KIND = 1 << 40
"""Queue items are kind * KIND + index; kinds in order: completion, deadline, event, arrival."""


@inlined
def distance_to(s: Situation, r: Schedule, i: int, j: int) -> float:
    """Return the distance from an agent to a task."""
    node = r.agents[i].node
    if node == -1:
        return float(s.start_distance[i, j])
    if node >= 0:
        return float(s.distance[node, j])
    if np.isnan(s.site[j, 0]) or np.isnan(r.point[i, 0]):
        return 0.0
    x, y, z = r.point[i, 0] - s.site[j, 0], r.point[i, 1] - s.site[j, 1], r.point[i, 2] - s.site[j, 2]
    return float(abs(x) + abs(y) + abs(z) if s.metric == MANHATTAN else np.sqrt(x * x + y * y + z * z))


@compiled_in_place
def depart(s: Situation, r: Schedule, routes: Ints, lengths: Ints, i: int, hour: float, size: int) -> int:
    """Start an agent's flight to the next task of its route that it can do; return the size of the queue."""
    while r.agents[i].pointer < lengths[i]:
        j = routes[i, r.agents[i].pointer]
        if r.tasks[j].closed == 0 and s.allowed[i, j]:
            way = distance_to(s, r, i, j)
            arrives = hour + way / s.agents[i].speed
            needed = s.agents[i].consumption * (way + s.home[j, i])
            if (
                way <= s.agents[i].reach + TOLERANCE
                and needed <= r.agents[i].fuel + TOLERANCE
                and arrives < s.tasks[j].deadline
            ):
                r.agents[i].target, r.agents[i].state, r.agents[i].way = j, FLYING, way
                r.agents[i].departs, r.agents[i].arrives = hour, arrives
                r.agents[i].version += 1
                r.agents[i].following, r.tasks[j].head = r.tasks[j].head, i
                return push(r.queue, size, arrives, 3 * KIND + i, r.agents[i].version)
        r.agents[i].pointer += 1
    r.agents[i].target, r.agents[i].state = -1, IDLE
    return size


@inlined
def land(s: Situation, r: Schedule, i: int, hour: float) -> bool:
    """End a flight where the agent is now; return False if the agent cannot be diverted in flight."""
    j = r.agents[i].target
    length = r.agents[i].arrives - r.agents[i].departs
    share = 1.0 if length <= 0 or hour >= r.agents[i].arrives else max(0.0, (hour - r.agents[i].departs) / length)
    if share < 1 and s.metric == FIXED:
        return False
    r.agents[i].fuel -= s.agents[i].consumption * share * r.agents[i].way
    r.agents[i].energy += s.agents[i].consumption * share * r.agents[i].way
    r.agents[i].hours += share * length
    if share == 1:
        r.agents[i].node = j
    elif share > 0:
        for axis in range(3):
            node = r.agents[i].node
            begin = s.place[i, axis] if node == -1 else (s.site[node, axis] if node >= 0 else r.point[i, axis])
            r.point[i, axis] = begin + share * (s.site[j, axis] - begin)
        r.agents[i].node = -2
    r.agents[i].version += 1
    return True
