"""``alloc pareto``."""

import sys
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import is_terminal, note, say, table, to_json
from alloc.cli.output.files import check_outputs, check_picture, read_known, save
from alloc.problems.text import counted, heading, labelled, number, percent

if TYPE_CHECKING:
    from alloc.allocators import Result
    from alloc.allocators.pareto import Front

EXAMPLES = examples(
    "alloc pareto demo.json",
    "alloc pareto demo.json --points 20 --time-limit 5 --plot front.png --output front.json",
    "alloc pareto demo.json --start front.json --time-limit 60 --output front.json",
    "alloc pareto demo.json --method milp --json",
    closing="Ctrl-C ends the run in progress; the front so far is printed and saved.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("pareto", epilog=EXAMPLES)(pareto_command)


def pareto_command(
    instance: options.InstanceArgument,
    method: Annotated[
        str,
        typer.Option(
            autocompletion=options.complete_methods, help="A method that supports slack (see `alloc methods`), or auto."
        ),
    ] = "auto",
    points: Annotated[int, typer.Option(min=1, max=10_000, help="Number of runs, one per point of the front.")] = 10,
    time_limit: options.TimeLimitOption = None,
    iterations: options.IterationsOption = None,
    seed: options.SeedOption = 0,
    start: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="An allocation, a result or an earlier front to start from."),
    ] = None,
    threads: options.ThreadsOption = None,
    output: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the front here as JSON; - is standard output.")
    ] = None,
    plot: options.PlotOption = None,
    json: options.JsonOption = False,
    quiet: options.QuietOption = False,
) -> None:
    """Trace the Pareto front of makespan and energy.

    It shows how much energy it costs to save time.
    """
    from alloc.allocators.pareto import pareto

    check_outputs(("--output", output), ("--plot", plot), read=[("INSTANCE", instance)])
    check_picture(plot)
    problem, starts = read_known(instance, start, quiet=quiet)
    front = pareto(
        problem,
        method,
        points=points,
        time_limit_s=options.time_limit(time_limit, iterations),
        iterations=iterations,
        seed=seed,
        starts=starts,
        threads=threads,
        on_point=None if quiet else _show_point,
    )
    then: list[Callable[[], object]] = [] if quiet else [lambda: _tell(front, with_table=not json)]
    if plot is not None:
        from alloc.allocators.plotting import plot_front

        then.append(lambda: plot_front(front, plot))
    text = cache(lambda: to_json(front.to_dict()))
    save(text, output, text if json else None, then)
    raise typer.Exit(0 if front.points and front.points[0].makespan is not None else 1)


def _tell(front: "Front", *, with_table: bool) -> None:
    if with_table:
        say(_table(front))
    for line in dict.fromkeys(line for result in front.points for line in result.notes):
        note(line)


def _show_point(result: "Result") -> None:
    """On a terminal, print a point as soon as it is computed; the table follows at the end."""
    if is_terminal(sys.stderr):
        makespan = labelled(number(result.makespan), result.instance.units.time)
        makespan = f"{counted(left, 'task')} unserved" if (left := result.unserved_count) else f"T {makespan}"
        energy = labelled(number(result.energy), result.instance.units.energy)
        say(f"{makespan}, energy {energy}, gap {percent(result.energy_gap)}")


def _table(front: "Front") -> str:
    units = front.instance.units
    left = [result.unserved_count for result in front.points]
    served = [result.served_makespan for result in front.points]
    header = [
        heading("T of the served" if any(left) else "T", units.time),
        "slower",
        heading("energy", units.energy),
        "saved",
        "at least",
        "gap",
    ]
    header += ["time (s)", "method", "status"]
    if any(left):
        header.insert(0, "unserved")
    fastest = front.points[0]
    rows = [
        [
            *([str(unserved)] if any(left) else []),
            number(makespan, 5),
            _change(makespan, served[0]),
            number(result.energy, 5),
            _change(fastest.energy, result.energy, of=fastest.energy),
            number(result.energy_lower_bound, 5),
            percent(result.energy_gap),
            number(result.runtime_s, 3),
            result.method,
            str(result.status),
        ]
        for result, makespan, unserved in zip(front.points, served, left, strict=True)
    ]
    return table(header, rows, left=0)


def _change(value: float | None, base: float | None, of: float | None = None) -> str:
    """Return ``value - base`` as a percentage of `of`, by default of `base`."""
    whole = base if of is None else of
    if value is None or base is None or not whole:
        return "-"
    return percent((value - base) / whole)
