"""``alloc validate``."""

from typing import TYPE_CHECKING, TypedDict

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import complain, note, say, write_json
from alloc.problems.text import counted, labelled, number, percent

if TYPE_CHECKING:
    from alloc.problems import Instance

EXAMPLES = examples(
    "alloc validate demo.json",
    "alloc validate instances/*.json",
    "alloc validate demo.npz --json",
    closing="Exit code 2 if a file is no valid instance; one line says where and how to correct it.",
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
    instances: options.InstancesArgument,
    json: options.JsonOption = False,
) -> None:
    """Check instances, and print a summary of each, and what may not be meant."""
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance

    facts: list[Facts] = []
    wrong = 0
    for name in instances:
        try:
            instance = read_instance(name)
            facts.append(_facts(name, instance))
        except InputError as error:
            wrong += 1
            complain(str(error))
            continue
        if not json:
            say(_words(facts[-1], instance.units.time))
            for finding in facts[-1]["findings"]:
                note(f"{name}: {finding['field']}: {finding['message']}")
    if json and facts:
        write_json(facts)
    raise typer.Exit(2 if wrong else 0)


def _facts(file: str, instance: "Instance") -> Facts:
    from dataclasses import asdict

    from alloc.problems import fewest_unserved, makespan_lower_bound
    from alloc.problems.diagnosis.plausibility import findings, priority_without_effect

    unserved = fewest_unserved(instance)
    doubts = [*findings(instance)]
    idle = None if unserved else priority_without_effect(instance)
    return {
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
        "findings": [asdict(one) for one in doubts + ([] if idle is None else [idle])],
    }


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
