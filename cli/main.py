"""The command `alloc`: its subcommands, and the message and exit code of each error."""

import contextlib
import errno
import gc
import os
import re
import sys
import threading
from collections.abc import Sequence
from typing import NoReturn

import typer

from alloc.cli.commands import (
    convert,
    evaluate,
    export,
    generate,
    import_,
    methods,
    plot,
    schema,
    solve,
    validate,
)
from alloc.cli.commands.experiments import compare, pareto, report, reproduce, whatif
from alloc.cli.commands.missions import import_mission, plan, replay, simulate
from alloc.cli.commands.serving import serve
from alloc.cli.commands.training import train, tune
from alloc.cli.options import Parameter, examples, option_of
from alloc.cli.output.console import INTERRUPTED, OUTPUT, complain, flush, interrupted, write_out

SERVED, UNSERVED, BAD_INPUT = 0, 1, 2
"""Exit codes: every task is served; a task is unserved; bad usage or bad input."""

DEFECT = 70
"""Exit code of a defect of the program (EX_SOFTWARE)."""

_USAGE_ERROR = typer.BadParameter.__mro__[1]  # its base has moved between versions of typer

app = typer.Typer(
    name="alloc",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=examples(
        "alloc generate paper-1 --seed 7 --output demo.json",
        "alloc solve demo.json --method greedy --plot demo.png",
        "alloc compare demo.json --methods greedy,ga,cpsat --time-limit 5",
        closing="Exit codes: 0 every task is served, 1 a task is unserved, 2 bad usage or bad input.",
    ),
)
COMMANDS = (
    solve,
    compare,
    report,
    pareto,
    whatif,
    evaluate,
    plot,
    generate,
    import_,
    import_mission,
    validate,
    convert,
    export,
    simulate,
    replay,
    plan,
    serve,
    schema,
    methods,
    train,
    tune,
    reproduce,
)
for module in COMMANDS:
    module.register(app)


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        write_out(f"alloc {version('alloc-mrta')}\n")
        raise typer.Exit


@app.callback()
def _alloc(
    version: bool = typer.Option(False, "--version", callback=_show_version, is_eager=True, help="Print the version."),
) -> None:
    """Allocate agents to tasks: exact, heuristic and learned methods behind one interface."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `alloc` with `arguments`, by default those of the process, and return its exit code.

    If it uses the arguments of the process and a native solver ignored a stop request, it ends the process itself.
    """
    code = _run(arguments)
    if arguments is None:
        if _is_solver_left():
            _leave(code)
        gc.freeze()  # skips the last garbage collection, which with torch takes most of a second after Ctrl-C
    return code


def _run(arguments: Sequence[str] | None) -> int:
    try:
        code = typer.main.get_command(app).main(
            args=None if arguments is None else list(arguments), prog_name="alloc", standalone_mode=False
        )
    except (KeyboardInterrupt, typer.Abort):
        return interrupted()
    except Exception as error:
        if os.environ.get("ALLOC_TRACEBACK"):
            raise
        return _explain(error, sys.argv[1:] if arguments is None else arguments)
    if code == INTERRUPTED:  # typer's exit code for Ctrl-C within a command
        return interrupted()
    return code if isinstance(code, int) else SERVED


def _parameters(arguments: Sequence[str]) -> list[Parameter]:
    """Return the arguments and options of the command that was called."""
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    name = next((argument for argument in arguments if argument in commands), None)
    return [] if name is None else list(commands[name].params)


def _is_solver_left() -> bool:
    """Return whether `run_native` left a thread running."""
    return any(thread.name == "alloc-native-solver" for thread in threading.enumerate())


def _leave(code: int) -> NoReturn:
    """End the process without finalising the interpreter, in which a running native thread would crash."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            with contextlib.suppress(OSError, ValueError):
                flush(stream)
    os._exit(code)


def _usage(message: str) -> str:
    """Return a usage error in the form of all other errors: the option, and what it must be."""
    words = re.sub("^Invalid value for '?([^':]+)'?: ", r"\1: ", message.rstrip("."))
    words = re.sub(", unable to parse string as an? [a-z]+$", "", words)
    return words.replace(": Value error, ", ": ").replace(": Input should be ", ": must be ")


def _explain(error: Exception, arguments: Sequence[str]) -> int:
    """Turn `error` into one line on standard error and an exit code."""
    if isinstance(error, _USAGE_ERROR):
        command = error.ctx.command_path if error.ctx else "alloc"  # type: ignore[attr-defined]
        complain(f"{_usage(error.format_message())}; see '{command} --help'")  # type: ignore[attr-defined]
        return BAD_INPUT
    from alloc.problems import AllocError, InputError

    if isinstance(error, InputError):
        place = error.place if error.source else option_of(error.place, _parameters(arguments), arguments)
        complain(str(InputError(error.message, place, error.source)))
    elif isinstance(error, AllocError):
        complain(str(error))
    elif isinstance(error, MemoryError):
        complain("there is not enough memory for this")
    elif isinstance(error, OSError):
        # our own code names its files; an ENOSPC without a name comes from typer printing the help
        unnamed = OUTPUT if error.errno == errno.ENOSPC else "the operating system"
        complain(f"{error.filename or unnamed}: {error.strerror or error}")
    else:
        complain(
            f"defect in alloc or a plugin: {type(error).__name__}: {error};"
            " please report it with what ALLOC_TRACEBACK=1 prints"
        )
        return DEFECT
    return BAD_INPUT
