"""Reading of result documents (alloc-result/1): the fields are checked against the scores of the allocation."""

import math
from collections.abc import Mapping
from typing import TypedDict

from alloc.allocators.contract.budget import StopReason
from alloc.allocators.contract.improvement import TracePoint
from alloc.allocators.contract.status import Status
from alloc.allocators.contract.tolerance import EXACT, MakespanTolerance
from alloc.allocators.replanning.moves import Moves
from alloc.problems import Allocation, Evaluation, InputError, Instance, Objective, evaluate
from alloc.problems.arguments import choice, of_type, real, shown, text, whole
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.formats.allocation_file import RESULT_FORMAT
from alloc.problems.formats.columns import require_format

SCORES = ("makespan", "served_makespan", "energy", "distance", "battery_remaining_percent", "reward")
"""Fields that must match what `evaluate` returns for the allocation."""


class ResultFields(TypedDict):
    """Arguments of `Result` other than the instance and the notes."""

    method: str
    objective: Objective
    seed: int
    allocation: Allocation | None
    evaluation: Evaluation | None
    lower_bound: float | None
    energy_lower_bound: float | None
    stop_reason: StopReason
    runtime_s: float
    trace: tuple[TracePoint, ...]
    makespan_limit: float | None
    tolerance: MakespanTolerance
    moves: Moves | None
    pins: dict[str, str | None]
    parameters: dict[str, object]


def result_fields(document: Mapping[str, object], instance: Instance) -> ResultFields:
    """Return the arguments of `Result` from a document of a result on `instance`.

    Parameters
    ----------
    document : mapping
        As `Result.to_dict` returns it.
    instance : Instance

    Raises
    ------
    InputError
        If a field is missing or wrong, an id is unknown, or the scores do not match this instance.
    """
    of_type(instance, Instance, "instance")
    fields = dict(of_type(document, Mapping, "document"))
    require_format(fields.get("format"), (RESULT_FORMAT,))
    status = choice(Status, fields.get("status"), "status")
    allocation = evaluation = None
    if status is not Status.NO_SOLUTION:
        allocation = Allocation.from_ids(instance, of_type(fields.get("assignment"), dict, "assignment"))
        evaluation = evaluate(instance, allocation)
        _require_scores(fields, evaluation)
    limit = _nullable(fields, "makespan_limit")
    return {
        "method": text(fields.get("method"), "method"),
        "objective": choice(Objective, fields.get("objective"), "objective"),
        "seed": whole(_integral(fields.get("seed")), "seed"),
        "allocation": allocation,
        "evaluation": evaluation,
        "lower_bound": _nullable(fields, "lower_bound"),
        "energy_lower_bound": _nullable(fields, "energy_lower_bound"),
        "stop_reason": choice(StopReason, fields.get("stop_reason"), "stop_reason"),
        "runtime_s": real(fields.get("runtime_s"), "runtime_s"),
        "trace": tuple(
            _trace_point(point, f"trace[{number}]")
            for number, point in enumerate(of_type(fields.get("trace", []), list, "trace"))
        ),
        "makespan_limit": limit,
        # the slack is not in the document; it matters only if the proof needed it
        "tolerance": MakespanTolerance(limit=limit) if limit and status is Status.OPTIMAL else EXACT,
        "pins": _pins(of_type(fields.get("pins", {}), dict, "pins"), instance),
        "moves": None if fields.get("moves") is None else _moves(of_type(fields["moves"], dict, "moves"), instance),
        "parameters": dict(of_type(fields.get("parameters", {}), dict, "parameters")),
    }


def _pins(pins: Mapping[str, object], instance: Instance) -> dict[str, str | None]:
    """Return the task id of each pinned agent."""
    for agent, task in pins.items():
        if agent not in instance.agent_index or not (task is None or task in instance.task_index):
            raise InputError(f"pins {shown(agent)} to {shown(task)}, but instance {instance.name!r} lacks one", "pins")
    return {agent: None if task is None else str(task) for agent, task in pins.items()}


def moves_document(moves: Moves, instance: Instance) -> dict[str, object]:
    """Return the differences from the plan in force, ready for JSON."""
    return {
        "moved": [instance.agent_ids[i] for i in moves.agents],
        "stayed": moves.stayed,
        "idle": [instance.agent_ids[i] for i in moves.idle],
        "price": moves.price,
        "cost": moves.cost,
        "cost_lower_bound": moves.cost_lower_bound,
        "gap": moves.gap,
    }


def _moves(fields: Mapping[str, object], instance: Instance) -> Moves:
    """Return the moves whose `moves_document` gave `fields`."""
    names = {key: of_type(fields.get(key), list, f"moves.{key}") for key in ("moved", "idle")}
    for key, ids in names.items():
        for name in ids:
            if name not in instance.agent_index:
                raise InputError(f"no agent {shown(name)} in instance {instance.name!r}", f"moves.{key}")
    return Moves(
        agents=tuple(instance.agent_index[name] for name in names["moved"]),
        stayed=whole(_integral(fields.get("stayed")), "moves.stayed"),
        idle=tuple(instance.agent_index[name] for name in names["idle"]),
        price=real(fields.get("price"), "moves.price"),
        cost=_nullable(fields, "cost"),
        cost_lower_bound=_nullable(fields, "cost_lower_bound"),
    )


def _require_scores(fields: Mapping[str, object], evaluation: Evaluation) -> None:
    """Raise an error unless the scores of the document match this instance."""
    for name in SCORES:
        found, expected = _nullable(fields, name, low=-math.inf), getattr(evaluation, name)
        if (found is None) != (expected is None) or (
            found is not None and not math.isclose(found, expected, rel_tol=RELATIVE_TOLERANCE)
        ):
            message = f"is {shown(found)}, but on this instance the allocation has {shown(expected)}"
            raise InputError(message, name)


def _trace_point(point: object, place: str) -> TracePoint:
    fields = of_type(point, dict, place)
    return TracePoint(
        real(fields.get("time_s"), f"{place}.time_s"), _nullable(fields, "makespan"), real(fields.get("energy"), place)
    )


def _nullable(fields: Mapping[str, object], name: str, low: float = 0.0) -> float | None:
    value = fields.get(name)
    return None if value is None else real(value, name, low)


def _integral(value: object) -> object:
    """Convert a float without a fractional part to int: some JSON readers return whole numbers as floats."""
    return int(value) if isinstance(value, float) and value.is_integer() else value
