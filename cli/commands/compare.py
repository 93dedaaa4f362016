"""``alloc compare``."""

import re
import sys
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import is_terminal, note, say, table, to_json
from alloc.cli.output.files import check_outputs, save
from alloc.problems.text import heading, labelled, number, percent

if TYPE_CHECKING:
    from alloc.allocators import Allocator
    from alloc.allocators.experiments.compare import Row
    from alloc.problems import Units

EXAMPLES = examples(
    "alloc compare demo.json --methods greedy,ga,cpsat",
    "alloc compare instances/*.json --methods ga,gappo --seeds 5 --time-limit 3 --csv table.csv",
    "alloc compare demo.json --methods 'ga[population=40],ga[population=400]' --time-limit 1",
    "alloc compare demo.json --methods milp,gappo --objective makespan-energy --seeds 7,8,9 --json",
    closing="A method that refuses an instance has a row with the reason. Ctrl-C prints the finished rows, with exit "
    "code 1.",
)

BETWEEN_METHODS = re.compile(r",(?![^\[]*\])")
"""A comma outside of brackets."""

BETWEEN_SETTINGS = re.compile(r",(?=\s*\w+=)")
"""A comma before the name of the next parameter; others are part of a value."""


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("compare", epilog=EXAMPLES)(compare_command)


def compare_command(
    instances: options.InstancesArgument,
    methods: Annotated[
        str,
        typer.Option(
            metavar="NAME,NAME,...",
            autocompletion=options.complete_methods,
            help="Methods; see `alloc methods`. Parameters stand in brackets, as in ga[population=200].",
        ),
    ],
    seeds: Annotated[
        str, typer.Option(metavar="SEEDS", help="Seeds such as 0,1,2, or one number N for the seeds 0 to N - 1.")
    ] = "1",
    objective: options.ObjectiveOption = options.PlainObjective.MAKESPAN,
    time_limit: options.TimeLimitOption = None,
    iterations: options.IterationsOption = None,
    target_gap: options.TargetGapOption = None,
    threads: options.ThreadsOption = None,
    csv: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the table here as CSV; - is standard output.")
    ] = None,
    json: options.JsonOption = False,
) -> None:
    """Run several methods on several instances and seeds, and print a table."""
    from alloc.allocators import Budget
    from alloc.allocators.experiments.compare import compare, share_bounds
    from alloc.allocators.runtime.interrupts import signals_set
    from alloc.problems.formats import is_standard_output, read_instance

    check_outputs(("--csv", csv), read=[("INSTANCE", instance) for instance in instances])
    if json and csv is not None and is_standard_output(csv):
        raise typer.BadParameter("and --json cannot both be standard output", param_hint="'--csv'")
    wanted, numbers = _methods(methods), _seeds(seeds)
    limit = options.time_limit(time_limit, iterations)
    Budget(limit, iterations, target_gap)
    problems = [read_instance(instance) for instance in instances]
    units = _common_units([problem.units for problem in problems])
    stop, rows, total = threading.Event(), [], len(problems) * len(wanted)
    with signals_set(stop):
        for row in compare(
            problems,
            wanted,
            numbers,
            objective=objective.value,
            time_limit_s=limit,
            iterations=iterations,
            target_gap=target_gap,
            threads=threads,
            stop=stop,
        ):
            rows.append(row)
            _show_done(row, len(rows), total, units.time)
    _print(share_bounds(rows), csv, units, json=json)
    if stop.is_set():
        note(f"interrupted after {len(rows)} of {total} rows")
    complete = len(rows) == total and all(row.reason or row.runs == len(numbers) for row in rows)
    served = any(row.runs for row in rows) and not any(row.unserved for row in rows)
    raise typer.Exit(0 if complete and served else 1)


