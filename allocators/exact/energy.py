"""The least energy at a makespan: who of those alike goes where, then an integer programme over classes by place."""

from collections.abc import Callable

import numpy as np

from alloc.allocators.exact.demand import ROUNDING, Model
from alloc.allocators.exact.question import Answer, Question, Watch, is_over
from alloc.allocators.search import Search
from alloc.problems import IDLE, Allocation, Instance, agent_classes

MOST_ALIKE = 2_000
"""Agents alike beyond which they are not matched with their places (a second)."""


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
    time = search.best.evaluation.served_makespan
    if search.best.evaluation.energy == 0:
        return 0.0
    if is_over(search):
        return None
    model = Model.build(search.instance, agent_classes(search.instance, by_place=True), serve)
    search.submit(nearest_places(search.instance, search.best.allocation))
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
    return max(0.0, answer.bound * search.instance.energy_per_distance)


def nearest_places(instance: Instance, allocation: Allocation) -> Allocation:
    """Exchange agents alike but for their place so that they fly least: an assignment problem per class.

    By Jonker and Volgenant (1987), doi:10.1007/BF02278710, as scipy has it.
    """
    from scipy.optimize import linear_sum_assignment

    classes, task = agent_classes(instance, by_place=False), allocation.task_of_agent.copy()
    order = np.argsort(classes.class_of_agent, kind="stable")
    for members in np.split(order, np.cumsum(classes.count)[:-1]):
        goals = task[members][task[members] != IDLE]
        if not 1 < len(members) <= MOST_ALIKE or not len(goals) or instance.has_travel_time:
            continue
        distance = instance.reach.distance[instance.reach.origin[members]][:, goals]
        agent, goal = linear_sum_assignment(distance)
        task[members] = IDLE
        task[members[agent]] = goals[goal]
    return Allocation(task)


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
