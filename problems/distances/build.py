"""Construction of the reach of an instance, with one origin per group of equivalent agents."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.problems.distances.geometry import Geometry, given_rows
from alloc.problems.distances.given import DistanceTable
from alloc.problems.distances.metric import Floats
from alloc.problems.distances.move import Move
from alloc.problems.distances.neighbours import Indices
from alloc.problems.distances.origins import group_rows, number_lists
from alloc.problems.distances.reach import Reach

if TYPE_CHECKING:
    from alloc.problems.instance import Instance

Flags = NDArray[np.bool_]


def build_reach(instance: "Instance") -> Reach:
    """Return the reach of an instance, with agents grouped by origin, in O(n log n) time and O(n) memory.

    Agents of one origin share place, user-given distances, range, battery, energy per distance, whether and where
    they return, and their list of tasks.

    Parameters
    ----------
    instance : Instance
    """
    place = instance.start_position
    number, lists = number_lists(instance.eligible_tasks, instance.n)
    base, factor = _factors(instance.agent_energy_per_distance, instance.energy_per_distance)
    returns = instance.returns if instance.returns.any() else None
    columns = [*place.T, instance.communication_range, instance.battery, number.astype(np.float64)]
    columns += [column.astype(np.float64) for column in (factor, returns) if column is not None]
    start = np.where(np.isnan(instance.agent_position[:, 0]), instance.start_task, -1)
    table, home = instance.distances, _home_of(instance)
    if table is not None:
        columns.append(_rows_of(table, np.arange(instance.n), start).astype(np.float64))
    if home is not None:
        columns += [*home.place.T, home.rows.astype(np.float64)]
    first, origin = group_rows(columns)
    geometry = _geometry(instance, place[first], first, start[first])
    list_of = number[first]
    if home is not None:
        back = _geometry(instance, home.place[first], home.node[first], home.start[first])
        geometry = replace(geometry, home=back)
    if table is not None and table.missing == "unreachable":
        list_of, lists = _bound_to(geometry, list_of, lists)
    reach = Reach(
        origin=origin,
        geometry=geometry,
        communication_range=instance.communication_range[first],
        battery=instance.battery[first],
        energy_per_distance=base,
        factor=None if factor is None else factor[first],
        returns=None if returns is None else returns[first],
        list_of=list_of,
        lists=lists,
    )
    for array in (origin, reach.geometry.start, list_of):
        array.setflags(write=False)
    return reach


class Home(NamedTuple):
    """The place to which each agent returns, with its node and start task in a table of distances.

    Attributes
    ----------
    place : ndarray, shape (n, 3)
        Base of the agent; its start if it returns there or not at all.
    node, start : ndarray of int, shape (n,)
        Node and start task in the table; -1 for no start task.
    rows : ndarray of int, shape (n,)
        Node whose distances apply, -1 for none.
    """

    place: Floats
    node: Indices
    start: Indices
    rows: Indices


def _home_of(instance: "Instance") -> Home | None:
    """Return the places to which agents return; None if all return to their starts or not at all."""
    base, table, agents = instance.return_base, instance.distances, np.arange(instance.n)
    if not (base >= 0).any():
        return None
    away = base >= 0
    place = np.where(away[:, None], instance.bases.position[np.maximum(base, 0)], instance.start_position)
    start = np.where(~away & np.isnan(instance.agent_position[:, 0]), instance.start_task, -1)
    node = np.where(away, instance.n + instance.m + base, agents)
    return Home(place, node, start, np.full(instance.n, -1) if table is None else _rows_of(table, node, start))


def _geometry(instance: "Instance", place: Floats, node: Indices, start: Indices) -> Geometry:
    """Return the geometry of places, with the distances that a table gives for their nodes and start tasks."""
    given = None if instance.distances is None else given_rows(instance.distances, node, start)
    return Geometry(place, instance.task_position, instance.metric, instance.distance_unit, given)


def replanned(
    reach: Reach, task_of_agent: Indices, price: Floats, pinned: Flags, *, energy_counts: bool, cost_counts: bool
) -> Reach:
    """Return a reach with a price on moving agents to other tasks, in which pinned agents keep their tasks.

    Parameters
    ----------
    reach : Reach
    task_of_agent : ndarray of int, shape (n,)
        Current task of each agent, -1 for idle.
    price : ndarray, shape (n,)
        Price of each agent's move, in units of energy.
    pinned : ndarray of bool, shape (n,)
        Agents that can only do their current task, at no cost.
    energy_counts : bool
        Whether the energy of flights is part of the cost.
    cost_counts : bool
        Whether costs change at all; if not, only pins apply.
    """
    first, origin = group_rows([part.astype(np.float64) for part in (reach.origin, task_of_agent, price, pinned)])
    old, task, fixed = reach.origin[first], task_of_agent[first], pinned[first]
    own = [reach.lists[number] if number >= 0 else None for number in reach.list_of[old].tolist()]
    for row in np.flatnonzero(fixed).tolist():
        own[row] = task[[row]] if task[row] >= 0 else task[:0]
    list_of, lists = number_lists(own, len(own))
    part = replace(
        _chosen(reach, old, origin),
        communication_range=np.where(fixed, np.inf, reach.communication_range[old]),
        battery=np.where(fixed, np.inf, reach.battery[old]),
        list_of=list_of,
        lists=lists,
    )
    if not cost_counts:
        return part
    unit = reach.energy_per_distance or 1.0
    rate = np.ones(len(first)) if reach.factor is None else reach.factor[old]
    return replace(
        part,
        energy_per_distance=unit,
        factor=np.where(fixed, 0.0, rate * (reach.energy_per_distance / unit)),
        move=Move(task, np.where(fixed, 0.0, price[first] / unit), float(energy_counts)),
    )


def restricted_reach(reach: Reach, agents: Indices, tasks: Indices) -> Reach:
    """Return the reach of the given agents and tasks, renumbered in this order."""
    old, origin = np.unique(reach.origin[agents], return_inverse=True)
    number = np.full(len(reach.goal) + 1, -1, dtype=np.intp)
    number[tasks] = np.arange(len(tasks))
    part, move = _chosen(reach, old, origin.astype(np.intp)), reach.move
    return replace(
        part,
        geometry=part.geometry.restricted(tasks, number),
        lists=tuple(np.sort(number[named][number[named] >= 0]) for named in reach.lists),
        move=None if move is None else Move(number[move.task[old]], move.price[old], move.energy_weight),
    )


def _chosen(reach: Reach, old: Indices, origin: Indices) -> Reach:
    """Return the reach of the origins `old`, without the price of moves; `origin` is the new origin of each agent."""
    return Reach(
        origin=origin,
        geometry=reach.geometry.chosen(old),
        communication_range=reach.communication_range[old],
        battery=reach.battery[old],
        energy_per_distance=reach.energy_per_distance,
        factor=None if reach.factor is None else reach.factor[old],
        returns=None if reach.returns is None else reach.returns[old],
        list_of=reach.list_of[old],
        lists=reach.lists,
    )


def _factors(rate: Floats, base: float) -> tuple[float, Floats | None]:
    """Return the energy per unit of cost, and each agent's energy per distance relative to it; None if all are 1."""
    if (rate == base).all():
        return base, None
    unit = base if base > 0 else float(rate.max())
    return unit, rate / unit


