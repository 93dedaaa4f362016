"""Plans in files: allocations (alloc-allocation/1), results (alloc-result/1), tables, and solver solutions."""

import json
from dataclasses import dataclass
from typing import cast

from alloc.problems.allocation import Allocation
from alloc.problems.arguments import of_type
from alloc.problems.errors import InputError
from alloc.problems.formats import json_text
from alloc.problems.formats.columns import check_names, require_format
from alloc.problems.formats.csv_table import parse_table
from alloc.problems.formats.files import PathLike, named, read_text, write_text_atomically
from alloc.problems.formats.json_columns import require_known
from alloc.problems.formats.messages import described, quoted, told
from alloc.problems.instance import Instance
from alloc.problems.models.solution import is_solution, solution_allocation

ALLOCATION_FORMAT = "alloc-allocation/1"
RESULT_FORMAT = "alloc-result/1"

FRONT_FORMAT = "alloc-pareto/1"

ALLOCATION_FIELDS = ("format", "instance", "assignment")

LARGEST_EXACT = 2**53
"""Limit beyond which floats cannot represent all integers."""

TABLE_COLUMNS = ("agent", "task")
"""Required columns of a table with a plan, as `write_result` writes it."""


@dataclass(frozen=True)
class PlanFile:
    """A plan as read from a file of any format, not yet checked against an instance.

    Attributes
    ----------
    source : str
        Name of the file in messages.
    document : dict
        An allocation or a result; tables and solver solutions are converted to an allocation.
    """

    source: str
    document: dict[str, object]

    @property
    def result(self) -> dict[str, object]:
        """Unverified fields of a result; empty for a plan alone."""
        return self.document if self.document.get("format") == RESULT_FORMAT else {}

    def assignment(self) -> dict[str, str | None]:
        """Return the task id of each agent id, None for idle, without reference to an instance.

        Raises
        ------
        InputError
            If the document breaks the rules of its format; the message names the file.
        """
        try:
            return _assignment(self.document)
        except InputError as error:
            raise told(error, self.source) from error.__cause__

    def allocation(self, instance: Instance) -> tuple[Allocation, str | None]:
        """Return the plan as an allocation of `instance`, and a one-line warning if the file names another instance.

        Raises
        ------
        InputError
            As for `assignment`, or if an agent or task is unknown.
        """
        try:
            allocation, name = allocation_from_document(self.document, instance)
        except InputError as error:
            raise told(error, self.source) from error.__cause__
        return allocation, _other_instance(self.source, name, instance)


def read_plan(path: PathLike, instance: Instance) -> PlanFile:
    """Read a plan from a file of any supported format.

    Parameters
    ----------
    path : str or path
        JSON with an allocation or a result, with any suffix; a ``.csv`` table with the columns agent and task; or a
        solution file of HiGHS, CBC, Gurobi or SCIP for a model of `write_model`. ``-`` is standard input, where the
        first line determines the format.
    instance : Instance
        Instance of the names in a solution file; ids in other files are not checked.

    Raises
    ------
    InputError
        If the file cannot be read or has none of these formats.
    """
    source = named(path)
    of_type(instance, Instance, "instance")
    if source.lower().endswith(".xlsx"):
        raise InputError("is a workbook; give the plan as .json, or save its sheet of agents as .csv", source=source)
    try:
        return PlanFile(source, _document(read_text(path), source, instance))
    except InputError as error:
        raise told(error, source) from error.__cause__


def _document(text: str, source: str, instance: Instance) -> dict[str, object]:
    suffix, is_json = source.lower()[-4:], text.lstrip().startswith("{")
    if is_solution(text) or (suffix == ".sol" and not is_json):
        return {"format": ALLOCATION_FORMAT, "assignment": solution_allocation(text, instance).to_ids(instance)}
    if not is_json and (suffix == ".csv" or _has_table_header(text)):
        return {"format": ALLOCATION_FORMAT, "assignment": _table_assignment(text)}
    return parse_result(text)


def _has_table_header(text: str) -> bool:
    """Return whether the first line has the column names of a plan."""
    header = text.lstrip().partition("\n")[0].split(",")
    return set(TABLE_COLUMNS) <= {name.strip().strip('"') for name in header}


def _table_assignment(text: str) -> dict[str, str | None]:
    """Return the task id of each agent id in a table, None for empty cells; other columns are ignored."""
    table = parse_table(text, TABLE_COLUMNS)
    found: dict[str, str | None] = {}
    for row, (agent, task) in enumerate(zip(*map(table.cells.__getitem__, TABLE_COLUMNS), strict=True)):
        if not agent or agent in found:
            problem = f"{quoted(agent)} occurs twice; remove one" if agent else "is missing"
            raise InputError(problem, table.place(row, TABLE_COLUMNS[0]))
        found[agent] = task or None
    return found


def parse_result(text: str) -> dict[str, object]:
    """Return the object in a JSON text; unlike other integers, which become floats, the seed stays exact.

    Raises
    ------
    InputError
        If it is not a JSON object.
    """
    document = json_text.require_object(json_text.parse(text))
    seed = document.get("seed")
    if isinstance(seed, float) and seed >= LARGEST_EXACT:
        document["seed"] = json.loads(text, parse_int=lambda digits: int(digits[:20]))["seed"]
    return document


def read_allocation(path: PathLike, instance: Instance) -> tuple[Allocation, str | None]:
    """Read an allocation from JSON, a result, a ``.csv`` table, or a solver's solution of a model of `write_model`.

    Parameters
    ----------
    path : str or path
        A JSON file with any suffix, a table with the columns agent and task, or a solution file of HiGHS, CBC, Gurobi
        or SCIP; ``-`` for standard input.
    instance : Instance
        Instance of the ids.

    Returns
    -------
    allocation : Allocation
        Agents that are not in the file are idle.
    warning : str or None
        One line, where the file names another instance.

    Raises
    ------
    InputError
        If it cannot be read, breaks the rules of its format, or names an unknown agent or task.
    """
    return read_plan(path, instance).allocation(instance)


def read_allocations(path: PathLike, instance: Instance) -> tuple[list[Allocation], str | None]:
    """Read all allocations of a front (alloc-pareto/1), or a single one as `read_allocation` does.

    Returns
    -------
    allocations : list of Allocation
    warning : str or None
        One line, where the file names another instance.

    Raises
    ------
    InputError
        As for `read_allocation`.
    """
    plan = read_plan(path, instance)
    if plan.document.get("format") != FRONT_FORMAT:
        allocation, warning = plan.allocation(instance)
        return [allocation], warning
    try:
        allocations, name = _front_from_document(plan.document, instance)
    except InputError as error:
        raise told(error, plan.source) from error.__cause__
    return allocations, _other_instance(plan.source, name, instance)


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
    """Return `allocation` as plain objects; all agents are included, idle ones with None."""
    check_names(instance, "instance")
    return {"format": ALLOCATION_FORMAT, "instance": instance.name, "assignment": allocation.to_ids(instance)}


def allocation_from_document(document: object, instance: Instance) -> tuple[Allocation, str | None]:
    """Return the allocation in plain objects, and the name of its instance, if given.

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
        raise InputError("this result contains no allocation; give one with another status", "status")
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
