"""The least energy at a makespan: who of those alike goes where, then an integer programme over classes by place."""

import sys
from collections.abc import Callable

import numpy as np
from scipy.optimize import linear_sum_assignment

from alloc.allocators.exact.demand import ROUNDING, Model
from alloc.allocators.exact.question import Answer, Question, Watch, is_over
from alloc.allocators.search import Search
from alloc.problems import IDLE, Allocation, Instance, agent_classes
from alloc.problems.instance import IntArray

MOST_MATCHED = 400
"""Agents alike that are matched with their places at once, some 10 ms; larger classes are cut into parts."""


def least_energy(search: Search, ask: Callable[[Question, Watch], Answer], serve: int) -> float | None:
    """Look for the least energy at the makespan of the best plan so far; return what is proven to be needed.

    Parameters
    ----------
    search : Search
    ask : callable
        Puts a question to the solver.
    serve : int
        How many tasks are to be served.

    Returns
    -------
    float or None
        Energy that every plan with at most this makespan needs; None if nothing is known.
    """
    assert search.best is not None
    time = search.makespan_limit
    if search.best.evaluation.energy == 0:
        return 0.0
    if is_over(search):
        return None
    model = Model.build(search.instance, agent_classes(search.instance, by_place=True), serve)
    search.submit(nearest_places(search.instance, search.best.allocation, lambda: is_over(search)))
    search.submit(without_idlers(model, search.best.allocation, time))
    demand, budget = model.at(time), search.budget
    pairs = model.pairs_at(demand)
    until_s = np.inf if budget.time_limit_s is None else budget.time_limit_s
    question = Question(
        demand=demand,
        cost=model.distance[pairs],
        hint=model.counts(demand, search.best.allocation),
        seconds=search.remaining_s,
        threads=search.threads,
        seed=search.seed,
        repeatable=budget.time_limit_s is None and budget.iterations is not None,
    )
    answer = ask(question, Watch(search, model, demand, until_s))
    search.iteration += 1
    if answer.counts is not None:
        search.submit(model.allocation(demand, answer.counts))
    return min(max(0.0, answer.bound * search.instance.energy_per_distance), sys.float_info.max)


def nearest_places(
    instance: Instance, allocation: Allocation, should_stop: Callable[[], bool] = lambda: False
) -> Allocation:
    """Exchange agents alike but for their place so that they fly least: an assignment problem per class.

    By Crouse (2016), doi:10.1109/TAES.2016.140952, as scipy has it. Not where travel takes time, as then nobody at
    another place is alike.
    """
    task = allocation.task_of_agent.copy()
    if instance.has_travel_time:
        return allocation
    for members in _alike(instance):
        if should_stop():
            break
        goals = task[members][task[members] != IDLE]
        distance = instance.reach.distance[instance.reach.origin[members]][:, goals]
        agent, goal = linear_sum_assignment(distance)
        task[members] = IDLE
        task[members[agent]] = goals[goal]
    return Allocation(task)


def _alike(instance: Instance) -> list[IntArray]:
    """Agents of each class, those of large classes in parts."""
    classes = agent_classes(instance, by_place=False)
    order = np.argsort(classes.class_of_agent, kind="stable")
    whole = np.split(order, np.cumsum(classes.count)[:-1])
    parts = [np.array_split(members, -(-len(members) // MOST_MATCHED)) for members in whole if len(members) > 1]
    return [part for split in parts for part in split]


def without_idlers(model: Model, allocation: Allocation, time: float) -> Allocation:
    """Leave out agents without whom their task is done by `time` all the same, the farthest first."""
    table = model.classes.tally(allocation)
    share = model.shares(time)
    for column, task in enumerate(model.tasks.tolist()):
        cover = float(share[:, column] @ table[:, task])
        group = np.flatnonzero(table[:, task])
        for kind in group[np.argsort(-model.classes.distance[group, task])].tolist():
            one = float(share[kind, column])
            spare = table[kind, task] if one == 0 else max(0, int((cover - 1 + ROUNDING) / one))
            leave = min(int(table[kind, task]), int(spare))
            table[kind, task] -= leave
            cover -= leave * one
    return model.classes.spread(table)
