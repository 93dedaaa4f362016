"""Plausibility checks of instances: data that are valid but may be mistakes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from alloc.problems.evaluation import reason_of
from alloc.problems.fields import BoolArray
from alloc.problems.instance import FloatArray, Instance
from alloc.problems.text import counted, number
from alloc.problems.vocabulary import GEOGRAPHIC, IDLE

FAR_OFF, WIDEST = 3.0, 45.0
"""Positions look like degrees if they are this many times farther from the origin than wide, and at most this wide."""

MUCH_MORE = 1000.0
"""Multiple of the median ability from which an ability seems to be in other units."""

FEW = 0.05
"""Share of agents that may reach no task without a finding, as in large fleets some are remote."""

MAX_NAMES = 3
"""Maximum number of ids in a finding."""


@dataclass(frozen=True)
class Finding:
    """A possible mistake in an instance.

    Attributes
    ----------
    field : str
        Name of the field in files.
    message : str
        Description in one line.
    """

    field: str
    message: str


def findings(instance: Instance) -> tuple[Finding, ...]:
    """Return the possible mistakes in an instance, the most serious first; empty for a plausible one.

    Takes O(n + m) time; agents without reachable tasks are only looked for if the table of all pairs is small.

    Parameters
    ----------
    instance : Instance

    Returns
    -------
    tuple of Finding
    """
    checks = (_degrees, _unplaced, _bases, _unreaching, _without_effect, _other_units, _alike, _too_few_agents)
    return tuple(finding for check in checks for finding in check(instance))


def priority_without_effect(instance: Instance) -> Finding | None:
    """Return a finding if priorities differ, given that all tasks can be served."""
    if np.ptp(instance.priority) == 0:
        return None
    return Finding("priority", "has no effect on plans, as every task can be served; it only weights game rewards")


def _degrees(instance: Instance) -> Iterator[Finding]:
    """Find longitudes and latitudes that are treated as planar coordinates."""
    if instance.metric == GEOGRAPHIC:
        return
    places = np.concatenate([instance.agent_position, instance.task_position, instance.bases.position])
    flat = places[~np.isnan(places[:, 0]), :2]
    if len(flat) < 2 or (flat == flat.round()).all():
        return
    low, high = flat.min(axis=0), flat.max(axis=0)
    size, middle = float((high - low).max()), np.abs((low + high) / 2)
    within = any((np.abs(flat) <= limits).all() for limits in ((180, 90), (90, 180)))
    if within and 0 < size <= WIDEST and middle.max() > FAR_OFF * size:
        yield Finding(
            "position",
            'looks like degrees, but is treated as planar; with "metric": "geographic" it is [longitude, latitude]',
        )


def _unplaced(instance: Instance) -> Iterator[Finding]:
    """Find agents and tasks without a place among others that have one; distances from them are 0."""
    lost_agents, lost_tasks = (np.isnan(places[:, 0]) for places in (instance.start_position, instance.task_position))
    if lost_agents.all() or lost_tasks.all():
        return
    table = instance.distances
    if table is not None:
        nodes = np.concatenate([table.source, table.target])
        known = np.zeros(instance.n + instance.m, dtype=np.bool_)
        known[nodes] = True
        starts = (instance.start_task != IDLE) & known[instance.n + np.maximum(instance.start_task, 0)]
        lost_agents = lost_agents & ~known[: instance.n] & ~starts
        lost_tasks = lost_tasks & ~known[instance.n :]
    for lost, ids, noun in ((lost_agents, instance.agent_ids, "agent"), (lost_tasks, instance.task_ids, "task")):
        if lost.any():
            verb = "has" if lost.sum() == 1 else "have"
            yield Finding("position", f"{named(lost, ids, noun)} {verb} no place: the distance there counts as 0")


def _bases(instance: Instance) -> Iterator[Finding]:
    """Find bases to which no agent returns, and bases without a place or given distances."""
    table, ids = instance.distances, instance.bases.ids
    used = np.isin(np.arange(len(ids)), instance.return_base)
    if not used.all():
        yield Finding("bases", f"no agent returns to {named(~used, ids, 'base')}")
    lost = used & np.isnan(instance.bases.position[:, 0])
    if table is not None:
        node = instance.n + instance.m + np.arange(len(ids))
        lost &= ~np.isin(node, np.concatenate([table.source, table.target]))
    if lost.any() and not np.isnan(instance.task_position[:, 0]).all():
        verb = "has" if lost.sum() == 1 else "have"
        yield Finding("bases", f"{named(lost, ids, 'base')} {verb} no place: the distance back counts as 0")


def _unreaching(instance: Instance) -> Iterator[Finding]:
    """Find agents whose battery, range or given distances do not let them reach any task."""
    reach, table = instance.reach, instance.distances
    limited = np.isfinite(instance.battery) | np.isfinite(instance.communication_range)
    limited |= table is not None and table.missing == "unreachable"
    if not limited.any() or not reach.has_table:
        return
    reaches_some: BoolArray = np.asarray(reach.mask.any(axis=1))
    reaches_none = ~reaches_some[reach.origin] & limited
    if reaches_none.mean() < FEW:
        return
    eligible = instance.eligible_tasks
    for agent in np.flatnonzero(reaches_none).tolist():
        options = None if eligible is None else eligible[agent]
        tasks = np.arange(instance.m) if options is None else options
        if not len(tasks):
            continue
        nearest = int(tasks[np.argmin(reach.cost[reach.origin[agent], tasks])])
        reason = reason_of(instance, agent, nearest)
        field = next(name for name in ("distances", "battery", "range") if name in reason)
        others = int(reaches_none.sum()) - 1
        who = f"and {counted(others, 'other')} reach" if others else "reaches"
        text = f"{instance.agent_ids[agent]} {who} no task; to {instance.task_ids[nearest]}, its nearest, {reason}"
        yield Finding(field, text)
        return


def _without_effect(instance: Instance) -> Iterator[Finding]:
    """Find limits on distances if all distances are 0."""
    if instance.distances is not None:
        return
    if not (np.isnan(instance.start_position[:, 0]).all() or np.isnan(instance.task_position[:, 0]).all()):
        return
    limits: Sequence[tuple[str, FloatArray]] = (
        ("speed", instance.speed),
        ("range", instance.communication_range),
        ("battery", instance.battery),
    )
    for name, values in limits:
        if np.isfinite(values).any():
            nobody = "agents" if np.isnan(instance.start_position[:, 0]).all() else "tasks"
            yield Finding(name, f"has no effect: the {nobody} have no place, so that all distances are 0")


def _other_units(instance: Instance) -> Iterator[Finding]:
    """Find an ability far above the others."""
    if instance.n < 2:
        return
    most = int(instance.ability.argmax())
    usual = float(np.median(np.delete(instance.ability, most)))
    if instance.ability[most] >= MUCH_MORE * usual:
        times = number(float(instance.ability[most]) / usual, 3)
        message = f"that of {instance.agent_ids[most]} is {times} times the median of the others, {number(usual)}"
        yield Finding("ability", f"{message}: is it in the same units?")


def _alike(instance: Instance) -> Iterator[Finding]:
    """Find out whether all agents are identical, and all tasks are."""
    if instance.n < 2 or instance.m < 2 or instance.reach.has_table is False:
        return
    reach = instance.reach
    equal = all(np.ptp(values) == 0 for values in (instance.ability, instance.workload, instance.priority))
    if equal and reach.mask.all() and np.ptp(reach.cost) == 0 and not instance.has_travel_time:
        yield Finding("agents", "all are alike, and so are the tasks: only the number of agents on each task matters")


def _too_few_agents(instance: Instance) -> Iterator[Finding]:
    """Find fewer agents than tasks, as each agent does at most one task."""
    tasks = int((instance.workload > 0).sum())
    if instance.n < tasks:
        few = f"{counted(instance.n, 'agent')} for {tasks} tasks, and each agent does one task"
        yield Finding("agents", f"{few}; for sequences of tasks and due times see PyVRP or PyJobShop")


def named(which: BoolArray, ids: Sequence[str], noun: str) -> str:
    """Return a text with some of the ids in a mask, and their number."""
    count = int(which.sum())
    names = ", ".join(ids[index] for index in np.flatnonzero(which)[:MAX_NAMES].tolist())
    cut = ", ..." if count > MAX_NAMES else ""
    return f"{noun} {names}" if count == 1 else f"{count} of {len(ids)} {noun}s ({names}{cut})"
