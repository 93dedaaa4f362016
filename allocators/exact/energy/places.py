"""Plans of less energy at the same completion times: identical agents are exchanged, unneeded agents become idle."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import linear_sum_assignment

from alloc.allocators.exact.model import ROUNDING, Model
from alloc.problems import IDLE, Allocation, Instance, agent_classes
from alloc.problems.instance import IntArray

MAX_MATCHED = 400
"""Largest number of identical agents matched with tasks at once, some 10 ms; larger classes are split."""


def nearest_places(
    instance: Instance, allocation: Allocation, should_stop: Callable[[], bool] = lambda: False
) -> Allocation:
    """Exchange agents that differ only in their place at the least total cost: an assignment problem per class.

    Solved by scipy's implementation of Crouse (2016), doi:10.1109/TAES.2016.140952. If travel takes time, agents at
    different places are not interchangeable, and the plan is returned unchanged.
    """
    task = allocation.task_of_agent.copy()
    if instance.has_travel_time:
        return allocation
    for members in _alike(instance):
        if should_stop():
            break
        tasks = task[members][task[members] != IDLE]
        cost = instance.reach.cost[instance.reach.origin[members]][:, tasks]
        row, column = linear_sum_assignment(cost)
        task[members] = IDLE
        task[members[row]] = tasks[column]
    return Allocation(task)


def _alike(instance: Instance) -> list[IntArray]:
    """Return the agents of each class, with large classes split."""
    classes = agent_classes(instance, by_place=False)
    order = np.argsort(classes.class_of_agent, kind="stable")
    whole = np.split(order, np.cumsum(classes.count)[:-1])
    parts = [np.array_split(members, -(-len(members) // MAX_MATCHED)) for members in whole if len(members) > 1]
    return [part for members in parts for part in members]


def without_idlers(model: Model, allocation: Allocation, time: float) -> Allocation:
    """Make agents idle without whom their task is still done by `time`, the most expensive first."""
    table = model.classes.tally(allocation)
    share = model.shares(time)
    for column, task in enumerate(model.tasks.tolist()):
        done = float(share[:, column] @ table[:, task])
        group = np.flatnonzero(table[:, task])
        for agent_class in group[np.argsort(-model.classes.cost[group, task])].tolist():
            one = float(share[agent_class, column])
            spare = table[agent_class, task] if one == 0 else max(0, int((done - 1 + ROUNDING) / one))
            leave = min(int(table[agent_class, task]), int(spare))
            table[agent_class, task] -= leave
            done -= leave * one
    return model.classes.spread(table)
