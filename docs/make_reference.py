"""Writes docs/reference.md from the docstrings of the public names: ``python docs/make_reference.py``."""

import dataclasses
import enum
import importlib
import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path

PAGE = Path(__file__).with_name("reference.md")

MODULES = ("alloc.problems", "alloc.allocators")

SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)
"""A heading of a section in a docstring of numpydoc style."""

HEAD = """# Reference

The public names of `alloc.problems` and `alloc.allocators`, made from their docstrings by `docs/make_reference.py`.
[glossary.md](glossary.md) explains the terms, [embedding.md](use/embedding.md) shows the names at work. All else is
reachable by its module, and may change.
"""


def reference() -> str:
    """Return the text of the page."""
    return "\n".join([HEAD, *(chapter(name) for name in MODULES)])


def chapter(module: str) -> str:
    """Return the chapter of a module: an entry for each of its public names, in the order of the alphabet."""
    loaded = importlib.import_module(module)
    entries = {name: getattr(loaded, name) for name in sorted(loaded.__all__, key=str.casefold)}
    summary = inspect.getdoc(loaded) or ""
    index = ", ".join(f"[`{name}`](#{name.lower().replace('.', '')})" for name in entries)
    own = [
        entry(name, value) if getattr(value, "__module__", module).startswith(module) else above(name, value)
        for name, value in entries.items()
    ]
    return "\n".join([f"## {module}", "", summary.splitlines()[0], "", index, "", *own])


def above(name: str, value: object) -> str:
    """Return the entry of a name that comes from an earlier chapter."""
    origin = ".".join(str(value.__module__).split(".")[:2])
    return f"### {name}\n\nThat of `{origin}`: [above](#{name.lower()}).\n"


def entry(name: str, value: object) -> str:
    """Return the entry of one name: how it is called, its docstring, and its public methods or members."""
    lines = [f"### {name}", ""]
    if not callable(value):
        return "\n".join([*lines, f"`{name} = {value!r}`", ""])
    lines += ["```text", signature(name, value), "```", "", *markdown(inspect.getdoc(value) or "")]
    if isinstance(value, type):
        lines += members(value)
    return "\n".join(lines)


def signature(name: str, value: Callable[..., object]) -> str:
    """Return how a function or class is called, without types; long ones have a line for each parameter."""
    if isinstance(value, type) and issubclass(value, enum.Enum):
        return f"{name}(value)"
    if isinstance(value, type) and issubclass(value, Exception) and "__init__" not in vars(value):
        return f"{name}(message)"
    parts = arguments(value)
    line = f"{name}({', '.join(parts)})"
    return line if len(line) <= 100 else f"{name}(\n" + "".join(f"    {part},\n" for part in parts) + ")"


def arguments(value: Callable[..., object]) -> list[str]:
    """Return the parameters of a function or class as they are written, with their defaults but without types."""
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
    """Return a default as it is written; those that are made anew for each call, or are objects, are dots."""
    if isinstance(value, enum.Enum):
        return repr(value.value)
    text = repr(value)
    return "..." if "<" in text or len(text) > 30 else text


def markdown(docstring: str) -> list[str]:
    """Return a docstring of numpydoc style as lines of Markdown."""
    pieces = SECTION.split(docstring)
    lines = [pieces[0].strip(), ""]
    for title, text in zip(pieces[1::2], pieces[2::2], strict=True):
        lines += [f"**{title}**", "", *(items(text) if is_list(text) else [text.strip()]), ""]
    return lines


def is_list(text: str) -> bool:
    """Return whether a section is a list of names or types, each with an indented explanation, not plain text."""
    first = text.strip("\n").splitlines()[0] if text.strip() else ""
    return " : " in first or "\n    " in text or re.fullmatch(r"[\w, ]+", first) is not None


def items(text: str) -> Iterator[str]:
    """Yield an item for each name of a section, its explanation on the same line."""
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
        yield from ("**Methods**", "", *methods, "")


def is_own(kind: type, name: str) -> bool:
    """Return whether a class of this project defines the name, not one of Python's."""
    return any(name in vars(base) for base in kind.__mro__ if base.__module__.startswith("alloc."))


if __name__ == "__main__":
    PAGE.write_text(reference(), encoding="utf-8")
