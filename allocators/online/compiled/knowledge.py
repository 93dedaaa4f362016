"""Who knows what, compiled: `simulation/awareness.py` and `simulation/channel.py`."""

import numpy as np

from alloc.allocators.online.compiled.arrays import HEARD, MESSAGES, TICK, TO_COME, Setting, State
from alloc.allocators.online.compiled.motion import is_active, uniform, work_left
from alloc.allocators.runtime.compiled import compiled, inlined
from alloc.problems.missions.chance import LOSS


@inlined
def report_agent(state: State, i: int, k: int) -> None:
    """Let agent `i` know what is true of agent `k` now."""
    state.met[0, i, k], state.met[1, i, k] = state.now[0], state.agent[k].status
    state.met[2, i, k] = state.agent[k].order
    for axis in range(3):
        state.met[3 + axis, i, k] = state.here[k, axis]


@inlined
def report_task(state: State, setting: Setting, i: int, j: int) -> None:
    """Let agent `i` know what is true of task `j` now."""
    state.seen[0, i, j], state.seen[1, i, j] = state.now[0], work_left(state, setting, j)
    state.seen[2, i, j] = state.task[j].became


@compiled
def look_around(state: State, setting: Setting, i: int) -> None:
    """Let an agent see what lies within its sensing radius; with full knowledge, everything."""
    n, m = setting.allowed.shape
    square = setting.limits[1] * setting.limits[1] if setting.is_local else np.inf
    x, y, z = state.here[i, 0], state.here[i, 1], state.here[i, 2]
    for k in range(n):
        if k == i or (is_active(state, k) and _square(state, k, x, y, z) <= square):
            report_agent(state, i, k)
    for j in range(m):
        if state.task[j].became != TO_COME:
            dx, dy, dz = x - setting.task[j].place[0], y - setting.task[j].place[1], z - setting.task[j].place[2]
            if dx * dx + dy * dy + dz * dz <= square:
                report_task(state, setting, i, j)


@inlined
def _square(state: State, k: int, x: float, y: float, z: float) -> float:
    dx, dy, dz = state.here[k, 0] - x, state.here[k, 1] - y, state.here[k, 2] - z
    return float(dx * dx + dy * dy + dz * dz)


@compiled
def talk(state: State, setting: Setting) -> None:
    """Let all agents in the mission tell those within the radius all that they know, at once."""
    n = len(state.agent)
    square = setting.limits[2] * setting.limits[2]
    state.seen_before[:] = state.seen
    state.met_before[:] = state.met
    for i in range(n):
        if not is_active(state, i):
            continue
        state.counts[MESSAGES] += 1
        x, y, z = state.here[i, 0], state.here[i, 1], state.here[i, 2]
        for k in range(n):
            if (
                k != i
                and is_active(state, k)
                and _square(state, k, x, y, z) <= square
                and not _is_lost(state, setting, i, k)
            ):
                state.counts[HEARD] += 1
                hear(state, k, i)
    state.counts[TICK] += 1


@compiled
def _is_lost(state: State, setting: Setting, sender: int, hearer: int) -> bool:
    if setting.limits[4] == 0:
        return False
    drawn = uniform(LOSS, setting.seeds[0], setting.seeds[1], sender, hearer, state.counts[TICK])
    return bool(drawn < setting.limits[4])


@inlined
def hear(state: State, hearer: int, sender: int) -> None:
    """Let an agent take over what is newer in the sender's knowledge, as it was before anybody spoke."""
    told, known = state.seen_before[0, sender], state.seen[0, hearer]
    for j in range(len(told)):
        if told[j] > known[j]:
            for part in range(3):
                state.seen[part, hearer, j] = state.seen_before[part, sender, j]
    told, known = state.met_before[0, sender], state.met[0, hearer]
    for k in range(len(told)):
        if told[k] > known[k]:
            for part in range(6):
                state.met[part, hearer, k] = state.met_before[part, sender, k]
