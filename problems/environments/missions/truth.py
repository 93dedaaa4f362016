"""The true state of a mission, as an array for a centralised critic, and as text."""

import math
import sys

import numpy as np

from alloc.problems.arguments import shown
from alloc.problems.environments.missions.observation import LIMIT, Floats
from alloc.problems.errors import InputError
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.changes import goal_of
from alloc.problems.missions.simulation.motion import battery_at, place_at, work_left
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.state import (
    ACTIVE,
    AgentState,
    AgentStatus,
    MissionState,
    TaskState,
    TaskStatus,
)

AGENT_TRUTHS, TASK_TRUTHS = 11, 10

HUMAN = "human"
RENDER_MODES = (HUMAN, "ansi")


class Truth:
    """Encoder of the true state, without future events.

    The array is the concatenation of the hour, as a share of the mission; `AGENT_TRUTHS` of each agent, in their order
    in the mission: whether it is present, flies, works; its position, and the destination of its order; its battery in
    flights across the area, and its ability; and `TASK_TRUTHS` of each task: whether it is open, or done; its position;
    work left, growth, priority, hours to its deadline; and the number of agents that work there. Positions are in units
    of the longest side of the mission's area; battery, ability and the amounts of tasks from work left on are
    log(1 + x). Absent agents and tasks that have not appeared are all zeros. Values are within -10 and 10.

    Parameters
    ----------
    mission : Mission
    """

    def __init__(self, mission: Mission) -> None:
        low, high = mission.area
        self._low, self._end = low, mission.end
        self._span = max(max(b - a for a, b in zip(low, high, strict=True)), 1e-12)
        self._side = max(mission.longest_flight, 1e-12)

    def array(self, state: MissionState) -> Floats:
        """Return the state as an array, shape (1 + n AGENT_TRUTHS + m TASK_TRUTHS,)."""
        flat = [state.hour / self._end]
        for agent in state.agents:
            flat += self._agent(state, agent) if agent.status in ACTIVE else [0.0] * AGENT_TRUTHS
        for task in state.tasks:
            flat += [0.0] * TASK_TRUTHS if task.status is TaskStatus.TO_COME else self._task(state, task)
        bounded: Floats = np.clip(np.nan_to_num(flat, posinf=LIMIT, neginf=-LIMIT), -LIMIT, LIMIT).astype(np.float32)
        return bounded

    def _agent(self, state: MissionState, agent: AgentState) -> list[float]:
        place, whole = place_at(state, agent), agent.facts.energy_per_distance * self._side
        goal, _ = goal_of(state, agent.order)
        flights = battery_at(state, agent) / whole if whole > 0 else math.inf
        return [
            1.0,
            float(agent.status is AgentStatus.FLYING),
            float(agent.status is AgentStatus.WORKING),
            *self._position(place),
            *self._position(goal if goal.position is not None else place),
            math.log1p(max(0.0, flights)),
            math.log1p(agent.facts.ability),
        ]

    def _task(self, state: MissionState, task: TaskState) -> list[float]:
        facts = task.facts
        return [
            float(task.status is TaskStatus.OPEN),
            float(task.status is TaskStatus.DONE),
            *self._position(facts.place),
            math.log1p(work_left(state, task)),
            math.log1p(facts.growth),
            math.log1p(facts.priority),
            math.log1p(max(0.0, facts.deadline - state.hour)),
            math.log1p(len(task.workers)),
        ]

    def _position(self, place: Place) -> list[float]:
        if place.position is None:
            return [0.0, 0.0, 0.0]
        return [(x - low) / self._span for x, low in zip(place.position, self._low, strict=True)]


def state_length(n: int, m: int) -> int:
    """Return the length of the array."""
    return 1 + n * AGENT_TRUTHS + m * TASK_TRUTHS


def checked_mode(mode: str | None) -> str | None:
    """Return `mode` if it is None or one of `RENDER_MODES`, or raise an `InputError`."""
    if mode is not None and mode not in RENDER_MODES:
        raise InputError(f"must be one of {', '.join(RENDER_MODES)}, got {shown(mode)}", "render_mode")
    return mode


def rendered(state: MissionState, mode: str | None) -> str | None:
    """Return the state as text, or print it, depending on the mode; None without a mode."""
    if mode == HUMAN:
        sys.stdout.write(as_text(state))
    return as_text(state) if mode == "ansi" else None


def show_step(state: MissionState, mode: str | None) -> None:
    """Print the state in mode ``human``, as environments do after each step."""
    if mode == HUMAN:
        rendered(state, mode)


def as_text(state: MissionState) -> str:
    """Return the state as text, with a line for each agent and each open task."""
    done = sum(task.status is TaskStatus.DONE for task in state.tasks)
    lines = [f"hour {state.hour:.4g}: {done} of {len(state.tasks)} tasks done"]
    for agent in state.agents:
        position = place_at(state, agent).position
        where = "" if position is None else " at " + ", ".join(f"{axis:.4g}" for axis in position)
        goal = "" if agent.order.task is None else f", order {agent.order.task}"
        battery = battery_at(state, agent)
        energy = "" if battery == math.inf else f", battery {battery:.4g}"
        lines.append(f"agent {agent.facts.id}: {agent.status}{where}{goal}{energy}")
    for task in state.tasks:
        if task.status is TaskStatus.OPEN:
            here = f", {len(task.workers)} at work" if task.workers else ""
            lines.append(f"task {task.facts.id}: {work_left(state, task):.4g} left{here}")
    return "\n".join(lines) + "\n"
