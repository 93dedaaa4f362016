"""File format of saved planners (alloc-planner/1)."""

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from typing import Any

from alloc.allocators.online.planner.estimate import News, StateEstimate
from alloc.allocators.online.planner.plan import OrderChange, Plan
from alloc.problems.errors import InputError
from alloc.problems.formats.columns import require_format
from alloc.problems.formats.files import PathLike, named, read_text, write_text_atomically
from alloc.problems.formats.json_columns import Row
from alloc.problems.formats.json_text import encode, require_object
from alloc.problems.formats.messages import told
from alloc.problems.missions.files.document import mission_from_document, mission_to_document
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.state import (
    AgentFacts,
    AgentState,
    AgentStatus,
    Flight,
    Order,
    TaskFacts,
    TaskState,
    TaskStatus,
)

PLANNER_FORMAT = "alloc-planner/1"

AGENT_LEDGERS = ("battery", "capacity", "distance", "energy")
TASK_LEDGERS = ("left", "since", "appeared", "grown", "done", "cancelled", "missed", "closed")


def document_of(estimate: StateEstimate, plan: Plan) -> Row:
    """Return the estimated state and the plan as plain objects."""
    state = estimate.state
    return {
        "hour": state.hour,
        "mission": mission_to_document(state.mission),
        "ever": {"agents": state.all_agents.ever, "tasks": state.all_tasks.ever},
        "forgotten": {
            "agents": state.all_agents.ever - len(state.all_agents),
            "tasks": state.all_tasks.ever - len(state.all_tasks),
        },
        "agents": [_agent(agent, state.mission.instance.n) for agent in state.all_agents],
        "tasks": [_task(task, state.mission.instance.m) for task in state.all_tasks],
        "news": [vars(news) for news in estimate.news],
        "plan": {
            "hour": plan.hour,
            "is_new": plan.is_new,
            "problem": plan.problem,
            "orders": {agent: order_to_row(order) for agent, order in plan.items()},
            "changes": [change_to_row(change) for change in plan.changes],
        },
    }


def order_to_row(order: Order | None) -> Row | None:
    """Return an order as plain objects: a task, a position, or neither to stay."""
    if order is None:
        return None
    return {"task": order.task, **({} if order.position is None else {"position": list(order.position)})}


def change_to_row(change: OrderChange) -> Row:
    """Return a change of an order as plain objects."""
    before, after = order_to_row(change.before), order_to_row(change.after)
    return {"agent": change.agent, "before": before, "after": after, "cause": change.cause}


def write(document: Row, path: PathLike) -> None:
    """Write a saved planner atomically."""
    write_text_atomically(path, encode({"format": PLANNER_FORMAT, **document}) + "\n")


def read(path: PathLike) -> Row:
    """Return the document of a planner in a file; raise `InputError` if it is not one."""
    source = named(path)
    try:
        document = require_object(json.loads(read_text(path)))  # keep integers: they may be parameters
        require_format(document.get("format"), (PLANNER_FORMAT,))
    except InputError as error:
        raise told(error, source) from error.__cause__
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not JSON: {error}", source=source) from error
    return document


@contextmanager
def reading(path: PathLike) -> Iterator[None]:
    """Add the name of the file to errors in its document."""
    try:
        yield
    except InputError as error:
        raise told(error, named(path)) from error.__cause__
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"is damaged or was edited: {error!r}", source=named(path)) from error


def mission_of(document: Row) -> Mission:
    """Return the mission with which a planner began."""
    return mission_from_document(document["mission"])


def restored(document: Row, estimate: StateEstimate) -> Plan:
    """Restore the saved state in the estimate of a new planner of the same mission, and return the plan."""
    state, hour = estimate.state, document["hour"]
    rows = _rows(document["agents"]), _rows(document["tasks"])
    ever, forgotten = require_object(document["ever"]), require_object(document["forgotten"])
    for kind, some in (("agents", rows[0]), ("tasks", rows[1])):
        if len(some) + _whole(forgotten[kind]) != _whole(ever[kind]):
            raise ValueError(f"{len(some)} {kind} of {ever[kind]}")
    state.all_agents.restore(
        [str(row["id"]) for row in rows[0]], map(_new_agent, _later(rows[0])), _whole(ever["agents"])
    )
    state.all_tasks.restore([str(row["id"]) for row in rows[1]], map(_new_task, _later(rows[1])), _whole(ever["tasks"]))
    for row in rows[1]:
        _restore_task(state.task(str(row["id"])), row)
    for row in rows[0]:
        _restore_agent(estimate, state.agent(str(row["id"])), row)
    for task in sorted(state.all_tasks, key=lambda task: task.closed):
        state.file_task(task)
    for agent in state.all_agents:
        state.file_agent(agent)
    for row in rows[1]:
        task = state.task(str(row["id"]))
        workers = [state.agent(str(name)) for name in row["workers"]]  # type: ignore[attr-defined]
        task.workers = {agent.index: agent for agent in workers}
        for agent in workers:
            agent.task = task
    state.hour = float(str(hour))
    estimate.restore_agenda()
    estimate.forget(estimate.news_count)
    for row in _rows(document["news"]):
        estimate.add_news(News(**row))  # type: ignore[arg-type]
    plan = require_object(document["plan"])
    orders = {name: _order(row) for name, row in require_object(plan["orders"]).items()}
    changes = tuple(
        OrderChange(str(row["agent"]), _order(row["before"]), _order(row["after"]), str(row["cause"]))
        for row in _rows(plan["changes"])
    )
    found = {name: order for name, order in orders.items() if order is not None}
    problem = None if plan["problem"] is None else str(plan["problem"])
    return Plan(float(str(plan["hour"])), found, bool(plan["is_new"]), problem, changes)


