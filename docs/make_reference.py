"""Generate docs/reference/, a page per public name, from docstrings: ``python docs/make_reference.py``."""

import dataclasses
import enum
import importlib
import inspect
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

FOLDER = Path(__file__).with_name("reference")

MODULES = ("alloc.problems", "alloc.allocators")

TOPICS = {
    "Instances and allocations": (
        "alloc.problems.instance",
        "alloc.problems.allocation",
        "alloc.problems.evaluation",
        "alloc.problems.vocabulary",
        "alloc.problems.units",
        "alloc.problems.distances",
        "alloc.problems.classes",
    ),
    "Files": ("alloc.problems.formats", "alloc.allocators.plan"),
    "Generated instances": ("alloc.problems.generate",),
    "Bounds, and what cannot be served": ("alloc.problems.bounds", "alloc.problems.matching"),
    "Solving": (
        "alloc.allocators.solve",
        "alloc.allocators.serving",
        "alloc.allocators.result",
        "alloc.allocators.explain",
        "alloc.allocators.replanning",
        "alloc.allocators.plotting",
    ),
    "Methods": (
        "alloc.allocators.registry",
        "alloc.allocators.heuristic",
        "alloc.allocators.exact",
        "alloc.allocators.learned",
    ),
    "A method of your own": ("alloc.allocators.contract",),
    "Comparing": ("alloc.allocators.experiments", "alloc.allocators.pareto"),
    "Missions": ("alloc.problems.missions", "alloc.allocators.plotting.missions"),
    "Policies of missions, and the planner": ("alloc.allocators.online",),
    "Errors": ("alloc.problems.errors",),
}
"""Topics of the index by prefixes of module names; the longest matching prefix counts."""

SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)
"""A heading of a section in a docstring of numpydoc style."""

HEAD = """# Python reference

The public names of `alloc.problems` and `alloc.allocators`, a page for each, made from their docstrings by
`docs/make_reference.py`. [glossary.md](../glossary.md) explains the terms, [embedding.md](../use/embedding.md) shows
the names at work. All else is reachable by its module, and may change.
"""


def pages() -> dict[str, str]:
    """Return the text of each page by its path in docs/reference/; the index comes first."""
    origins = {name: module for module in reversed(MODULES) for name in importlib.import_module(module).__all__}
    names = {name: getattr(importlib.import_module(origins[name]), name) for name in sorted(origins, key=str.casefold)}
    by_topic = {title: [name for name in names if topic(names[name]) == title] for title in TOPICS}
    entries = {place(name, value): entry(f"{origins[name]}.{name}", value) for name, value in names.items()}
    return {"index.md": "\n".join([HEAD, *(table(title, by_topic[title], names) for title in TOPICS)]), **entries}


def topic(value: object) -> str:
    """Return the topic of a public name; constants, whose modules are unknown, belong to allocations."""
    module = getattr(value, "__module__", "alloc.problems.allocation")
    known = {prefix: title for title, prefixes in TOPICS.items() for prefix in prefixes if module.startswith(prefix)}
    return known[max(known, key=len)]


def place(name: str, value: object) -> str:
    """Return the path of a page; `WhatIf` and `whatif` would collide on file systems that ignore case."""
    return f"{'classes' if isinstance(value, type) else 'functions' if callable(value) else 'constants'}/{name}.md"


def table(title: str, names: list[str], values: Mapping[str, object]) -> str:
    """Return the names of a topic with the first sentences of their docstrings."""
    rows = [f"| [`{name}`]({place(name, values[name])}) | {summary(values[name])} |" for name in names]
    return "\n".join([f"## {title}", "", "| Name | What it is |", "|---|---|", *rows, ""])


def summary(value: object) -> str:
    """Return the summary line of a docstring, or the value of a constant."""
    first = (inspect.getdoc(value) or "").partition("\n\n")[0] if callable(value) else f"`{value!r}`"
    return first.replace("\n", " ").replace("|", "\\|")


def entry(path: str, value: object) -> str:
    """Return the page of a name: its signature, its docstring, and its public methods or members."""
    name = path.rpartition(".")[2]
    lines = [f"# {name}", ""]
    if not callable(value):
        return "\n".join([*lines, f"`{path} = {value!r}`", ""])
    lines += ["```text", signature(path, value), "```", "", *markdown(inspect.getdoc(value) or "")]
    if isinstance(value, type):
        lines += members(value)
    return "\n".join(lines)


