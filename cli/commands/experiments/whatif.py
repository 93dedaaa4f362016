"""``alloc whatif``."""

import sys
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import is_terminal, note, say, table, to_json
from alloc.cli.output.files import check_outputs, check_picture, save
from alloc.problems.text import counted, heading, number, percent

if TYPE_CHECKING:
    from alloc.allocators import Fleet, WhatIf

EXAMPLES = examples(
    'alloc whatif demo.json --add "like a2"',
    'alloc whatif demo.json --add "like a2" --up-to 5 --time-limit 2 --plot fleets.png',
    "alloc whatif demo.json --remove a7 --remove a8",
    'alloc whatif demo.json --remove a7 --add "like a2" --up-to 3 --objective makespan-energy --json',
    closing="Each fleet is solved starting from the plan of the next smaller one. Ctrl-C ends the run in progress; the "
    "fleets so far are printed and saved.",
)

LIKE = "like "

MAX_NAMES = 3
"""Ids of agents that a row of the table lists; more are given as a number."""


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("whatif", epilog=EXAMPLES)(whatif_command)


def whatif_command(
    instance: options.InstanceArgument,
    add: Annotated[
        list[str] | None,
        typer.Option(metavar='"like ID"', help="Add a copy of this agent per step; may be repeated."),
    ] = None,
    up_to: Annotated[int, typer.Option(min=1, max=10_000, help="Number of steps.")] = 1,
    remove: Annotated[list[str] | None, typer.Option(metavar="ID", help="Remove this agent; may be repeated.")] = None,
    method: options.MethodOption = "auto",
    objective: options.ObjectiveOption = options.PlainObjective.MAKESPAN,
    time_limit: Annotated[
        float | None,
        typer.Option(help="Seconds for each fleet.", show_default="10; none if --iterations is given"),
    ] = None,
    iterations: Annotated[int | None, typer.Option(min=0, help="Iterations for each fleet.")] = None,
    seed: options.SeedOption = 0,
    threads: options.ThreadsOption = None,
    output: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the fleets here as JSON; - is standard output.")
    ] = None,
    plot: options.PlotOption = None,
    json: options.JsonOption = False,
    quiet: options.QuietOption = False,
) -> None:
    """Show the effect of more or fewer agents.

    It prints makespan, energy and bounds by fleet size.
    """
    from alloc.allocators import whatif
    from alloc.problems import read_instance

    check_outputs(("--output", output), ("--plot", plot), read=[("INSTANCE", instance)])
    check_picture(plot)
    found = whatif(
        read_instance(instance),
        [_model(text) for text in add or ()],
        up_to=up_to,
        remove=remove or (),
        method=method,
        objective=objective.value,
        time_limit_s=options.time_limit(time_limit, iterations),
        iterations=iterations,
        seed=seed,
        threads=threads,
        on_fleet=None if quiet else _show_fleet,
    )
    then: list[Callable[[], object]] = [] if quiet else [lambda: _tell(found, with_table=not json)]
    if plot is not None:
        from alloc.allocators.plotting import plot_whatif

        then.append(lambda: plot_whatif(found, plot))
    text = cache(lambda: to_json(found.to_dict()))
    save(text, output, text if json else None, then)
    raise typer.Exit(0 if all(fleet.result.makespan is not None for fleet in found.fleets) else 1)


def _model(text: str) -> str:
    """Return the id in ``like ID``."""
    if not text.startswith(LIKE):
        raise typer.BadParameter(f'must be "like ID", as in --add "like a2", got {text!r}', param_hint="'--add'")
    return text.removeprefix(LIKE).strip()


def _show_fleet(fleet: "Fleet") -> None:
    """On a terminal, print each fleet as soon as it is solved; the table follows at the end."""
    if is_terminal(sys.stderr):
        result = fleet.result
        left = result.unserved_count
        makespan = f"{counted(left, 'task')} unserved" if left else f"makespan {number(result.makespan)}"
        say(f"{result.instance.n} agents: {makespan}, gap {percent(result.gap)}")


def _tell(found: "WhatIf", *, with_table: bool) -> None:
    if with_table:
        say(_table(found))
        say(f"\n{found.answer[0].upper()}{found.answer[1:]}.")
    told = {line.partition(":")[0]: line for fleet in reversed(found.fleets) for line in fleet.result.notes}
    for line in told.values():  # auto's choice is printed once per method
        note(line)


def _table(found: "WhatIf") -> str:
    units = found.instance.units
    header = ["agents", "change", heading("makespan", units.time), "change", "at least", "gap"]
    header += [heading("energy", units.energy), "at least", "time (s)", "status"]
    now = found.fleets[0].result.makespan
    unserved = [fleet.result.unserved_count for fleet in found.fleets]
    if any(unserved):
        header.insert(2, "unserved")
    rows = [
        [
            str(fleet.result.instance.n),
            _changes(fleet),
            *([str(left)] if any(unserved) else []),
            number(fleet.result.makespan, 5),
            _against(fleet.result.makespan, now),
            number(fleet.result.lower_bound, 5),
            percent(fleet.result.gap),
            number(fleet.result.energy, 5),
            number(fleet.result.energy_lower_bound, 5),
            number(fleet.result.runtime_s, 3),
            str(fleet.result.status),
        ]
        for fleet, left in zip(found.fleets, unserved, strict=True)
    ]
    return table(header, rows, left=0)


def _changes(fleet: "Fleet") -> str:
    """Return the agents that a fleet lacks and has in addition, such as ``-d7 +2``."""
    less = [f"-{name}" for name in fleet.removed] if len(fleet.removed) <= MAX_NAMES else [f"-{len(fleet.removed)}"]
    return " ".join([*less, *([f"+{len(fleet.added)}"] if fleet.added else [])]) or "as it is"


def _against(value: float | None, base: float | None) -> str:
    """Return the relative change of a makespan from that of the current fleet."""
    if value is None or base is None or value == base:
        return "-"
    return f"{100 * (value / base - 1):+.3g} %"
