"""``alloc solve``."""

from functools import cache
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.options import Objective, examples
from alloc.cli.output.console import note, say, to_json
from alloc.cli.output.files import check_outputs, read_pair, save

if TYPE_CHECKING:
    from alloc.allocators import Result

EXAMPLES = examples(
    "alloc solve demo.json",
    "alloc solve demo.json --method ga --time-limit 30 --seed 1 --output best.json",
    "alloc solve demo.json --objective makespan-energy --plot demo.png",
    "alloc solve demo.json --objective makespan-energy --makespan-slack 0.05",
    "alloc solve demo.json --start best.json --target-gap 0.01",
    "alloc generate paper-1 --seed 7 --output - | alloc solve - --method cpsat --json",
    closing="Ctrl-C ends a run as its time limit does: the best so far is printed and saved.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("solve", epilog=EXAMPLES)(solve_command)


def solve_command(
    instance: options.InstanceArgument,
    method: Annotated[
        str,
        typer.Option(autocompletion=options.complete_methods, help="One of `alloc methods`, or auto, which picks one."),
    ] = "auto",
    objective: options.ObjectiveOption = Objective.MAKESPAN,
    time_limit: options.TimeLimitOption = None,
    iterations: options.IterationsOption = None,
    target_gap: options.TargetGapOption = None,
    makespan_slack: Annotated[
        float,
        typer.Option(min=0, help="With energy: how much slower than the fastest found is as good; 0.02 is 2 %."),
    ] = 0.0,
    makespan_limit: Annotated[
        float | None,
        typer.Option(metavar="HOURS", help="With energy: what is no slower than this is as good.", show_default=False),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Source of all randomness.")] = 0,
    start: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="An allocation or a result to begin with; the answer is never worse."),
    ] = None,
    policy: Annotated[str | None, typer.Option(metavar="FILE", help="A trained policy, for learned methods.")] = None,
    threads: options.ThreadsOption = None,
    device: Annotated[
        str | None, typer.Option(help="Where a learned method computes: cpu or cuda.", show_default="cpu")
    ] = None,
    output: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the result here as JSON; - is standard output.")
    ] = None,
    plot: Annotated[str | None, typer.Option(metavar="FILE", help="Draw the answer as .png or .svg.")] = None,
    json: options.JsonOption = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print no summary, no notes, no progress.")] = False,
) -> None:
    """Allocate the agents of one instance to its tasks."""
    from alloc.allocators import solve
    from alloc.cli.output.progress import Progress

    read = [("INSTANCE", instance), ("--policy", policy)]
    check_outputs(("--output", output), ("--plot", plot), read=read)
    if plot is not None:
        from alloc.allocators.plotting.style import check_plot

        check_plot(plot)
    problem, first, _ = read_pair(instance, start, quiet=quiet)
    with Progress(wanted=not quiet) as progress:
        result = solve(
            problem,
            method,
            objective=objective.value,
            time_limit_s=options.time_limit(time_limit, iterations),
            iterations=iterations,
            target_gap=target_gap,
            seed=seed,
            start=first,
            threads=threads,
            makespan_slack=makespan_slack,
            makespan_limit=makespan_limit,
            on_improvement=progress.update,
            policy=policy,
            device=device,
        )
    then = [] if quiet else [lambda: _tell(result, summary=not json)]
    if plot is not None:
        then.append(lambda: _draw(result, plot))
    text = cache(lambda: to_json(result.to_dict()))
    save(text, output, text if json else None, then)
    raise typer.Exit(0 if result.evaluation is not None and not result.evaluation.unserved_tasks else 1)


def _draw(result: "Result", path: str) -> None:
    from alloc.allocators.plotting.figure import save_plot

    save_plot(result, path)


def _tell(result: "Result", *, summary: bool) -> None:
    if summary:
        say(str(result))
    for line in result.notes:
        note(line)
    if result.evaluation is not None and result.evaluation.reward_saturated:
        note("the reward (3) is too large for a float and stands at its most negative value")
