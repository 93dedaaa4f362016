"""Validation of command lines in documents and help by the parser, without running them."""

import re
import shlex

import typer

from alloc.cli.main import app

COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]
"""All commands there are, by name."""

USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]
"""What is raised for a line that is not understood; its base has moved between versions of typer."""


def understand(line: str) -> int:
    """Parse every `alloc` command in a shell line; return their number, or raise a `USAGE_ERROR`."""
    calls = [part.split(">")[0].removesuffix(" 2") for part in re.split(r"[|;]|&&", line)]
    found = [words for words in (shlex.split(call, comments=True) for call in calls) if words and words[0] == "alloc"]
    for _, name, *words in found:
        if name not in COMMANDS:
            raise USAGE_ERROR(f"there is no command {name!r}")
        COMMANDS[name].make_context(name, words)
    return len(found)
