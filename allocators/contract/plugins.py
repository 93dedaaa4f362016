"""Classes by name: built-in ones by module and attribute, those of other packages by entry points."""

import importlib
from collections.abc import Collection, Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

from alloc.problems import InputError, MissingPackageError

Kind = TypeVar("Kind")


def imported(target: str) -> object:
    """Return what is called ``package.module:attribute``."""
    module, _, attribute = target.partition(":")
    found: object = getattr(importlib.import_module(module), attribute)
    return found


def plugins(group: str, built_in: Collection[str]) -> dict[str, EntryPoint]:
    """Return the entry points of other packages; the name of a built-in class cannot be taken."""
    return {entry.name: entry for entry in entry_points(group=group) if entry.name not in built_in}


def plugin_class(
    found: Mapping[str, EntryPoint], name: str, base: type[Kind], attribute: str, expected: str, place: str
) -> type[Kind]:
    """Import the class of a plugin.

    Parameters
    ----------
    found : mapping
        Entry points by name.
    name : str
        One of them.
    base : type
        What the class must be derived from.
    attribute : str
        What it must have.
    expected : str
        Both in words.
    place : str
        That of an error: ``method`` or ``policy``.

    Raises
    ------
    InputError
        If it cannot be imported, or is no such class.
    """
    plugin = f"plugin {name!r} ({found[name].value})"
    try:
        kind = found[name].load()
    except Exception as error:
        raise InputError(f"{plugin} cannot be imported: {error}", place) from error
    if not (isinstance(kind, type) and issubclass(kind, base) and hasattr(kind, attribute)):
        raise InputError(f"{plugin} is not {expected}", place)
    return kind


def require_installed(missing: Collection[str], title: str, place: str) -> None:
    """Raise a `MissingPackageError` if modules are missing that something called `title` needs."""
    if missing:
        modules = " ".join(missing)
        raise MissingPackageError(f"{title} needs {modules}; install with: pip install {modules}", place)
