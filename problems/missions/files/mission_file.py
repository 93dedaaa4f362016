"""Reading and writing missions."""

from pathlib import Path

from alloc.problems.arguments import of_type
from alloc.problems.errors import InputError
from alloc.problems.formats import json_text
from alloc.problems.formats.files import PathLike, is_stream, named, read_text, write_text_atomically
from alloc.problems.formats.instance_file import name_of, read_instance
from alloc.problems.formats.messages import told
from alloc.problems.missions.files.document import mission_from_document, mission_to_document
from alloc.problems.missions.mission import Mission


def read_mission(path: PathLike) -> Mission:
    """Read a mission, or an instance as a mission without events.

    Parameters
    ----------
    path : str or path
        ``*.json``, ``-`` for JSON from standard input, or an instance in any of its formats.

    Returns
    -------
    Mission

    Raises
    ------
    InputError
        If it cannot be read or breaks the rules of its format: one line with source, place and remedy.
    """
    if not is_stream(path) and Path(path).suffix.lower() != ".json":
        return Mission(read_instance(path))
    try:
        name = {} if is_stream(path) else {"default_name": name_of(path)}
        return mission_from_document(json_text.parse(read_text(path)), **name)
    except InputError as error:
        raise told(error, named(path)) from error.__cause__


def write_mission(mission: Mission, path: PathLike) -> None:
    """Write a mission; `read_mission` returns an equal one.

    Parameters
    ----------
    mission : Mission
    path : str or path
        ``*.json``, or ``-`` for standard output; an existing file is replaced atomically.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    of_type(mission, Mission, "mission")
    source = named(path, output=True)
    try:
        if not is_stream(path) and Path(path).suffix.lower() != ".json":
            raise InputError("is not a name for a mission; use .json, or - for standard output")
        write_text_atomically(path, json_text.lines(mission_to_document(mission)))
    except InputError as error:
        raise told(error, source) from error.__cause__
