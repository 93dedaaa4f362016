"""``alloc serve``."""

import threading
from queue import SimpleQueue
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.commands.missions.plan import ended_by_signals, read_lines
from alloc.cli.options import examples
from alloc.cli.output.console import say, write_out

if TYPE_CHECKING:
    from alloc.allocators.serving.service import Service

EXAMPLES = examples(
    "alloc serve --stdio --load gappo",
    "alloc serve --http 127.0.0.1:8080 --load 'gappo[policy=mine.safetensors],local-search'",
    "alloc serve --http 8080 --parallel 4 --queue 32 --most-agents 500 --most-ms 1000",
    closing="Requests have the format alloc-solve-request/1, answers alloc-solve-answer/1. "
    "SIGTERM ends all runs as their time limits do.",
)

LOCAL = "127.0.0.1"
"""Default host: the service is reachable from this machine only."""


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("serve", epilog=EXAMPLES)(serve_command)


def serve_command(
    stdio: Annotated[
        bool, typer.Option("--stdio", help="Read requests from standard input, write answers to standard output.")
    ] = False,
    http: Annotated[
        str | None,
        typer.Option(metavar="[HOST:]PORT", help=f"Listen here; HOST is {LOCAL} by default.", show_default=False),
    ] = None,
    load: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME,...",
            autocompletion=options.complete_methods,
            help="Methods to load at start, optionally with parameters, as in gappo[policy=mine.safetensors]; "
            "others are loaded on first use.",
            show_default=False,
        ),
    ] = None,
    parallel: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Parallel runs.", show_default="one per processor")
    ] = None,
    queue: Annotated[int, typer.Option(min=0, help="Requests that may wait; more are rejected.")] = 64,
    most_agents: Annotated[int, typer.Option(min=1, help="Maximum number of agents of an instance.")] = 2_000,
    most_tasks: Annotated[int, typer.Option(min=1, help="Maximum number of tasks of an instance.")] = 500,
    most_ms: Annotated[
        float, typer.Option(min=0, help="Maximum time limit of a request in milliseconds, and the default.")
    ] = 10_000,
    most_bytes: Annotated[int, typer.Option(min=1, help="Maximum size of a request over HTTP.")] = 4_000_000,
) -> None:
    """Serve requests to solve from other programs.

    Requests are lines of JSON on standard input, or HTTP requests.
    """
    from alloc.allocators.parallel.processors import available_threads
    from alloc.allocators.serving.request import ServiceLimits
    from alloc.allocators.serving.service import Service
    from alloc.problems import InputError

    if stdio == (http is not None):
        raise typer.BadParameter("give either --stdio or --http", param_hint="'--stdio'")
    host, port = (LOCAL, 0) if http is None else _address(http)
    limits = ServiceLimits(
        agents=most_agents,
        tasks=most_tasks,
        limit_ms=most_ms,
        parallel=parallel or available_threads(),
        queue=queue,
        strangers=not stdio,
    )
    methods = {} if load is None else _methods(load)
    try:
        service = Service(limits, methods)
    except InputError as error:
        place = "--load" if error.place == "method" else f"--load: {error.place}"
        raise (error if error.source else InputError(error.message, place)) from error.__cause__
    if stdio:
        serve_lines(service)
    else:
        serve_http(service, host, port, most_bytes)


def serve_lines(service: "Service") -> None:
    """Answer all lines until the input ends or a signal arrives."""
    from alloc.allocators.serving.lines import RequestLines

    arrived: SimpleQueue[str | None] = SimpleQueue()
    threading.Thread(target=read_lines, args=(arrived,), name="alloc-lines", daemon=True).start()
    failures: list[OSError] = []

    def write(line: str) -> None:
        """Write an answer; once that fails, end as at the end of the input, as nobody gets the others."""
        if failures:
            return
        try:
            write_out(line + "\n")
        except OSError as error:
            failures.append(error)
            service.end()
            arrived.put(None)

    lines = RequestLines(service, write)
    with ended_by_signals(arrived, service.end):
        while (line := arrived.get()) is not None and not failures:
            lines.take(line)
        service.close()
    if failures:
        raise failures[0]


def serve_http(service: "Service", host: str, port: int, most_bytes: int) -> None:
    """Answer requests until a signal arrives; requests in progress are still answered."""
    from alloc.problems import MissingPackageError

    try:
        from alloc.allocators.serving.server import run_server
    except ImportError as error:
        message = f"needs {error.name}; install with: pip install 'alloc-mrta[serve]'"
        raise MissingPackageError(message, "--http") from error
    run_server(service, host, port, most_bytes, lambda address: say(f"listening on {address}"))


def _methods(text: str) -> dict[str, dict[str, object]]:
    """Return the parameters of each method to load."""
    methods: dict[str, dict[str, object]] = {}
    for name, given in options.listed(text, "--load").values():
        if name in methods:
            raise typer.BadParameter(f"names {name} twice with different parameters", param_hint="'--load'")
        methods[name] = given or {}
    return methods


def _address(text: str) -> tuple[str, int]:
    """Return the host and port of ``HOST:PORT`` or ``PORT``."""
    host, _, port = text.rpartition(":")
    if not (port.isdecimal() and int(port) < 2**16):
        raise typer.BadParameter(f"must be PORT or HOST:PORT, as {LOCAL}:8080, got {text!r}", param_hint="'--http'")
    return host.strip("[]") or LOCAL, int(port)
