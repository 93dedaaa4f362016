"""``alloc schema``."""

from typing import Annotated

import typer

from alloc.cli.options import examples
from alloc.cli.output.console import say, table, write_out

EXAMPLES = examples(
    "alloc schema",
    "alloc schema alloc-instance/1",
    "alloc schema result > result.schema.json",
    closing="The schemas follow JSON Schema draft 2020-12.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("schema", epilog=EXAMPLES)(schema_command)


def complete_formats(incomplete: str) -> list[str]:
    """Return the formats that begin with `incomplete`."""
    from alloc.problems.formats.schemas import SCHEMAS

    return [name for name in SCHEMAS if name.startswith(incomplete)]


def schema_command(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            autocompletion=complete_formats,
            help="A format, such as alloc-instance/1, or instance for short.",
            show_default="list them",
        ),
    ] = None,
) -> None:
    """Print the JSON Schema of a format, or list the formats."""
    from alloc.problems.formats.schemas import SCHEMAS, schema_text

    if name is None:
        say(table(["name", "what it is"], [[*item] for item in SCHEMAS.items()], left=2))
    else:
        write_out(schema_text(name))
