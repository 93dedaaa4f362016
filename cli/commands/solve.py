"""``alloc solve``."""

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import STANDARD, note, say, to_json
from alloc.cli.output.files import check_outputs, check_picture, check_result, save
from alloc.cli.output.plan import plan_tables
from alloc.problems.vocabulary import Objective

if TYPE_CHECKING:
    from alloc.allocators import Result
    from alloc.problems import Instance

EXAMPLES = examples(
    "alloc solve demo.json",
    "alloc solve demo.json --method ga --time-limit 30 --seed 1 --output best.json",
    "alloc solve demo.json --method ga --set population=200",
    "alloc solve demo.json --method milp --plain",
    "alloc solve demo.json --output plan.html",
    "alloc solve demo.json --objective makespan-energy --plot demo.png",
    "alloc solve demo.json --objective makespan-energy --makespan-slack 0.05",
    "alloc solve demo.json --start best.json --target-gap 0.01",
    "alloc solve demo.json --start best.json --objective makespan-moves --makespan-slack 0.01 --pin a1=t3",
    "alloc generate paper-1 --seed 7 --output - | alloc solve - --method cpsat --json",
    closing="Ctrl-C ends a run as its time limit does: the best allocation so far is printed and saved.",
)

ObjectiveOption = Annotated[
    Objective,
    typer.Option(
        help="What is minimised, after the number of unserved tasks: the makespan, then the energy or the moves."
    ),
]
SlackOption = Annotated[
    float,
    typer.Option(help="With energy or moves: accept makespans this far above the shortest one found; 0.02 is 2 %."),
]
LimitOption = Annotated[
    float | None,
    typer.Option(metavar="TIME", help="With energy or moves: accept makespans up to this.", show_default=False),
]
StartOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        help="A plan to start from, or the plan in force, in any form; agents and tasks now missing are dropped.",
    ),
]
MovePriceOption = Annotated[
    float,
    typer.Option(help="With energy: cost of each agent whose task differs from --start."),
]
PinOption = Annotated[
    list[str] | None,
    typer.Option(metavar="AGENT=TASK", help="Fix the task of an agent, or AGENT= for idle; may be repeated."),
]
PinFileOption = Annotated[
    str | None,
    typer.Option(metavar="FILE", help="Fix the tasks of all agents in this plan; --pin takes precedence."),
]
PlainOption = Annotated[
    bool,
    typer.Option(
        "--plain",
        help="milp, cpsat: run the solver on the plain model, without our searches; short for --set plain=true.",
    ),
]
PolicyOption = Annotated[str | None, typer.Option(metavar="FILE", help="A trained policy, for learned methods.")]
DeviceOption = Annotated[str | None, typer.Option(help="Device of learned methods: cpu or cuda.", show_default="cpu")]
OutputOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        help="Write the result here: .json, .csv, .xlsx, .geojson or .html (a map); - is JSON on standard output.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("solve", epilog=EXAMPLES)(solve_command)


