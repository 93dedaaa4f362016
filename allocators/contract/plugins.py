"""Loading of classes: built-in ones by module and attribute, those of other packages by entry points."""

import importlib
from collections.abc import Collection, Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

from alloc.problems import InputError, MissingPackageError

Kind = TypeVar("Kind")


def imported(target: str) -> object:
    """Import and return ``package.module:attribute``."""
    module, _, attribute = target.partition(":")
    found: object = getattr(importlib.import_module(module), attribute)
    return found


def plugins(group: str, built_in: Collection[str]) -> dict[str, EntryPoint]:
    """Return the entry points of other packages by name, without those that have the name of a built-in class."""
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
        Name of the plugin.
    base : type
        Required base class.
    attribute : str
        Required attribute.
    expected : str
        Both requirements in words.
    place : str
        `InputError.place` of an error: ``method`` or ``policy``.

    Raises
    ------
    InputError
        If it cannot be imported, or does not meet the requirements.
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
    """Raise a `MissingPackageError` if there are `missing` modules, which `title` needs."""
    if missing:
        modules = " ".join(missing)
        raise MissingPackageError(f"{title} needs {modules}; install with: pip install {modules}", place)