def signature(name: str, value: Callable[..., object]) -> str:
    """Return the signature of a function or class without types; long ones have a line per parameter."""
    if isinstance(value, type) and issubclass(value, enum.Enum):
        return f"{name}(value)"
    if isinstance(value, type) and issubclass(value, Exception) and "__init__" not in vars(value):
        return f"{name}(message)"
    parts = arguments(value)
    line = f"{name}({', '.join(parts)})"
    return line if len(line) <= 100 else f"{name}(\n" + "".join(f"    {part},\n" for part in parts) + ")"


def arguments(value: Callable[..., object]) -> list[str]:
    """Return the parameters of a function or class with their defaults but without types."""
    kinds = inspect.Parameter
    parts: list[str] = []
    for name, parameter in inspect.signature(value).parameters.items():
        if name in ("self", "cls"):
            continue
        if parameter.kind is kinds.KEYWORD_ONLY and not any(part.startswith("*") for part in parts):
            parts.append("*")
        stars = {kinds.VAR_POSITIONAL: "*", kinds.VAR_KEYWORD: "**"}.get(parameter.kind, "")
        parts.append(stars + name + ("" if parameter.default is kinds.empty else f"={default(parameter.default)}"))
    return parts


def default(value: object) -> str:
    """Return a default as source code; defaults that are factories or objects become dots."""
    if isinstance(value, enum.Enum):
        return repr(value.value)
    text = repr(value)
    return "..." if "<" in text or len(text) > 30 else text


def markdown(docstring: str) -> list[str]:
    """Convert a numpydoc docstring to lines of Markdown."""
    pieces = SECTION.split(docstring)
    lines = [pieces[0].strip(), ""]
    for title, text in zip(pieces[1::2], pieces[2::2], strict=True):
        lines += [f"## {title}", "", *(items(text) if is_list(text) else [text.strip()]), ""]
    return lines


def is_list(text: str) -> bool:
    """Return whether a section is a list of names or types with indented explanations instead of plain text."""
    first = text.strip("\n").splitlines()[0] if text.strip() else ""
    return " : " in first or "\n    " in text or re.fullmatch(r"[\w, ]+", first) is not None


def items(text: str) -> Iterator[str]:
    """Yield an item for each name of a section, with its explanation on the same line."""
    for part in re.split(r"\n(?=\S)", text.strip("\n")):
        head, _, explanation = part.partition("\n")
        name, colon, kind = head.partition(" : ")
        words = " ".join(explanation.split())
        label = f"`{name}`" + (f" ({kind})" if colon else "")
        yield f"- {label}: {words}" if words else f"- {label}"


def members(kind: type) -> Iterator[str]:
    """Yield the members of an enumeration, or the public methods and properties of a class, with their first lines."""
    if issubclass(kind, enum.Enum):
        yield "Members: " + ", ".join(f"`{one.name}` = `{one.value}`" for one in kind) + "."
        yield ""
        return
    fields = {field.name for field in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else set()
    methods = []
    for name, value in inspect.getmembers(kind):
        if name.startswith("_") or name in fields or not is_own(kind, name):
            continue
        first = (inspect.getdoc(value) or "").partition("\n\n")[0].replace("\n", " ")
        if first and (callable(value) or isinstance(value, property)):
            call = "" if isinstance(value, property) else f"({', '.join(arguments(value))})"
            methods.append(f"- `.{name}{call}`: {first}")
    if methods:
        yield from ("## Methods", "", *methods, "")


def is_own(kind: type, name: str) -> bool:
    """Return whether the name is defined by a class of this project rather than of Python."""
    return any(name in vars(base) for base in kind.__mro__ if base.__module__.startswith("alloc."))


if __name__ == "__main__":
    shutil.rmtree(FOLDER, ignore_errors=True)
    for page, text in pages().items():
        (FOLDER / page).parent.mkdir(parents=True, exist_ok=True)
        (FOLDER / page).write_text(text, encoding="utf-8")
