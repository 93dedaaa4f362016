"""A plan as a self-contained page with a map, which a browser opens from disk without a network."""

import json
import re
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plan.places import Base, Places, bases, places
from alloc.allocators.plan.table import (
    AgentRow,
    TaskRow,
    Value,
    agent_columns,
    agent_rows,
    task_columns,
    task_rows,
)
from alloc.problems import Instance
from alloc.problems.text import number, one_line

if TYPE_CHECKING:
    from alloc.allocators.result import Result
    from alloc.problems.instance import FloatArray

MAX_AGENTS = 20_000
"""Maximum number of agents; with more, browsers draw the page slowly."""

SIZE = 1000.0
"""Larger of width and height of the drawing, in its own units."""

Entry = dict[str, object]


def to_html(result: "Result") -> str:
    """Return the page, made from the templates beside this module with the plan as JSON."""
    data = json.dumps(document(result), allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")
    parts = {"TITLE": escape(one_line(result.instance.name)), "PLAN": data}
    parts |= {"STYLE": _text_of("map.css"), "SCRIPT": _text_of("map.js")}
    return re.sub(r"\$([A-Z]+)", lambda mark: parts[mark[1]], _text_of("map.html"))


def _text_of(name: str) -> str:
    return (files(__package__) / name).read_text(encoding="utf-8")


def document(result: "Result") -> Entry:
    """Return the content of the page: names, positions from 0 to `SIZE`, and figures as text."""
    instance = result.instance
    where = places(instance)
    low, scale = _frame(where)
    begin = bases(instance, where)
    columns, task_heads = agent_columns(instance), [column.heading for column in task_columns(instance)[:-1]]
    agents, tasks = agent_rows(result), task_rows(result)
    return {
        "name": one_line(instance.name),
        "summary": str(result).splitlines(),
        "axes": where.axes,
        "origin": low.tolist(),
        "scale": scale.tolist(),
        "size": SIZE,
        "taskHeadings": task_heads,
        "agentHeadings": [column.heading for column in columns],
        "tasks": _tasks(instance, tasks, (where.tasks - low) / scale),
        "bases": [_base(base, (base.place - low) / scale) for base in begin],
        "agents": _agents(instance, agents, begin, where),
    }


def _frame(where: Places) -> "tuple[FloatArray, FloatArray]":
    """Return the lower left corner of all positions, and the length of one drawing unit on each axis."""
    known = where.known
    low, high = known.min(axis=0), known.max(axis=0)
    unit = max(float(high[0] - low[0]), float(high[1] - low[1]) * where.aspect) / SIZE or 1.0
    return low, np.array([unit, unit / where.aspect])


def _tasks(instance: Instance, rows: list[TaskRow], place: "FloatArray") -> list[Entry]:
    columns = task_columns(instance)[:-1]
    times = [row.completion_time for row in rows if row.completion_time is not None]
    low, high = min(times, default=0.0), max(times, default=0.0)
    spread = high - low if high - low > 1e-9 * high else 0.0
    most = float(instance.workload.max()) or 1.0
    return [
        {
            "id": row.task,
            "place": _place(place[j]),
            "size": float(np.sqrt(row.workload / most)),
            "late": (row.completion_time - low) / spread if spread and row.completion_time is not None else None,
            "unserved": row.completion_time is None,
            "cells": [_text(column.value(row)) for column in columns],
        }
        for j, row in enumerate(rows)
    ]


def _base(base: Base, place: "FloatArray") -> Entry:
    return {"name": base.name, "place": _place(place), "task": base.task}


def _agents(instance: Instance, rows: list[AgentRow], begin: list[Base], where: Places) -> list[Entry]:
    columns = agent_columns(instance)
    base_of = {i: number for number, base in enumerate(begin) for i in base.agents.tolist()}
    at = {tuple(base.place.tolist()): number for number, base in enumerate(begin)}
    home = [at.get(tuple(place), -1) for place in where.home_of(instance, np.arange(instance.n)).tolist()]
    return [
        {
            "id": row.agent,
            "task": -1 if row.task is None else instance.task_index[row.task],
            "base": base_of.get(i, -1),
            "home": home[i],
            "violation": row.violation,
            "cells": [_text(column.value(row)) for column in columns],
        }
        for i, row in enumerate(rows)
    ]


def _place(place: "FloatArray") -> list[float] | None:
    """Return a position on the drawing, whose second axis points down; None if it is unknown."""
    return None if np.isnan(place[0]) else [round(float(place[0]), 3), round(SIZE - float(place[1]), 3)]


def _text(value: Value) -> str:
    if isinstance(value, float):
        return number(value, 4)
    return one_line(", ".join(value) if isinstance(value, tuple) else value or "-")
