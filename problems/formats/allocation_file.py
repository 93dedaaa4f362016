"""Allocations as files (alloc-allocation/1), and those inside results (alloc-result/1)."""

from typing import cast

from alloc.problems.allocation import Allocation
from alloc.problems.arguments import of_type
from alloc.problems.errors import InputError
from alloc.problems.formats import json_text
from alloc.problems.formats.columns import check_names, require_format
from alloc.problems.formats.files import PathLike, named, read_text, write_text_atomically
from alloc.problems.formats.json_columns import require_known
from alloc.problems.formats.messages import described, quoted, told
from alloc.problems.instance import Instance
from alloc.problems.models.solution import is_solution, solution_allocation

ALLOCATION_FORMAT = "alloc-allocation/1"
RESULT_FORMAT = "alloc-result/1"

FRONT_FORMAT = "alloc-pareto/1"

ALLOCATION_FIELDS = ("format", "instance", "assignment")


def read_allocation(path: PathLike, instance: Instance) -> tuple[Allocation, str | None]:
    """Read an allocation, or the allocation in a result, or in a solver's solution of a model by `write_model`.

    Parameters
    ----------
    path : str or path
        A JSON file whatever its suffix, or a solution file of HiGHS, CBC, Gurobi or SCIP; ``-`` for standard input.
    instance : Instance
        What the ids belong to.

    Returns
    -------
    allocation : Allocation
        Agents that the file leaves out are idle.
    warning : str or None
        One line, where the file names another instance.

    Raises
    ------
    InputError
        If it cannot be read, breaks the rules of its format, or names an unknown agent or task.
    """
    allocation, warning, _ = read_claims(path, instance)
    return allocation, warning


def read_claims(path: PathLike, instance: Instance) -> tuple[Allocation, str | None, dict[str, object]]:
    """Read an allocation as `read_allocation` does, and the other fields of the file where it is a result.

    Returns
    -------
    allocation, warning
        As `read_allocation` returns them.
    claims : dict
        What the result says of itself, which nobody has checked; empty for an allocation alone.
    """
    source = named(path)
    of_type(instance, Instance, "instance")
    try:
        content = read_text(path)
        if is_solution(content) or (source.lower().endswith(".sol") and not content.lstrip().startswith("{")):
            return solution_allocation(content, instance), None, {}
        document = json_text.require_object(json_text.parse(content))
        allocation, name = allocation_from_document(document, instance)
    except InputError as error:
        raise told(error, source) from error.__cause__
    claims = document if document["format"] == RESULT_FORMAT else {}
    return allocation, _other_instance(source, name, instance), claims


def read_assignment(path: PathLike) -> dict[str, str | None]:
    """Read the task id of each agent id, whatever instance they belong to.

    Parameters
    ----------
    path : str or path
        As for `read_allocation`.

    Raises
    ------
    InputError
        If it cannot be read, or breaks the rules of its format.
    """
    try:
        return _assignment(json_text.require_object(json_text.parse(read_text(path))))
    except InputError as error:
        raise told(error, named(path)) from error.__cause__


def read_allocations(path: PathLike, instance: Instance) -> tuple[list[Allocation], str | None]:
    """Read all allocations of a front (alloc-pareto/1), or the one of a file that `read_allocation` takes.

    Returns
    -------
    allocations : list of Allocation
    warning : str or None
        One line, where the file names another instance.

    Raises
    ------
    InputError
        As `read_allocation` does.
    """
    source = named(path)
    try:
        document = json_text.parse(read_text(path))
        if not isinstance(document, dict) or document.get("format") != FRONT_FORMAT:
            allocation, name = allocation_from_document(document, instance)
            allocations = [allocation]
        else:
            allocations, name = _front_from_document(document, instance)
    except InputError as error:
        raise told(error, source) from error.__cause__
    return allocations, _other_instance(source, name, instance)


def _front_from_document(document: dict[str, object], instance: Instance) -> tuple[list[Allocation], str | None]:
    points = document.get("points")
    if not isinstance(points, list):
        raise InputError(f"must be a list of points, got {described(points)}", "points")
    name, found = document.get("instance"), []
    for number, point in enumerate(points):
        fields = json_text.require_object(point, f"points[{number}]")
        inner = {"format": ALLOCATION_FORMAT, "instance": name, "assignment": fields.get("assignment")}
        try:
            found.append(allocation_from_document(inner, instance)[0])
        except InputError as error:
            raise InputError(error.message, f"points[{number}].{error.place}") from error
    return found, _instance_name(document)


def _other_instance(source: str, name: str | None, instance: Instance) -> str | None:
    if name is None or name == instance.name:
        return None
    return f"{source}: made for instance {quoted(name)}, used for {quoted(instance.name)}"


def write_allocation(allocation: Allocation, instance: Instance, path: PathLike) -> None:
    """Write an allocation as JSON; ``-`` is standard output.

    Parameters
    ----------
    allocation : Allocation
    instance : Instance
        The instance of the allocation.
    path : str or path

    Raises
    ------
    InputError
        If it cannot be written.
    """
    source = named(path, output=True)
    of_type(instance, Instance, "instance")
    of_type(allocation, Allocation, "allocation")
    try:
        write_text_atomically(path, json_text.lines(allocation_to_document(allocation, instance)))
    except InputError as error:
        raise told(error, source) from error.__cause__


def allocation_to_document(allocation: Allocation, instance: Instance) -> dict[str, object]:
    """Return `allocation` as plain objects; every agent appears, idle ones with None."""
    check_names(instance, "instance")
    return {"format": ALLOCATION_FORMAT, "instance": instance.name, "assignment": allocation.to_ids(instance)}


def allocation_from_document(document: object, instance: Instance) -> tuple[Allocation, str | None]:
    """Return the allocation in plain objects, and the name of the instance that it was made for, if given.

    Raises
    ------
    InputError
        If the document breaks the rules of the format, or names an unknown agent or task.
    """
    fields = json_text.require_object(document)
    return Allocation.from_ids(instance, _assignment(fields)), _instance_name(fields)


def _assignment(fields: dict[str, object]) -> dict[str, str | None]:
    """Return the task id of each agent id in an allocation or a result."""
    require_format(fields.get("format"), (ALLOCATION_FORMAT, RESULT_FORMAT))
    if fields["format"] == ALLOCATION_FORMAT:
        require_known(fields, ALLOCATION_FIELDS, "")
    elif fields.get("status") == "no_solution":
        raise InputError("this result holds no allocation; give one with another status", "status")
    _instance_name(fields)
    if fields.get("assignment") is None:
        raise InputError("is missing; it must give the task of each agent", "assignment")
    assignment = json_text.require_object(fields["assignment"], "assignment")
    if not set(map(type, assignment.values())) <= {str, type(None)}:
        for agent, task in assignment.items():
            if not isinstance(task, str | None):
                raise InputError(f"must be the id of a task, or null, got {described(task)}", f"assignment.{agent}")
    return cast("dict[str, str | None]", assignment)


def _instance_name(document: dict[str, object]) -> str | None:
    name = document.get("instance")
    if not isinstance(name, str | None):
        raise InputError(f"must be a string, got {described(name)}", "instance")
    return name