def _methods(text: str) -> "dict[str, str | Allocator]":
    """Return the methods by how they are written; those with parameters in brackets are loaded with them."""
    from alloc.allocators import describe, load

    found: dict[str, str | Allocator] = {}
    for label in dict.fromkeys(part.strip() for part in BETWEEN_METHODS.split(text) if part.strip()):
        name, bracket, settings = label.partition("[")
        if bracket and not settings.endswith("]"):
            raise typer.BadParameter(f"{label!r} must be like ga[population=200]", param_hint="'--methods'")
        if name != "auto":
            describe(name)
        found[label] = load(name, **options.values(BETWEEN_SETTINGS.split(settings[:-1]))) if bracket else name
    if not found:
        raise typer.BadParameter("names no method; see `alloc methods`", param_hint="'--methods'")
    return found


def _seeds(text: str) -> list[int]:
    """``3`` is 0, 1, 2; ``3,`` is 3 alone."""
    parts = [part.strip() for part in text.split(",")]
    parts = parts if parts[-1] else parts[:-1]
    if not parts or not all(part.isdecimal() and len(part) < 19 for part in parts):
        raise typer.BadParameter(f"{text!r} is neither a number nor a list such as 0,1,2", param_hint="'--seeds'")
    if "," in text:
        return list(dict.fromkeys(int(part) for part in parts))
    if not 1 <= int(text) <= 100_000:
        raise typer.BadParameter(f"{text} seeds; must be 1 to 100000", param_hint="'--seeds'")
    return list(range(int(text)))


def _common_units(units: "Sequence[Units]") -> "Units":
    """Return the labels on which all instances agree."""
    from dataclasses import fields

    from alloc.problems import Units

    labels = {field.name: {getattr(one, field.name) for one in units} for field in fields(Units)}
    return Units(**{name: found.pop() for name, found in labels.items() if len(found) == 1})


def _show_done(row: "Row", count: int, total: int, unit: str) -> None:
    """On a terminal, print each row as soon as it is known; the table follows at the end."""
    if is_terminal(sys.stderr):
        outcome = row.reason or f"T {labelled(number(row.makespan_mean), unit)}, gap {percent(row.gap_mean)}"
        say(f"[{count}/{total}] {row.instance}, {row.method}: {outcome}")


def _print(rows: "list[Row]", csv: str | None, units: "Units", *, json: bool) -> None:
    from alloc.problems.formats import is_standard_output

    def document() -> str:
        return to_json({"format": "alloc-comparison/1", "rows": [row.to_dict() for row in rows]})

    is_table_wanted = not json and not (csv is not None and is_standard_output(csv))
    save(lambda: _csv(rows), csv, document if json else None, [lambda: _tell(rows, units)] if is_table_wanted else [])


def _tell(rows: "list[Row]", units: "Units") -> None:
    header = ["instance", "method", heading("T", units.time), "worst", "gap", "worst"]
    header += [heading("energy", units.energy), "time (s)", "worst", "runs", "status"]
    say(table(header, [_cells(row) for row in rows], left=2))
    for row in rows:
        if row.reason:
            note(f"{row.instance}: {row.reason}")


def _cells(row: "Row") -> list[str]:
    status = "no figures, see below" if row.reason else row.statuses
    if row.unserved:
        status += f", {row.unserved} unserved"
    return [
        row.instance,
        f"{row.method} ({row.picked})" if row.picked else row.method,
        number(row.makespan_mean, 5),
        number(row.makespan_worst, 5),
        percent(row.gap_mean),
        percent(row.gap_worst),
        number(row.energy_mean, 4),
        number(row.runtime_mean_s, 3),
        number(row.runtime_worst_s, 3),
        str(row.runs),
        status,
    ]


def _csv(rows: "list[Row]") -> str:
    """Return a header with the names of the fields, and a line per row; None is empty."""
    import csv
    import io
    from dataclasses import fields

    from alloc.allocators.experiments.compare import Row

    text = io.StringIO()
    names = [field.name for field in fields(Row) if field.name != "makespans"]
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(row.to_dict() for row in rows)
    return text.getvalue()
