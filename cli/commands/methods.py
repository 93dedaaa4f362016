"""``alloc methods``."""

from collections.abc import Callable
from functools import partial
from typing import Annotated, TypedDict

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import note, say, table, write_json
from alloc.problems.vocabulary import Objective

EXAMPLES = examples(
    "alloc methods",
    "alloc methods ga",
    "alloc methods --json",
    "alloc methods --prepare",
    closing="Some methods and policies compile code on first use; --prepare does this for all of them.",
)

MOVES = (
    f"Every method with {Objective.MAKESPAN_ENERGY} also takes {Objective.MAKESPAN_MOVES}: "
    "`alloc solve` with the plan in force as --start."
)


class Fact(TypedDict, total=False):
    """One entry of the JSON; ``error`` is present if the plugin cannot be loaded."""

    name: str
    error: str
    summary: str
    kind: str
    objectives: list[str]
    finite_speeds: bool
    makespan_slack: bool
    proves: bool
    warm_start: bool
    anytime: bool
    options: list[str]
    installed: bool
    missing: list[str]
    citation: str


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("methods", epilog=EXAMPLES)(methods_command)


class Setting(TypedDict):
    """One parameter of a method in the JSON of ``alloc methods NAME``."""

    name: str
    values: str
    default: object
    meaning: str


def methods_command(
    method: Annotated[
        str | None,
        typer.Argument(
            metavar="METHOD",
            autocompletion=options.complete_methods,
            help="List the parameters of this method, for --set.",
            show_default="all methods",
        ),
    ] = None,
    json: options.JsonOption = False,
    prepare: Annotated[
        bool,
        typer.Option("--prepare", help="Compile the code of all methods and policies now instead of on first use."),
    ] = False,
) -> None:
    """List the methods, or the parameters of one.

    The list shows what each method can do, and which packages are missing.
    """
    from alloc.allocators import names

    if method is not None:
        _tell_of(method, json=json)
        return
    if prepare:
        _prepare()
        return
    facts = [_facts(name) for name in names()]
    if json:
        write_json(facts)
        return
    header = ["name", "kind", "objectives", "speeds", "slack", "proves", "state", "what it is"]
    citations = [f"{fact['name']}: {fact['citation']}" for fact in facts if fact["citation"]]
    lines = [table(header, [_row(fact) for fact in facts], left=len(header)), "", MOVES, "", *citations]
    say("\n".join(lines))


def _tell_of(name: str, *, json: bool) -> None:
    """Print a method: its summary, and each parameter with its values, default and meaning."""
    from alloc.allocators import describe, describe_parameters
    from alloc.allocators.contract.parameters import plain_values, written

    method, found = describe(name), describe_parameters(name)
    defaults = plain_values({one.name: one.default for one in found})
    if json:
        settings = [
            Setting(name=one.name, values=one.kind, default=defaults[one.name], meaning=one.meaning) for one in found
        ]
        write_json({**_facts(name), "parameters": settings})
        return
    say(f"{name} ({method.kind}): {method.summary}")
    if method.citation:
        say(method.citation)
    header = ["parameter", "values", "default", "meaning"]
    rows = [[one.name, one.kind, written(one.default), one.meaning.replace("`", "")] for one in found]
    say("\n" + (table(header, rows, left=len(header)) if rows else "It has no parameters."))


def _prepare() -> None:
    """Load each installed method and policy, which compiles its code; a note is printed for plugins that fail.

    Methods of one kind share code, so there is a process per kind. Learned methods take longest and start first.
    """
    from alloc.allocators import describe, load, names
    from alloc.allocators.exact.makespan import task_prices as bound
    from alloc.allocators.heuristic.greedy import tree_search
    from alloc.allocators.heuristic.task_prices import start as task_prices
    from alloc.allocators.online.registry import describe_policy, load_policy, policy_names
    from alloc.allocators.parallel.processes import ProcessEngine
    from alloc.problems import InputError

    kinds: dict[str, list[Callable[[], object]]] = {"learned": [], "policies": []}
    for name in names():
        try:
            method = describe(name)
        except InputError as error:
            note(str(error))
            continue
        if not method.missing:
            kinds.setdefault(str(method.kind), []).append(partial(load, name))
        if name == "greedy":
            kinds[str(method.kind)] += [
                one.compile_loops for one in (tree_search, task_prices, bound)
            ]  # for large instances
    for name in policy_names():
        try:
            if not describe_policy(name).missing:
                kinds["policies"].append(partial(load_policy, name))
        except InputError as error:
            note(str(error))
    with ProcessEngine() as engine:
        for messages in engine.map(_load, list(kinds.values())) or ():
            for message in messages:
                note(message)


def _load(loaders: list[Callable[[], object]]) -> list[str]:
    """Load methods and policies, and return the messages of those that fail."""
    from alloc.problems import InputError

    failures = []
    for load in loaders:
        try:
            load()
        except InputError as error:
            failures.append(str(error))
    return failures


def _facts(name: str) -> Fact:
    """Return the facts about a method, or the error of a plugin that cannot be loaded."""
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


def _row(fact: Fact) -> list[str]:
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
