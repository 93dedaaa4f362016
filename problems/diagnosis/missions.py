"""Plausibility checks of missions: data that are valid but may be mistakes."""

from collections.abc import Iterator

import numpy as np

from alloc.problems.diagnosis.plausibility import Finding, findings, named
from alloc.problems.missions.mission import Mission
from alloc.problems.text import counted, number
from alloc.problems.vocabulary import Knowledge


def mission_findings(mission: Mission) -> tuple[Finding, ...]:
    """Return the possible mistakes in a mission, those in its instance first.

    Parameters
    ----------
    mission : Mission

    Returns
    -------
    tuple of Finding
    """
    # in a mission, agents do several tasks, and identical agents differ later
    of_instance = [finding for finding in findings(mission.instance) if finding.field != "agents"]
    checks = (_too_short, _beyond_the_horizon, _sensing)
    return (*of_instance, *(finding for check in checks for finding in check(mission)))


def _too_short(mission: Mission) -> Iterator[Finding]:
    """Find tasks that all agents together could not do between appearance and deadline."""
    fastest = float(mission.instance.ability.sum()) * (mission.pace.high if mission.pace else 1.0)
    lost = mission.appears + mission.instance.workload / fastest > mission.deadline
    changed = {event.task for event in mission.events if event.workload is not None}
    lost &= np.array([name not in changed for name in mission.instance.task_ids])
    if lost.any():
        whom = named(lost, mission.instance.task_ids, "task")
        yield Finding("deadline", f"{whom} cannot be done in time, even by all agents at once and without flights")


def _beyond_the_horizon(mission: Mission) -> Iterator[Finding]:
    """Find events after the end of the mission."""
    late = sum(event.hour > mission.horizon for event in mission.timeline)
    if late:
        yield Finding(
            "horizon", f"is hour {number(mission.horizon)}, before {counted(late, 'event')} that never happen"
        )


def _sensing(mission: Mission) -> Iterator[Finding]:
    """Find a sensing radius that has no effect, as agents have full knowledge."""
    if mission.sensing < np.inf and mission.knowledge is Knowledge.FULL:
        yield Finding(
            "sensing", 'has no effect with full knowledge; with "knowledge": "local" agents know what they see'
        )
