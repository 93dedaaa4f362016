"""``alloc methods``."""

from typing import Annotated, Any

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import note, say, table, write_json

EXAMPLES = examples(
    "alloc methods",
    "alloc methods --json",
    "alloc methods --prepare",
    closing="Some methods compile their loops when they are first used: --prepare does it for all of them at once.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("methods", epilog=EXAMPLES)(methods_command)


def methods_command(
    json: options.JsonOption = False,
    prepare: Annotated[
        bool, typer.Option("--prepare", help="Compile what the methods need, so that no first run waits for it.")
    ] = False,
) -> None:
    """List the methods, what each can do, and what is missing for it."""
    from alloc.allocators import names

    if prepare:
        _prepare()
        return
    facts = [_facts(name) for name in names()]
    if json:
        write_json(facts)
        return
    header = ["name", "kind", "objectives", "speeds", "slack", "proves", "state", "what it is"]
    say(table(header, [_row(fact) for fact in facts], left=len(header)))
    say("")
    for fact in facts:
        if fact["citation"]:
            say(f"{fact['name']}: {fact['citation']}")


def _prepare() -> None:
    """Load each method that is installed; a broken plugin keeps nobody waiting."""
    from alloc.allocators import describe, load, names
    from alloc.problems import InputError

    for name in names():
        try:
            if not describe(name).missing:
                load(name)
        except InputError as error:
            note(str(error))


def _facts(name: str) -> dict[str, Any]:
    """One broken plugin must not hide the other methods."""
    from alloc.allocators import describe
    from alloc.problems import InputError

    try:
        method = describe(name)
    except InputError as error:
        return {"name": name, "error": str(error), "installed": False, "missing": [], "citation": ""}
    return {
        "name": name,
        "summary": method.summary,
        "kind": str(method.kind),
        "objectives": [str(objective) for objective in method.objectives],
        "finite_speeds": method.finite_speeds,
        "makespan_slack": method.makespan_slack,
        "proves": method.proves,
        "warm_start": method.warm_start,
        "anytime": method.anytime,
        "options": list(method.options),
        "installed": not method.missing,
        "missing": list(method.missing),
        "citation": method.citation,
    }


def _row(fact: dict[str, Any]) -> list[str]:
    if "error" in fact:
        return [fact["name"], *"-----", "broken", fact["error"]]
    return [
        fact["name"],
        fact["kind"],
        ", ".join(fact["objectives"]),
        "finite" if fact["finite_speeds"] else "none",
        "yes" if fact["makespan_slack"] else "no",
        "yes" if fact["proves"] else "no",
        "installed" if fact["installed"] else f"pip install {' '.join(fact['missing'])}",
        fact["summary"],
    ]
