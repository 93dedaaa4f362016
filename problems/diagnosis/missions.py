"""What about a mission is valid and may still not be what was meant."""

from collections.abc import Iterator

import numpy as np

from alloc.problems.diagnosis.plausibility import Finding, findings, named
from alloc.problems.missions.mission import Mission
from alloc.problems.text import counted, number
from alloc.problems.vocabulary import Knowledge


def mission_findings(mission: Mission) -> tuple[Finding, ...]:
    """Return what about a mission may be a mistake, that of its instance first.

    Parameters
    ----------
    mission : Mission

    Returns
    -------
    tuple of Finding
    """
    # in a mission each agent does one task after the other, and what is alike now differs later
    of_instance = [finding for finding in findings(mission.instance) if finding.field != "agents"]
    checks = (_too_short, _beyond_the_horizon, _sensing)
    return (*of_instance, *(finding for check in checks for finding in check(mission)))


def _too_short(mission: Mission) -> Iterator[Finding]:
    """Tasks that all agents together could not do between appearance and deadline."""
    fastest = float(mission.instance.ability.sum()) * (mission.pace.high if mission.pace else 1.0)
    lost = mission.appears + mission.instance.workload / fastest > mission.deadline
    changed = {event.task for event in mission.events if event.workload is not None}
    lost &= np.array([name not in changed for name in mission.instance.task_ids])
    if lost.any():
        whom = named(lost, mission.instance.task_ids, "task")
        yield Finding("deadline", f"{whom} cannot be done in time, even by all agents at once and without a flight")


def _beyond_the_horizon(mission: Mission) -> Iterator[Finding]:
    """What would happen after the end of the mission."""
    late = sum(event.hour > mission.horizon for event in mission.timeline)
    if late:
        yield Finding(
            "horizon", f"is hour {number(mission.horizon)}, before {counted(late, 'event')} that never happen"
        )


def _sensing(mission: Mission) -> Iterator[Finding]:
    """A sensing radius where everybody knows all."""
    if mission.sensing < np.inf and mission.knowledge is Knowledge.FULL:
        yield Finding(
            "sensing", 'has no effect with full knowledge; with "knowledge": "local" agents know what they see'
        )
