"""``alloc simulate``."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import STANDARD, note, say, to_json
from alloc.cli.output.files import check_film, check_outputs, check_picture, save
from alloc.problems.vocabulary import Knowledge

if TYPE_CHECKING:
    from alloc.allocators import MissionRun, Policy
    from alloc.problems import Course, Mission, MissionLog, MissionResult

EXAMPLES = examples(
    "alloc simulate mission.json --policy nearest",
    "alloc simulate mission.json --policy greedy --knowledge local --seed 3 --log run.jsonl",
    "alloc simulate mission.json --policy replan --set method=greedy --knowledge full --json",
    "alloc simulate mission.json --policy greedy --plot run.png --animate run.html",
    "alloc simulate mission.json --policy auction --runs 10 --json",
    "alloc generate mission --seed 7 --output - | alloc simulate - --policy hedonic",
    closing="Exit code 0 if all tasks are done in all runs, 1 if not. An instance is a mission without "
    "events. Ctrl-C and SIGTERM end --runs; complete ones are printed, with exit code 1.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("simulate", epilog=EXAMPLES)(simulate_command)


def simulate_command(
    mission: Annotated[
        str, typer.Argument(metavar="MISSION", help="A mission as .json, - for standard input, or an instance.")
    ],
    policy: Annotated[
        str,
        typer.Option(
            autocompletion=options.complete_policies,
            help=f"The policy: {', '.join(options.BUILT_IN_POLICIES)}, or a plugin.",
        ),
    ],
    knowledge: Annotated[
        Knowledge | None, typer.Option(help="What agents know.", show_default="as the mission says")
    ] = None,
    seed: options.SeedOption = 0,
    runs: Annotated[int, typer.Option(min=1, help="Runs, with consecutive seeds.")] = 1,
    deadline_ms: Annotated[
        float,
        typer.Option(min=0, help="Milliseconds per decision; late answers are ignored. 0 for no limit."),
    ] = 100.0,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A parameter of the policy; may be repeated."),
    ] = None,
    log: Annotated[str | None, typer.Option(metavar="FILE", help="Write a log of the run as JSON lines.")] = None,
    plot: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Draw tracks, tasks, work, messages and agents: .png, .svg, .pdf."),
    ] = None,
    animate: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Animate the mission as a page, .html, or a film: .gif, .mp4."),
    ] = None,
    json: options.JsonOption = False,
    quiet: options.QuietOption = False,
) -> None:
    """Simulate a mission with a policy that gives the orders.

    Allocation continues over time as tasks appear and are done, and agents fail and join.
    """
    from alloc.allocators import simulate
    from alloc.problems import Recorder, read_mission

    check_files(mission, runs, {"--log": log, "--plot": plot, "--animate": animate})
    if log == STANDARD and json:
        raise typer.BadParameter("cannot go to standard output together with --json", param_hint="'--log'")
    problem = read_mission(mission)
    loaded = load(policy, settings, knowledge or problem.knowledge)
    recorder = Recorder(with_knowledge=animate is not None) if plot or animate else None
    run_once = partial(
        simulate, problem, loaded, knowledge=knowledge, deadline_ms=deadline_ms or None, observe=recorder
    )
    results, last = until_interrupted(run_once, range(seed, seed + runs))

    def figures() -> str:
        return to_json(results[0].to_dict() if runs == 1 else [result.to_dict() for result in results])

    then: list[Callable[[], object]] = [] if quiet else [lambda: tell(results, problem, runs, summary=not json)]
    if recorder is not None:
        then.append(lambda: draw(recorder.course(results[0]), plot, animate))
    save(figures if log is None else last.to_text, log, figures if json else None, then)
    raise typer.Exit(0 if len(results) == runs and all(result.is_done for result in results) else 1)


def until_interrupted(
    run_once: "Callable[..., MissionRun]", seeds: Sequence[int]
) -> "tuple[list[MissionResult], MissionLog]":
    """Make a run with each seed, and return the results and the log of the last one.

    After the first run, Ctrl-C and SIGTERM skip the remaining ones without an error.
    """
    from alloc.allocators.runtime.interrupts import sigterm_interrupts

    results: list[MissionResult] = []
    try:
        with sigterm_interrupts():
            for seed in seeds:
                run = run_once(seed=seed)
                results.append(run.result)
    except KeyboardInterrupt:
        if not results:
            raise
    return results, run.log


def load(policy: str, settings: list[str] | None, knowledge: Knowledge) -> "Policy":
    """Return a policy, after checking that it can act on this knowledge, before its code is compiled."""
    from alloc.allocators import describe_policy, load_policy
    from alloc.allocators.online.run import require_knowledge

    require_knowledge(describe_policy(policy), knowledge)
    return load_policy(policy, **options.values(settings))


def check_files(mission: str, runs: int, written: dict[str, str | None]) -> None:
    """Raise an error before the simulation if a file cannot be written, or is for a single run only."""
    check_outputs(*written.items(), read=[("MISSION", mission)])
    check_picture(written["--plot"])
    check_film(written["--animate"])
    for option, path in written.items():
        if path is not None and runs > 1:
            raise typer.BadParameter("is for a single run", param_hint=f"'{option}'")


def draw(course: "Course", plot: str | None, animate: str | None) -> None:
    """Write the requested picture and animation of a run."""
    from alloc.allocators.plotting import animate_mission, plot_mission

    if plot is not None:
        plot_mission(course, plot)
    if animate is not None:
        animate_mission(course, animate)


def tell(results: "list[MissionResult]", mission: "Mission", runs: int, *, summary: bool) -> None:
    """Print the measures of runs, and notes on late and refused orders and on an interruption."""
    from alloc.cli.output.mission import lines, rows

    if summary:
        say(lines(results[0], mission.instance.units) if len(results) == 1 else rows(results))
    late = sum(result.decisions_late for result in results)
    if late:
        note(f"{late} of {sum(result.decisions for result in results)} decisions missed the deadline")
    refused = sum(result.orders_refused for result in results)
    if refused:
        note(f"{refused} orders could not be carried out; --log says which and why")
    if len(results) < runs:
        note(f"interrupted after {len(results)} of {runs} runs")
