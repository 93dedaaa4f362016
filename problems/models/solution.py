"""Parsing of solution files of HiGHS, CBC, Gurobi and SCIP into allocations."""

import re
from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from alloc.problems.allocation import Allocation
from alloc.problems.errors import InputError, nearest
from alloc.problems.instance import Instance
from alloc.problems.models.grouping import MAX_PAIRS, Grouping, grouped
from alloc.problems.models.names import SEPARATOR, plain_names
from alloc.problems.models.programme import RATIO

HEAD = re.compile(
    r"(model status|solution status|objective value:|# (solution|objective)|optimal|(integer )?infeasible|unbounded"
    r"|stopped|columns\s+index\s+status)",
    re.IGNORECASE,
)
"""Beginnings of solution files of HiGHS (last its pretty style), SCIP, Gurobi and CBC."""

NO_SOLUTION = re.compile(r"(solution status:|model status)?\s*(integer )?(infeasible|unbounded)", re.IGNORECASE)
NO_SOLUTION_AT_END = re.compile(r"^model status:\s*(primal )?(infeasible|unbounded)", re.IGNORECASE | re.MULTILINE)
"""The model status in HiGHS's pretty style, in which it follows a table with empty values."""

PRETTY_HEADER = re.compile(r"\s+Index Status\s+Lower\s+Upper(?P<value>\s+Primal)\s+Dual\b.*\bName")
"""Header of the variables in HiGHS's pretty style; as cells may be empty, columns are found by position."""

VARIABLE = re.compile(rf"([{''.join(Grouping)}])_(\w+?){SEPARATOR}(\w+)", re.ASCII)

WHOLE = 1e-4
"""Tolerance on integrality; solvers use at most 1e-5."""


def is_solution(text: str) -> bool:
    """Return whether a text begins like a solution file."""
    return HEAD.match(text.lstrip()) is not None


def solution_allocation(text: str, instance: Instance) -> Allocation:
    """Return the allocation in a solution of a model of `write_model` for `instance`.

    Counts of a class are assigned to its agents in order; missing variables are 0.

    Parameters
    ----------
    text : str
        Solution file, with a line for each variable with its name and value.
    instance : Instance

    Raises
    ------
    InputError
        If there is no solution, a variable is not of this instance, or values are not integers or too large.
    """
    if NO_SOLUTION.match(text.lstrip()) or NO_SOLUTION_AT_END.search(text):
        raise InputError("the solver found no solution", "line 1")
    found = list(_values(text))
    if not found:
        raise InputError("has no variable of a model of `alloc export`")
    letters = {letter for _, letter, *_ in found if letter != RATIO}
    if len(letters) > 1:
        raise InputError(f"mixes variables of several models: {', '.join(sorted(letters))}")
    grouping = Grouping(letters.pop()) if letters else Grouping.AGENT
    return _spread(instance, grouping, [entry for entry in found if entry[1] != RATIO])


Entry = tuple[int, str, str, str, float]
"""Line, first letter, name of the agent, name of the task, and value."""


def _values(text: str) -> Iterator[Entry]:
    """Yield the variables of a model with their values."""
    cell = None
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith(("# Rows", "# Dual", "Rows")):  # HiGHS, after the values
            return
        header = PRETTY_HEADER.match(line)
        if header is not None:
            cell = slice(*header.span("value"))
            continue
        for name, value in _pairs(line, cell):
            match = VARIABLE.fullmatch(name)
            if match is not None or name == RATIO:
                letter, agent, task = (RATIO, "", "") if match is None else match.groups()
                yield number, letter, agent, task, _number(value, name, number)
                break


def _pairs(line: str, cell: slice | None) -> Iterable[tuple[str, str]]:
    """Return candidates for a name and its value; CBC puts an index, and maybe two asterisks, before the name.

    Parameters
    ----------
    line : str
    cell : slice or None
        Position of the value in a file whose lines end with the name.
    """
    words = line.split()
    if cell is None:
        return pairwise(words[:4])
    return [(words[-1], line[cell].strip())] if words else []


def _number(value: str, name: str, line: int) -> float:
    try:
        return float(value)
    except ValueError as error:
        raise InputError(f"the value of {name} must be a number, got {value[:60]!r}", f"line {line}") from error


def _spread(instance: Instance, grouping: Grouping, found: list[Entry]) -> Allocation:
    """Return the allocation for values of variables."""
    agents = {name: index for index, name in enumerate(plain_names(instance.agent_ids, "agent"))}
    tasks = {name: index for index, name in enumerate(plain_names(instance.task_ids, "task"))}
    groups = grouped(instance, grouping)
    counts = np.zeros(groups.mask.shape, dtype=np.intp)
    left = groups.count.copy()
    for line, _, agent, task, value in found:
        for kind, name, known in (("agent", agent, agents), ("task", task, tasks)):
            if name not in known:
                message = f"no {kind} of instance {instance.name!r} has the name {name!r} in its models"
                raise InputError(message + nearest(name, tuple(known)), f"line {line}")
        number, of = _count(value, line), groups.class_of_agent[agents[agent]]
        counts[of, tasks[task]] += number
        left[of] -= number
        if left[of] < 0:
            raise InputError(f"with this, there are more tasks than agents like {agent}", f"line {line}")
    return groups.spread(counts)


def _count(value: float, line: int) -> int:
    """Return a value rounded to an integer, or raise an error if it is not close to one."""
    if not (-WHOLE <= value <= MAX_PAIRS) or abs(value - round(value)) > WHOLE:
        raise InputError(f"{value:g} is not a number of agents; is this the solution of a relaxation?", f"line {line}")
    return round(value)
