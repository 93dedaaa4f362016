"""What a result file states about its allocation, held against the scores of this instance."""

import json
import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace

from alloc.allocators.result import Result
from alloc.allocators.result_document import SCORES
from alloc.problems import InputError
from alloc.problems.text import number

BOUNDS = {"lower_bound": "makespan", "energy_lower_bound": "energy"}
"""Bounds, and what they are bounds on."""

CLOSE = 1e-9
"""Relative difference up to which two scores are one."""


def with_claims(result: Result, claims: Mapping[str, object]) -> tuple[Result, list[str]]:
    """Return the result with the bounds of a result file, where they hold, and a line for each that does not.

    Parameters
    ----------
    result : Result
        The allocation of the file, scored on this instance.
    claims : mapping
        Fields of the file, which nobody has checked.

    Returns
    -------
    result : Result
    lines : list of str
        What the file states that is not so here. Where a score differs, no bound is taken over: it was proven for
        another instance.
    """
    wrong = next(_differences(result, claims), None)
    if wrong is not None:
        left_out = any(claims.get(name) is not None for name in BOUNDS)
        return result, [f"{wrong}{'; its bounds are left out' if left_out else ''}"]
    if result.makespan is None:
        return result, []
    lines, bounds = [], {}
    for name, value in BOUNDS.items():
        stated, score = claims.get(name), getattr(result, value)
        bound = _number(stated)
        if bound is not None and bound <= score * (1 + CLOSE):
            bounds[name] = bound
        elif stated is not None:
            lines.append(f"its {name} {_shown(stated)} is no bound on the {value}, {number(score)}, and is left out")
    if "lower_bound" in bounds and not claims.get("pins"):
        result = replace(result, lower_bound=max(bounds["lower_bound"], result.lower_bound or 0.0))
    if claims.get("pins"):
        return result, [*lines, "what it states as proven holds for its pins alone, and is left out"]
    limit = _number(claims.get("makespan_limit"))
    result = replace(result, energy_lower_bound=bounds.get("energy_lower_bound"), makespan_limit=limit)
    return _with_moves(result, claims), lines


def _with_moves(result: Result, claims: Mapping[str, object]) -> Result:
    """Return the result with the moves against a plan in force, and the bound on their cost, if the file has them."""
    if claims.get("moves") is None:
        return result
    try:
        return replace(result, moves=Result.from_dict(claims, result.instance).moves)
    except InputError:
        return result


def _differences(result: Result, claims: Mapping[str, object]) -> Iterator[str]:
    """Yield how the file and the result differ: in the name of the instance, in the agents, in the scores."""
    found = result.to_dict()
    if claims.get("instance") not in (None, found["instance"]):
        yield "it is for another instance"
    claimed, assignment = claims.get("assignment"), found["assignment"]
    if isinstance(claimed, dict) and isinstance(assignment, dict) and claimed.keys() != assignment.keys():
        yield "it is for another set of agents"
    for name in SCORES:
        if not _is_close(claims.get(name), found[name]):
            yield f"its {name} is {_shown(claims.get(name))}, but on this instance it is {_shown(found[name])}"
    if claims.get("unserved_tasks", found["unserved_tasks"]) != found["unserved_tasks"]:
        yield "other tasks are unserved on this instance than it states"


def _is_close(one: object, other: object) -> bool:
    first, second = _number(one), _number(other)
    return one is other if first is None or second is None else math.isclose(first, second, rel_tol=CLOSE)


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= sys.float_info.max:
        return None
    return float(value)


def _shown(value: object) -> str:
    known = _number(value)
    return json.dumps(value)[:60] if known is None else number(known, 10)
