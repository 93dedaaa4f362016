"""Parsing of JSON text, with the line or place of errors, and formatting."""

import json
from collections.abc import Iterable
from json import JSONDecodeError

from alloc.problems.errors import InputError
from alloc.problems.formats.messages import described, quoted

encode = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode


class RepeatedKey(dict[str, object]):
    """An object with a repeated key; the error is raised later, when its place is known."""

    repeated = ""


def parse(text: str) -> object:
    """Parse a JSON text; all numbers become floats, infinite if out of range.

    Raises
    ------
    InputError
        If it is not valid JSON.
    """
    if not text.strip():
        raise InputError("is empty; expected a JSON object")
    try:
        # unlike int, float accepts integers of any length
        value: object = json.loads(text, object_pairs_hook=_object, parse_int=float)
    except JSONDecodeError as error:
        end = " (the file ends here; is it cut off?)" if not text[error.pos :].strip() else ""
        message = f"is not JSON: {error.msg[0].lower()}{error.msg[1:]}{end}"
        raise InputError(message, f"line {error.lineno} column {error.colno}") from error
    except RecursionError as error:
        raise InputError("is nested too deeply; the formats need no more than four levels") from error
    return value


def require_object(value: object, place: str = "") -> dict[str, object]:
    """Return `value` if it is an object without repeated keys.

    Raises
    ------
    InputError
        If it is not.
    """
    if isinstance(value, RepeatedKey):
        raise InputError(f"the field {quoted(value.repeated)} occurs twice; remove one", place)
    if not isinstance(value, dict):
        raise InputError(f"must be a JSON object, got {described(value)}", place)
    return value


def lines(document: dict[str, object]) -> str:
    """Return a document as JSON text with one line per entry of its lists and objects, and of tables in them."""
    return "{\n" + ",\n".join(f"{encode(key)}: {_block(value)}" for key, value in document.items()) + "\n}\n"


def _block(value: object) -> str:
    if isinstance(value, list) and value:
        return "[\n" + ",\n".join(_indented(map(encode, value))) + "\n]"
    if isinstance(value, dict) and value:
        return "{\n" + ",\n".join(_indented(f"{encode(key)}: {_table(entry)}" for key, entry in value.items())) + "\n}"
    return encode(value)


def _table(value: object) -> str:
    """Return a list of lists with one line per list, and any other value in one line."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n" + ",\n".join(f"    {encode(row)}" for row in value) + "\n  ]"
    return encode(value)


def _indented(entries: Iterable[str]) -> Iterable[str]:
    return (f"  {entry}" for entry in entries)


def _object(pairs: list[tuple[str, object]]) -> dict[str, object]:
    plain = dict(pairs)
    if len(plain) == len(pairs):
        return plain
    marked, seen = RepeatedKey(plain), set[str]()
    for key, _ in pairs:
        if key in seen:
            marked.repeated = key
        seen.add(key)
    return marked