def _rows_of(table: DistanceTable, node: Indices, start: Indices) -> Indices:
    """Return the nodes whose distances apply: an agent's own, or else that of its start task; -1 for none."""
    nodes = np.zeros(table.size, dtype=np.bool_)
    nodes[table.source] = nodes[table.target] = True
    return np.where(nodes[node], node, np.where(start >= 0, table.n + start, -1))


def _bound_to(geometry: Geometry, list_of: Indices, lists: Sequence[Indices]) -> tuple[Indices, tuple[Indices, ...]]:
    """Return lists that restrict each origin to tasks whose distances there and back home are given."""
    ways = _given_tasks(geometry)
    if geometry.home is not None:  # without bases, home is the start
        home = _given_tasks(geometry.home)
        ways = [np.intersect1d(*pair, assume_unique=True) for pair in zip(ways, home, strict=True)]
    own: list[Indices | None] = [*ways]
    for origin in np.flatnonzero(list_of >= 0).tolist():
        tasks = own[origin]
        assert tasks is not None
        own[origin] = tasks[np.isin(tasks, lists[list_of[origin]], assume_unique=True)]
    return number_lists(own, len(own))


def _given_tasks(geometry: Geometry) -> list[Indices]:
    """Return the tasks with given distances for each origin."""
    given = geometry.given
    assert given is not None
    return [given.task[begin:end] for begin, end in pairwise(given.first.tolist())]
