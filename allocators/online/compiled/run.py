"""Missions in compiled loops, by the hundred."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.online.compiled.arrays import (
    CANCELLED,
    DONE,
    MESSAGES,
    SWITCHES,
    Setting,
    State,
    setting_of,
    state_of,
)
from alloc.allocators.online.compiled.loop import run_mission
from alloc.problems import Mission
from alloc.problems.fields import FloatArray
from alloc.problems.vocabulary import Knowledge


@dataclass(frozen=True)
class FastResult:
    """Measures of a mission, as in `MissionResult`.

    Attributes
    ----------
    mission_time : float or None
    priority_done_share : float
    energy, distance : float
    switches, messages : int
    """

    mission_time: float | None
    priority_done_share: float
    energy: float
    distance: float
    switches: int
    messages: int


def run_compiled(
    mission: Mission,
    policy: int,
    weights: FloatArray | None = None,
    *,
    knowledge: Knowledge | None = None,
    seed: int = 0,
    rows: int = 0,
) -> tuple[FastResult, State]:
    """Simulate a mission in compiled loops.

    Parameters
    ----------
    mission : Mission
    policy : int
        One of `compiled.policies`.
    weights : ndarray, optional
        For policies that have some.
    knowledge : Knowledge, optional
        As the mission says by default.
    seed : int
    rows : int
        Rows of `State.log` at the most.

    Returns
    -------
    result : FastResult
    state : State
        At the end.

    Raises
    ------
    RefusedError
        If the mission has what the compiled simulation cannot handle.
    """
    setting = setting_of(mission, mission.knowledge if knowledge is None else knowledge, seed)
    state = state_of(setting, rows)
    run_mission(state, setting, policy, np.zeros(0) if weights is None else weights)
    return _measured(setting, state), state


def _measured(setting: Setting, state: State) -> FastResult:
    wanted, done = state.task["became"] != CANCELLED, state.task["became"] == DONE
    total = float(setting.task["priority"][wanted].sum())
    is_done = bool(done[wanted].all())
    return FastResult(
        mission_time=float(state.task["closed"][done].max(initial=0.0)) if is_done else None,
        priority_done_share=float(setting.task["priority"][done].sum()) / total if total else float(is_done),
        energy=float(state.agent["energy"].sum()),
        distance=float(state.agent["distance"].sum()),
        switches=int(state.counts[SWITCHES]),
        messages=int(state.counts[MESSAGES]),
    )
