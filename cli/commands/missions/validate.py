"""Missions and logs in ``alloc validate``."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from alloc.problems.text import counted, labelled, number, percent

if TYPE_CHECKING:
    from alloc.problems import Mission
    from alloc.problems.diagnosis.plausibility import Finding


@dataclass(frozen=True)
class Checked:
    """Content of a valid file.

    Attributes
    ----------
    facts : dict
        Its entry in the JSON.
    words : str
        Summary in one line.
    findings : sequence of Finding
        Possible mistakes.
    """

    facts: dict[str, object]
    words: str
    findings: "Sequence[Finding]" = ()


def checked_mission(file: str, mission: "Mission") -> Checked:
    """Return a summary of a mission."""
    from dataclasses import asdict

    from alloc.problems.diagnosis.missions import mission_findings
    from alloc.problems.missions.files.document import MISSION_FORMAT
    from alloc.problems.missions.simulation.measures import lower_bound

    instance, bound = mission.instance, lower_bound(mission)
    ability, work, last = (
        float(value) for value in (instance.ability.sum(), instance.workload.sum(), mission.appears.max())
    )
    deadlines = int((mission.deadline < float("inf")).sum())
    findings = mission_findings(mission)
    facts: dict[str, object] = {
        "file": file,
        "format": MISSION_FORMAT,
        "name": mission.name,
        "agents": instance.n,
        "tasks": instance.m,
        "events": len(mission.events),
        "knowledge": str(mission.knowledge),
        "total_ability": ability,
        "total_workload": work,
        "last_appearance": last,
        "deadlines": deadlines,
        "end": mission.end,
        "mission_time_lower_bound": bound,
        "findings": [asdict(one) for one in findings],
    }
    time = instance.units.time
    at_least = "" if bound is None else f", mission time at least {labelled(number(bound), time)}"
    words = (
        f"{file}: ok, a mission of {counted(instance.n, 'agent')} with ability {number(ability)} in all,"
        f" {counted(instance.m, 'task')} with workload {number(work)}, the last at hour"
        f" {number(last)}, {deadlines} with a deadline, {counted(len(mission.events), 'event')},"
        f" {mission.knowledge} knowledge, ends at hour {number(mission.end)} at the latest{at_least}"
    )
    return Checked(facts, words, findings)


def checked_log(file: str, text: str) -> Checked:
    """Replay a log from its orders, and return a summary of it.

    Raises
    ------
    InputError
        If it is damaged, or does not follow from its orders.
    """
    from alloc.problems import replay
    from alloc.problems.missions.files.log_file import LOG_FORMAT, log_from_text

    log = log_from_text(text)
    result, _ = replay(log)
    facts: dict[str, object] = {
        "file": file,
        "format": LOG_FORMAT,
        "name": result.mission,
        "policy": result.policy,
        "knowledge": result.knowledge,
        "seed": result.seed,
        "records": len(log.records),
        "status": result.status,
        "mission_time": result.mission_time,
        "priority_done_share": result.priority_done_share,
        "findings": [],
    }
    words = (
        f"{file}: ok, a log of {result.mission} under {result.policy} with {counted(len(log.records), 'record')},"
        f" {result.status}, {percent(result.priority_done_share)} of the priority done; its replay is the same"
    )
    return Checked(facts, words)
