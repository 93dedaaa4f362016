"""``alloc compare --policies``: the part of ``alloc compare`` that compares policies on missions."""

import contextlib
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from alloc.cli.commands.experiments.options import Outputs, StoreOptions
from alloc.cli.commands.experiments.sources import gather_missions
from alloc.cli.commands.experiments.stored import make_missing
from alloc.cli.output.console import note, say, table
from alloc.cli.output.rows import show_done, write_rows
from alloc.problems.text import heading, labelled, number, percent
from alloc.problems.vocabulary import Knowledge

if TYPE_CHECKING:
    from alloc.allocators.experiments.differences import PolicyDifference
    from alloc.allocators.experiments.policies import PolicyRow
    from alloc.allocators.experiments.store.store import Store
    from alloc.allocators.experiments.stored import Comparison
    from alloc.problems import Mission, Units

Listed = Mapping[str, tuple[str, dict[str, object] | None]]
"""Name and parameters of each policy, by its label on the command line."""


@dataclass(frozen=True)
class MissionRuns:
    """Runs of policies: on which missions, with which seeds, and how each is made."""

    sources: Sequence[str]
    policies: Listed
    seeds: Sequence[int]
    knowledge: Knowledge | None
    deadline_ms: float | None


def compare_missions(storage: StoreOptions | None, runs: MissionRuns, outputs: Outputs) -> int:
    """Run the policies on all missions, print the rows, and return the exit code."""
    from alloc.allocators import describe_policy
    from alloc.allocators.experiments.differences import paired_differences
    from alloc.problems.units import common_units

    for name, _ in runs.policies.values():
        describe_policy(name)
    missions = gather_missions(runs.sources)
    units = common_units([mission.instance.units for mission in missions])
    found = _at_once(missions, runs, units) if storage is None else _in_store(storage, missions, runs)
    differences = paired_differences(found.rows)
    document: dict[str, object] = {
        "format": "alloc-mission-comparison/1",
        "rows": [row.to_dict() for row in found.rows],
        "differences": [one.to_dict() for one in differences],
    }
    write_rows(document, _columns(), outputs.csv, lambda: _tell(found.rows, differences, units), json=outputs.json)
    for one in found.notes:
        note(one)
    complete = found.is_complete and all(row.reason or row.runs == len(runs.seeds) for row in found.rows)
    done = any(row.runs for row in found.rows) and all(row.statuses in ("done", "") for row in found.rows)
    return 0 if complete and done else 1


@dataclass(frozen=True)
class _Found:
    """Outcome of a comparison: its rows, whether they are complete, and notes for the user."""

    rows: "list[PolicyRow]"
    is_complete: bool
    notes: list[str]


def _at_once(missions: "list[Mission]", runs: MissionRuns, units: "Units") -> _Found:
    """Make all runs in this process."""
    from alloc.allocators import load_policy
    from alloc.allocators.experiments.policies import compare_policies
    from alloc.allocators.runtime.interrupts import signals_set

    loaded = {
        label: name if settings is None else load_policy(name, **settings)
        for label, (name, settings) in runs.policies.items()
    }
    stop, rows, total = threading.Event(), list["PolicyRow"](), len(missions) * len(loaded)
    with signals_set(stop):
        for row in compare_policies(
            missions, loaded, runs.seeds, knowledge=runs.knowledge, deadline_ms=runs.deadline_ms, stop=stop
        ):
            rows.append(row)
            show_done(f"{row.mission}, {row.policy}: {_outcome(row, units)}", len(rows), total)
    notes = [f"interrupted after {len(rows)} of {total} rows"] if stop.is_set() else []
    return _Found(rows, len(rows) == total, notes)


def _in_store(storage: StoreOptions, missions: "list[Mission]", runs: MissionRuns) -> _Found:
    """Make the runs that are missing in the store, write the reports, and return the rows of all runs."""
    from alloc.allocators import load_policy
    from alloc.allocators.experiments.report.files import write_report
    from alloc.allocators.experiments.report.missions import mission_tables
    from alloc.allocators.experiments.stored_missions import planned_missions, policy_rows
    from alloc.problems import MissingPackageError

    for name, settings in runs.policies.values():
        if settings:
            with contextlib.suppress(MissingPackageError):  # reported by its runs; other errors are raised now
                load_policy(name, **settings)
    variants = {label: (name, settings or {}) for label, (name, settings) in runs.policies.items()}

    def plan(store: "Store", machine: str) -> "Comparison":
        return planned_missions(
            store,
            missions,
            variants,
            runs.seeds,
            knowledge=runs.knowledge,
            deadline_ms=runs.deadline_ms,
            machine=machine,
        )

    stored = make_missing(storage, plan)
    rows = policy_rows(stored.comparison, stored.endings)
    for file in storage.reports:
        write_report(
            file, stored.comparison, stored.endings, partial(mission_tables, stored.comparison, stored.endings, rows)
        )
    return _Found(rows, stored.is_complete, stored.notes)


def _outcome(row: "PolicyRow", units: "Units") -> str:
    time = labelled(number(row.mission_time_mean), units.time)
    return row.reason or f"mission time {time}, done {percent(row.tasks_done_share)}"


def _tell(rows: "list[PolicyRow]", differences: "list[PolicyDifference]", units: "Units") -> None:
    from alloc.allocators.experiments.report.missions import difference_tables

    header = ["mission", "policy", heading("time", units.time), "worst", "done", "priority done"]
    header += [heading("energy", units.energy), "switches", "messages", "ms/decision", "worst", "runs", "status"]
    say(table(header, [_cells(row) for row in rows], left=2))
    for row in rows:
        if row.reason:
            note(f"{row.mission}, {row.policy}: {row.reason}")
    late = sum(row.decisions_late for row in rows)
    if late:
        note(f"{late} decisions missed the deadline and were ignored; see --deadline-ms")
    for found in difference_tables(differences, len({row.number for row in rows})):
        say(f"\n{found.title}\n{table(found.header, found.rows)}")
        for one in found.notes:
            note(one)


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


def _columns() -> list[str]:
    """Return the columns of the CSV: the names of the fields."""
    from dataclasses import fields

    from alloc.allocators.experiments.policies import PolicyRow

    return [field.name for field in fields(PolicyRow) if field.name != "results"]
