"""``alloc plan --stdio``."""

import contextlib
import json
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from queue import SimpleQueue
from types import FrameType
from typing import TYPE_CHECKING, Annotated, BinaryIO

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import write_out
from alloc.cli.output.files import check_outputs

if TYPE_CHECKING:
    from alloc.allocators.online.planner.lines import Lines
    from alloc.problems import Mission

EXAMPLES = examples(
    "alloc plan mission.json --stdio",
    "alloc plan mission.json --stdio --policy greedy --deadline-ms 50 --state planner.json",
    'echo \'{"request": "plan"}\' | alloc plan mission.json --stdio',
    closing="Input lines have the format alloc-planner-request/1, output lines alloc-planner-orders/1.",
)

CHUNK = 65536
"""Maximum number of bytes read at once."""


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("plan", epilog=EXAMPLES)(plan_command)


def plan_command(
    mission: Annotated[
        str | None,
        typer.Argument(
            metavar="MISSION",
            help="A mission as .json, or an instance.",
            show_default="the first line, or the one in --state",
        ),
    ] = None,
    stdio: Annotated[
        bool, typer.Option("--stdio", help="Read events from standard input, write orders to standard output.")
    ] = False,
    policy: Annotated[
        str,
        typer.Option(
            autocompletion=options.complete_policies,
            help=f"The policy: {', '.join(options.BUILT_IN_POLICIES)}, or a plugin.",
        ),
    ] = "replan",
    deadline_ms: Annotated[
        float, typer.Option(min=0, help="Milliseconds per plan; if exceeded, the last plan stands. 0 for no limit.")
    ] = 100.0,
    seed: options.SeedOption = 0,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A parameter of the policy; may be repeated."),
    ] = None,
    state: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Resume from this file and its policy if it exists; save to it at the end."),
    ] = None,
) -> None:
    """Plan missions for a program in any language.

    It sends events and receives orders, as lines of JSON.
    """
    from alloc.allocators import MissionPlanner, load_policy
    from alloc.allocators.online.planner.lines import Lines
    from alloc.problems import read_mission

    if not stdio:
        raise typer.BadParameter("is required", param_hint="'--stdio'")
    if mission == "-":
        raise typer.BadParameter("cannot be -: leave it out to read it from the first line", param_hint="MISSION")
    check_outputs(("--state", state), read=[("MISSION", mission)] if mission is not None else [])
    given = options.values(settings)

    def begin(problem: "Mission") -> MissionPlanner:
        return MissionPlanner(problem, policy, deadline_ms or None, seed=seed, **given)

    planner = None
    if state is not None and Path(state).exists():
        if mission is not None:
            why = f"must be left out, as planning resumes from {state}; or remove that file"
            raise typer.BadParameter(why, param_hint="MISSION")
        planner = MissionPlanner.restore(state)
    elif mission is not None:
        planner = begin(read_mission(mission))
    else:
        load_policy(policy, **given)  # report errors before the first line arrives
    serve(Lines(planner, begin, state))


def serve(lines: "Lines") -> None:
    """Answer all lines until the input ends, a signal arrives or an answer cannot be written, and save the planner."""
    arrived: SimpleQueue[str | None] = SimpleQueue()
    threading.Thread(target=read_lines, args=(arrived,), name="alloc-lines", daemon=True).start()
    with ended_by_signals(arrived):
        try:
            for number, line in enumerate(iter(arrived.get, None), 1):
                write_out(json.dumps(lines.answer(line, number), allow_nan=False) + "\n")
        finally:  # also if an answer cannot be written
            try:
                lines.save()
            finally:
                lines.close()


def read_lines(arrived: "SimpleQueue[str | None]") -> None:
    """Put all lines of standard input on a queue, followed by None.

    Input is read unbuffered, as the lock of a buffer would block the exit of the process while this thread waits.
    """
    stream: BinaryIO = sys.stdin.buffer
    source: BinaryIO = getattr(stream, "raw", stream)
    rest = b""
    while chunk := source.read(CHUNK):
        *whole, rest = (rest + chunk).split(b"\n")
        for line in whole:
            arrived.put(line.decode("utf-8", "replace"))
    if rest:
        arrived.put(rest.decode("utf-8", "replace"))
    arrived.put(None)


@contextlib.contextmanager
def ended_by_signals(arrived: "SimpleQueue[str | None]", end: Callable[[], object] = lambda: None) -> Iterator[None]:
    """Treat SIGTERM and Ctrl-C within this context as the end of the input, after the lines already received.

    They also call `end`.
    """
    from alloc.allocators.runtime.interrupts import ENDING, signals_handled

    def request_end(number: int, frame: FrameType | None) -> None:
        end()
        arrived.put(None)

    with signals_handled(ENDING, request_end):
        yield
