"""``alloc validate``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict

import typer

from alloc.cli import options
from alloc.cli.commands.missions.validate import Checked, checked_log, checked_mission
from alloc.cli.options import examples
from alloc.cli.output.console import complain, note, say, write_json
from alloc.problems.text import counted, labelled, number, percent

if TYPE_CHECKING:
    from alloc.problems import InputError, Instance

EXAMPLES = examples(
    "alloc validate demo.json",
    "alloc validate instances/*.json",
    "alloc validate demo.npz --json",
    "alloc validate mission.json run.jsonl",
    closing="Exit code 2 if a file is not valid; one line says where and how to correct it, for missions one line per "
    "error. A log is valid if replaying its orders gives the same log.",
)


class Facts(TypedDict):
    """One entry of the JSON."""

    file: str
    name: str
    agents: int
    tasks: int
    total_ability: float
    total_workload: float
    reach_density: float
    travel_time: bool
    fewest_unserved: int
    lower_bound: float | None
    findings: list[dict[str, str]]


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("validate", epilog=EXAMPLES)(validate_command)


def validate_command(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE...", help=f"Instances or missions, each {options.READABLE}; or logs of missions, .jsonl."
        ),
    ],
    json: options.JsonOption = False,
) -> None:
    """Check instances, missions and logs.

    A summary of each and possible mistakes are printed.
    """
    facts: list[dict[str, object]] = []
    for name in files:
        found, faults = _checked(name)
        for fault in faults:
            complain(str(fault))
        if found is not None:
            facts.append(found.facts)
            if not json:
                say(found.words)
                for finding in found.findings:
                    note(f"{name}: {finding.field}: {finding.message}")
    if json and facts:
        write_json(facts)
    raise typer.Exit(0 if len(facts) == len(files) else 2)


def _checked(name: str) -> "tuple[Checked | None, list[InputError]]":
    """Return the content of a valid file, or its errors."""
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance
    from alloc.problems.formats.files import is_stream, named, read_text
    from alloc.problems.formats.messages import told

    try:
        if is_stream(name) or Path(name).suffix.lower() in (".json", ".jsonl"):
            found, faults = _of_text(name, read_text(name))
            return found, [told(fault, named(name)) for fault in faults]
        return _checked_instance(name, read_instance(name)), []
    except InputError as error:
        return None, [told(error, named(name))]


def _of_text(name: str, text: str) -> "tuple[Checked | None, list[InputError]]":
    from alloc.problems.formats import from_document, json_text
    from alloc.problems.formats.columns import DEFAULT_NAME
    from alloc.problems.formats.files import is_stream
    from alloc.problems.formats.instance_file import name_of
    from alloc.problems.missions.files.document import MISSION_FORMAT
    from alloc.problems.missions.files.faults import mission_faults
    from alloc.problems.missions.files.log_file import is_log

    if is_log(text) or Path(name).suffix.lower() == ".jsonl":
        return checked_log(name, text), []
    document, title = json_text.parse(text), DEFAULT_NAME if is_stream(name) else name_of(name)
    if not isinstance(document, dict) or document.get("format") != MISSION_FORMAT:
        return _checked_instance(name, from_document(document, default_name=title)), []
    mission, faults = mission_faults(document, default_name=title)
    return None if mission is None else checked_mission(name, mission), faults


def _checked_instance(file: str, instance: "Instance") -> Checked:
    from dataclasses import asdict

    from alloc.problems import fewest_unserved, makespan_lower_bound
    from alloc.problems.diagnosis.plausibility import findings, priority_without_effect

    unserved = fewest_unserved(instance)
    idle = None if unserved else priority_without_effect(instance)
    doubts = [*findings(instance), *([] if idle is None else [idle])]
    facts: Facts = {
        "file": file,
        "name": instance.name,
        "agents": instance.n,
        "tasks": instance.m,
        "total_ability": float(instance.ability.sum()),
        "total_workload": float(instance.workload.sum()),
        "reach_density": instance.reach.density,
        "travel_time": instance.has_travel_time,
        "fewest_unserved": unserved,
        "lower_bound": makespan_lower_bound(instance) if unserved == 0 else None,
        "findings": [asdict(one) for one in doubts],
    }
    return Checked({**facts}, _words(facts, instance.units.time), doubts)


def _words(fact: Facts, unit: str) -> str:
    served = "every task can be served"
    if fact["fewest_unserved"]:
        served = f"at least {fact['fewest_unserved']} of the tasks cannot be served"
    bound = "" if fact["lower_bound"] is None else f", makespan at least {labelled(number(fact['lower_bound']), unit)}"
    return (
        f"{fact['file']}: ok, {counted(fact['agents'], 'agent')} with ability {number(fact['total_ability'])} in all,"
        f" {counted(fact['tasks'], 'task')} with workload {number(fact['total_workload'])},"
        f" an agent reaches {percent(fact['reach_density'])} of the tasks, {served}{bound}"
    )
