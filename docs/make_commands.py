"""Generate the page of all commands and options from the parser of the command line, for `hooks.py`."""

import html
import re

import typer

from alloc.cli.main import app

HEAD = """# All commands and options

Made from the parser of `alloc`: what `alloc COMMAND --help` prints. [The command line](cli.md) explains them.
"""


def page() -> str:
    """Return the page, with a section for each command."""
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    return "\n".join([HEAD, *(chapter(name, command) for name, command in commands.items())])


def chapter(name: str, command: "typer.core.TyperCommand") -> str:
    """Return the section of a command: what it does, its arguments and options, and the examples of its help."""
    context = command.make_context(f"alloc {name}", [], resilient_parsing=True)
    summary, _, more = (command.help or "").partition("\n\n")
    lines = [f"## alloc {name}", "", text(summary), ""]
    if more:
        lines += [text(more), ""]
    usage = " ".join(command.collect_usage_pieces(context))
    lines += ["```text", f"alloc {name} {usage}", "```", ""]
    rows = [record for one in command.params if (record := one.get_help_record(context))]
    if rows:
        lines += [
            "| option | meaning |",
            "|---|---|",
            *(f"| <code>{cell(option)}</code> | {cell(meaning)} |" for option, meaning in rows),
            "",
        ]
    examples = re.findall(r"^\s*(alloc .*)$", command.epilog or "", re.MULTILINE)
    if examples:
        lines += ["```console", *examples, "```", ""]
    return "\n".join(lines)


def cell(words: str) -> str:
    """Escape text for a cell of a Markdown table."""
    return html.escape(" ".join(words.split()), quote=False).replace("|", "&#124;")


def text(words: str) -> str:
    """Return a paragraph of help on one line."""
    return " ".join(words.replace("\b", "").split())


if __name__ == "__main__":
    print(page())