def _agent(agent: AgentState, initial_count: int) -> Row:
    flight = agent.flight
    return {
        "id": agent.facts.id,
        **_origin(agent, initial_count),
        "status": str(agent.status),
        "place": _place(agent.place),
        "order": order_to_row(agent.order),
        "flight": None
        if flight is None
        else {
            "source": _place(flight.source),
            "goal": _place(flight.goal),
            "task": None if flight.task is None else flight.task.facts.id,
            "distance": flight.distance,
            "departs": flight.departs,
            "arrives": flight.arrives,
        },
        **{name: _finite(getattr(agent, name)) for name in AGENT_LEDGERS},
    }


def _task(task: TaskState, initial_count: int) -> Row:
    return {
        "id": task.facts.id,
        **_origin(task, initial_count),
        "status": str(task.status),
        "appears": task.facts.appears,
        "begun": task.begun,
        "version": task.version,
        "workers": [agent.facts.id for agent in task.workers.values()],
        **{name: _finite(getattr(task, name)) for name in TASK_LEDGERS},
    }


def _origin(one: AgentState | TaskState, initial_count: int) -> Row:
    """Return the facts of an agent or a task that is not part of the mission, as it came later."""
    if one.index < initial_count:
        return {}
    facts = {field.name: _plain(getattr(one.facts, field.name)) for field in fields(one.facts)}
    workload = {"workload": one.workload} if isinstance(one, TaskState) else {}
    return {"index": one.index, **workload, "facts": facts}


def _plain(value: object) -> object:
    if isinstance(value, Place):
        return _place(value)
    if isinstance(value, frozenset):
        return sorted(value)
    return _finite(value) if isinstance(value, float) else value


def _facts(row: Row) -> dict[str, Any]:
    """Return the facts of an agent or a task by their names."""
    return {name: _fact(name, value) for name, value in require_object(row["facts"]).items()}


def _fact(name: str, value: Any) -> object:
    if name in ("id", "returns"):
        return value
    if name in ("start", "base", "place"):
        return None if value is None else _to_place(value)
    if name in ("skills", "needs", "tasks"):
        return None if value is None else frozenset(map(str, value))
    return math.inf if value is None else float(value)


def _new_agent(row: Row) -> AgentState:
    facts = AgentFacts(**_facts(row))
    return AgentState(_whole(row["index"]), facts, facts.start, 0.0, 0.0)


def _new_task(row: Row) -> TaskState:
    return TaskState(_whole(row["index"]), TaskFacts(**_facts(row)), float(str(row["workload"])))


def _whole(value: object) -> int:
    return int(str(value))


def _place(place: Place) -> Row:
    return {"position": place.position, "nodes": place.nodes}


def _finite(value: float) -> float | None:
    return None if value == math.inf else value


def _later(rows: list[Row]) -> list[Row]:
    """Return the rows of agents or tasks that came after the start of the mission."""
    return [row for row in rows if "facts" in row]


def _rows(value: object) -> list[Row]:
    if not isinstance(value, list):
        raise TypeError(f"{value!r} is not a list")
    return value


def _restore_task(task: TaskState, row: Row) -> None:
    task.status = TaskStatus(str(row["status"]))
    task.facts = replace(task.facts, appears=float(str(row["appears"])))
    task.begun, task.version = bool(row["begun"]), int(float(str(row["version"])))
    _restore_ledgers(task, row, TASK_LEDGERS)


def _restore_agent(estimate: StateEstimate, agent: AgentState, row: Row) -> None:
    agent.status, agent.place = AgentStatus(str(row["status"])), _to_place(row["place"])
    order, flight = _order(row["order"]), row["flight"]
    assert order is not None
    agent.order, agent.flight, agent.task = order, None, None
    if flight is not None:
        said = require_object(flight)
        task = None if said["task"] is None else estimate.state.task(str(said["task"]))
        hours = (float(str(said[name])) for name in ("distance", "departs", "arrives"))
        agent.flight = Flight(_to_place(said["source"]), _to_place(said["goal"]), task, *hours)
    _restore_ledgers(agent, row, AGENT_LEDGERS)


def _restore_ledgers(state: AgentState | TaskState, row: Row, names: tuple[str, ...]) -> None:
    for name in names:
        value = row[name]
        setattr(state, name, math.inf if value is None else float(str(value)))


def _to_place(row: object) -> Place:
    place = require_object(row)
    nodes, position = place["nodes"], place["position"]
    return Place(_to_position(position), tuple(int(node) for node in nodes))  # type: ignore[attr-defined]


def _to_position(value: object) -> tuple[float, float, float] | None:
    if value is None:
        return None
    x, y, z = (float(str(axis)) for axis in value)  # type: ignore[attr-defined]
    return x, y, z


def _order(row: object) -> Order | None:
    if row is None:
        return None
    order = require_object(row)
    task = order["task"]
    return Order(None if task is None else str(task), _to_position(order.get("position")))
