"""``alloc compare --policies``: policies in missions, as a part of ``alloc compare``."""

import threading
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from alloc.cli.output.console import note, say, table
from alloc.cli.output.rows import show_done, write_rows
from alloc.problems.text import heading, labelled, number, percent
from alloc.problems.vocabulary import Knowledge

if TYPE_CHECKING:
    from alloc.allocators.experiments.differences import Interval, PolicyDifference
    from alloc.allocators.experiments.policies import PolicyRow
    from alloc.problems import Units

Listed = Mapping[str, tuple[str, dict[str, object] | None]]
"""Name and parameters of each policy, by how it is written."""


def compare_missions(
    files: Sequence[str],
    policies: Listed,
    seeds: list[int],
    knowledge: Knowledge | None,
    deadline_ms: float | None,
    csv: str | None,
    *,
    json: bool,
) -> int:
    """Let the policies lead all missions, print the rows, and return the exit code."""
    from alloc.allocators import describe_policy, load_policy
    from alloc.allocators.experiments.differences import paired_differences
    from alloc.allocators.experiments.policies import compare_policies
    from alloc.allocators.runtime.interrupts import signals_set
    from alloc.problems import read_mission
    from alloc.problems.units import common_units

    for name, _ in policies.values():
        describe_policy(name)
    leaders = {
        label: name if settings is None else load_policy(name, **settings)
        for label, (name, settings) in policies.items()
    }
    missions, deadline = [read_mission(file) for file in files], deadline_ms or None
    units = common_units([mission.instance.units for mission in missions])
    stop, rows, total = threading.Event(), list["PolicyRow"](), len(missions) * len(leaders)
    with signals_set(stop):
        for row in compare_policies(missions, leaders, seeds, knowledge=knowledge, deadline_ms=deadline, stop=stop):
            rows.append(row)
            show_done(f"{row.mission}, {row.policy}: {_outcome(row, units)}", len(rows), total)
    differences = paired_differences(rows)
    document: dict[str, object] = {
        "format": "alloc-mission-comparison/1",
        "rows": [row.to_dict() for row in rows],
        "differences": [one.to_dict() for one in differences],
    }
    write_rows(document, _columns(), csv, lambda: _tell(rows, differences, units), json=json)
    if stop.is_set():
        note(f"interrupted after {len(rows)} of {total} rows")
    complete = len(rows) == total and all(row.reason or row.runs == len(seeds) for row in rows)
    done = any(row.runs for row in rows) and all(row.statuses in ("done", "") for row in rows)
    return 0 if complete and done else 1


def _outcome(row: "PolicyRow", units: "Units") -> str:
    time = labelled(number(row.mission_time_mean), units.time)
    return row.reason or f"mission time {time}, done {percent(row.tasks_done_share)}"


def _tell(rows: "list[PolicyRow]", differences: "list[PolicyDifference]", units: "Units") -> None:
    header = ["mission", "policy", heading("time", units.time), "worst", "done", "priority done"]
    header += [heading("energy", units.energy), "switches", "messages", "ms/decision", "worst", "runs", "status"]
    say(table(header, [_cells(row) for row in rows], left=2))
    for row in rows:
        if row.reason:
            note(f"{row.mission}, {row.policy}: {row.reason}")
    late = sum(row.decisions_late for row in rows)
    if late:
        note(f"{late} decisions came after the deadline and were not followed; see --deadline-ms")
    if differences:
        say(f"\nAgainst {differences[0].against}, in the same missions with the same seeds (95 % interval):")
        header = ["policy", "time", "interval", "pairs", "energy", "interval", "priority done", "interval", "pairs"]
        say(table(header, [_difference(one) for one in differences]))


def _cells(row: "PolicyRow") -> list[str]:
    return [
        row.mission,
        row.policy,
        number(row.mission_time_mean, 5),
        number(row.mission_time_worst, 5),
        percent(row.tasks_done_share),
        percent(row.priority_done_share),
        number(row.energy_mean, 4),
        number(row.switches_mean, 4),
        number(row.messages_mean, 4),
        number(row.decision_ms_mean, 3),
        number(row.decision_ms_worst, 3),
        str(row.runs),
        "no figures, see below" if row.reason else row.statuses,
    ]


def _difference(one: "PolicyDifference") -> list[str]:
    return [
        one.policy,
        *_interval(one.mission_time),
        str(one.mission_time.pairs),
        *_interval(one.energy),
        *_interval(one.priority_done_share),
        str(one.priority_done_share.pairs),
    ]


def _interval(interval: "Interval") -> list[str]:
    """Return the mean and the two ends in per cent, dashes for what is not known."""
    if interval.mean is None:
        return ["-", "-"]
    mean = f"{_percent(interval.mean)} %"
    if interval.low is None or interval.high is None:
        return [mean, "-"]
    return [mean, f"{_percent(interval.low)} to {_percent(interval.high)} %"]


def _percent(share: float) -> str:
    return "0" if abs(share) < 5e-7 else f"{100 * share:+.3g}"


def _columns() -> list[str]:
    """Return the columns of the CSV: the names of the fields."""
    from dataclasses import fields

    from alloc.allocators.experiments.policies import PolicyRow

    return [field.name for field in fields(PolicyRow) if field.name != "results"]
