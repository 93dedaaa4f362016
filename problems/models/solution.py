"""The allocation in a solver's solution of a model: files of HiGHS, CBC, Gurobi and SCIP."""

import re
from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from alloc.problems.allocation import Allocation
from alloc.problems.errors import InputError, nearest
from alloc.problems.instance import Instance
from alloc.problems.models.grouping import MOST_PAIRS, Grouping, grouped
from alloc.problems.models.names import SEPARATOR, plain_names
from alloc.problems.models.programme import RATIO

HEAD = re.compile(
    r"(model status|solution status|objective value:|# (solution|objective)|optimal|(integer )?infeasible|unbounded"
    r"|stopped|columns\s+index\s+status)",
    re.IGNORECASE,
)
"""How such a file begins, in HiGHS (last of all its pretty style), SCIP, Gurobi and CBC."""

NO_SOLUTION = re.compile(r"(solution status:|model status)?\s*(integer )?(infeasible|unbounded)", re.IGNORECASE)
NO_SOLUTION_AT_END = re.compile(r"^model status:\s*(primal )?(infeasible|unbounded)", re.IGNORECASE | re.MULTILINE)
"""The verdict in HiGHS's pretty style, in which empty values stand before it."""

PRETTY_HEADER = re.compile(r"\s+Index Status\s+Lower\s+Upper(?P<value>\s+Primal)\s+Dual\b.*\bName")
"""Above the variables in HiGHS's pretty style: cells may be empty, so that only the place in the line tells them."""

VARIABLE = re.compile(rf"([{''.join(Grouping)}])_(\w+?){SEPARATOR}(\w+)", re.ASCII)

WHOLE = 1e-4
"""How far a value may be from a whole number: solvers take 1e-5 or less for none."""


def is_solution(text: str) -> bool:
    """Return whether a text begins as solvers' solutions do."""
    return HEAD.match(text.lstrip()) is not None


def solution_allocation(text: str, instance: Instance) -> Allocation:
    """Return the allocation in a solution of a model that `write_model` wrote for `instance`.

    Counts of a class are spread over its agents; variables that are left out are 0.

    Parameters
    ----------
    text : str
        What a solver wrote: a line for each variable, with its name and value.
    instance : Instance

    Raises
    ------
    InputError
        If there is no solution, a variable is not of this instance, or values are no whole numbers or too many.
    """
    if NO_SOLUTION.match(text.lstrip()) or NO_SOLUTION_AT_END.search(text):
        raise InputError("the solver found no solution", "line 1")
    found = list(_values(text))
    if not found:
        raise InputError("has no variable of a model that `alloc export` writes")
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
        if line.startswith(("# Rows", "# Dual", "Rows")):  # of HiGHS, after the values
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
    """Return what may be a name and its value; CBC puts a number, or two asterisks too, before the name.

    Parameters
    ----------
    line : str
    cell : slice or None
        Where the value stands, in a file whose lines end with the name.
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
    """Turn values of variables into an allocation."""
    agents = {name: index for index, name in enumerate(plain_names(instance.agent_ids, "agent"))}
    tasks = {name: index for index, name in enumerate(plain_names(instance.task_ids, "task"))}
    groups = grouped(instance, grouping)
    counts = np.zeros(groups.mask.shape, dtype=np.intp)
    left = groups.count.copy()
    for line, _, agent, task, value in found:
        for kind, name, known in (("agent", agent, agents), ("task", task, tasks)):
            if name not in known:
                message = f"no {kind} of instance {instance.name!r} is called {name!r} in its models"
                raise InputError(message + nearest(name, tuple(known)), f"line {line}")
        number, of = _count(value, line), groups.class_of_agent[agents[agent]]
        counts[of, tasks[task]] += number
        left[of] -= number
        if left[of] < 0:
            raise InputError(f"with this, agents like {agent} have more tasks than they are", f"line {line}")
    return groups.spread(counts)


def _count(value: float, line: int) -> int:
    """Return a value as the whole number that it should be."""
    if not (-WHOLE <= value <= MOST_PAIRS) or abs(value - round(value)) > WHOLE:
        raise InputError(f"{value:g} is not a number of agents; is this the solution of a relaxation?", f"line {line}")
    return round(value)