def solve_command(
    instance: options.InstanceArgument,
    method: options.MethodOption = "auto",
    objective: ObjectiveOption = Objective.MAKESPAN,
    time_limit: options.TimeLimitOption = None,
    iterations: options.IterationsOption = None,
    target_gap: options.TargetGapOption = None,
    makespan_slack: SlackOption = 0.0,
    makespan_limit: LimitOption = None,
    seed: options.SeedOption = 0,
    start: StartOption = None,
    pin: PinOption = None,
    pin_file: PinFileOption = None,
    move_price: MovePriceOption = 0.0,
    settings: options.SettingsOption = None,
    plain: PlainOption = False,
    policy: PolicyOption = None,
    threads: options.ThreadsOption = None,
    device: DeviceOption = None,
    output: OutputOption = None,
    plot: options.PlotOption = None,
    json: options.JsonOption = False,
    quiet: options.QuietOption = False,
) -> None:
    """Allocate the agents of one instance to its tasks."""
    from alloc.allocators import solve
    from alloc.cli.output.progress import Progress
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance

    read = [("INSTANCE", instance), ("--policy", policy), ("--pin-file", pin_file)]
    check_outputs(("--output", output), ("--plot", plot), read=read)
    check_picture(plot)
    check_result(output)
    if [instance, start, pin_file].count(STANDARD) > 1:
        raise InputError("can be only one of instance, --start and --pin-file", source="standard input")
    problem = read_instance(instance)
    check_result(output, problem)
    with Progress(not quiet, problem.units.time, problem.units.energy) as progress:
        result = solve(
            problem,
            method,
            objective=objective.value,
            time_limit_s=options.time_limit(time_limit, iterations),
            iterations=iterations,
            target_gap=target_gap,
            seed=seed,
            start=None if start is None else _start(problem, start),
            move_price=move_price,
            pins=_pins(problem, pin, pin_file, quiet=quiet),
            threads=threads,
            makespan_slack=makespan_slack,
            makespan_limit=makespan_limit,
            on_improvement=progress.update,
            **{**_settings(settings), **({"plain": True} if plain else {}), "policy": policy, "device": device},
        )
    _save(result, output, plot, json=json, quiet=quiet)
    raise typer.Exit(0 if result.evaluation is not None and not result.evaluation.unserved_tasks else 1)


def _start(problem: "Instance", file: str) -> "dict[str, str | None]":
    """Return the task of each agent in the plan of a file; an error if it has no agent of the instance."""
    from alloc.problems import Allocation, InputError
    from alloc.problems.formats import read_plan
    from alloc.problems.formats.messages import told

    plan = read_plan(file, problem)
    given = plan.assignment()
    try:
        Allocation.carried_over(problem, given)
    except InputError as error:
        raise told(error, plan.source) from error.__cause__
    return given


def _pins(problem: "Instance", pairs: list[str] | None, file: str | None, *, quiet: bool) -> dict[str, str | None]:
    """Return the task of each pinned agent; options take precedence over the file."""
    from alloc.allocators.replanning.pins import parse_pins, read_pins

    pins, left_out = ({}, None) if file is None else read_pins(problem, file)
    if left_out is not None and not quiet:
        note(left_out)
    return pins | parse_pins(problem, pairs or ())


def _settings(settings: list[str] | None) -> dict[str, Any]:
    """Return the parameters of the method; raise an error for names that have an option of their own."""
    from inspect import signature

    from alloc.allocators import solve

    found = options.values(settings)
    for name in found:
        if name in ("policy", "device", *signature(solve).parameters):
            raise typer.BadParameter(f"{name!r} is not a parameter of a method but an option", param_hint="'--set'")
    return found


def _save(result: "Result", output: str | None, plot: str | None, *, json: bool, quiet: bool) -> None:
    """Write, print and draw the result as requested."""
    then: list[Callable[[], object]] = [] if quiet else [lambda: _tell(result, summary=not json)]
    if plot is not None:
        from alloc.allocators import plotting

        then.append(lambda: plotting.plot(result, plot))
    text = cache(lambda: to_json(result.to_dict()))
    save(text, output, text if json else None, then, None if output is None else _content(result, output))


def _content(result: "Result", output: str) -> Callable[[], bytes] | None:
    """Return a function that makes the content of the output file; None if it is JSON, as printed."""
    from alloc.allocators.plan.files import JSON, content, suffix_of

    suffix = suffix_of(output)
    return None if suffix == JSON else lambda: content(result, suffix)


def _tell(result: "Result", *, summary: bool) -> None:
    if summary:
        for part in plan_tables(result):
            say(f"{part}\n")
        say(str(result))
    for line in result.notes:
        note(line)
    _doubt(result)
    if not summary and result.evaluation is not None and result.evaluation.reward_saturated:
        note("the reward (3) overflows and is given as the most negative float")


def _doubt(result: "Result") -> None:
    """Print the first finding that may be a mistake in the instance."""
    from alloc.problems.diagnosis.plausibility import findings

    found = findings(result.instance)
    if found:
        more = f"; `alloc validate` lists {len(found) - 1} more" if len(found) > 1 else ""
        note(f"{found[0].field}: {found[0].message}{more}")
