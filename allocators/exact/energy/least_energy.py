"""The least energy at a makespan: who of those alike goes where, then an integer programme over classes by place."""

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from alloc.allocators.contract.search import Search
from alloc.allocators.exact.energy.narrowing import MOST_TASKS, REPEATABLE_SLICES, Narrowing
from alloc.allocators.exact.model import FEW_PAIRS, ROUNDING, Demand, Model
from alloc.allocators.exact.solver_model import Answer, Question, Watch, is_over
from alloc.allocators.parallel.pool import Pool
from alloc.problems import IDLE, Allocation, Instance, agent_classes
from alloc.problems.evaluation import last_equal
from alloc.problems.instance import IntArray

MOST_MATCHED = 400
"""Agents alike that are matched with their places at once, some 10 ms; larger classes are cut into parts."""

UNHURRIED_S = 60.0
"""What the parts of the time are measured by where there is no time limit, or a longer one."""

PART_ALONE = 0.3
"""Part of the time before which the solver is not asked."""

PART_TRAVELLING, MOST_TRAVELLING_S = 0.4, 20.0
"""Part of the time, and seconds, that local search gets where travel takes time."""


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
    time = last_equal(search.makespan_limit)
    if search.best.evaluation.energy == 0:
        return 0.0
    if is_over(search):
        return None
    model = Model.build(search.instance, agent_classes(search.instance, by_place=True), serve)
    search.submit(nearest_places(search.instance, search.best.allocation, lambda: is_over(search)))
    search.submit(without_idlers(model, search.best.allocation, time))
    demand = model.at(time)
    counted = search.budget.time_limit_s is None and search.budget.iterations is not None
    if model.delay is not None and len(demand.kind) > FEW_PAIRS and not counted:
        _search_travelling(search)
    bound = _Energy(search, ask, model, demand).run()
    return min(max(0.0, bound * search.instance.energy_per_distance), sys.float_info.max)


def _search_travelling(search: Search) -> None:
    """Save energy by local search first, as no walk of `Narrowing` knows of travel times.

    Loaded when it is needed, as most runs do without.
    """
    from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState
    from alloc.allocators.heuristic.local_search.clock import Clock
    from alloc.allocators.heuristic.local_search.improve import reduce_energy
    from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters

    parameters = LocalSearchParameters()
    seconds = min(PART_TRAVELLING * search.remaining_s, MOST_TRAVELLING_S)
    state = AnnealingState(search.instance, search.seed, parameters.neighbours)
    reduce_energy(search, state, parameters, Clock(search, search.elapsed_s + seconds))


class _Energy:
    """Plans and bounds by `Narrowing`, then by the solver, which gets only what a better plan may have."""

    def __init__(self, search: Search, ask: Callable[[Question, Watch], Answer], model: Model, demand: Demand) -> None:
        assert search.best is not None
        self._search, self._ask, self._model, self._demand = search, ask, model, demand
        self._begin_s, budget = search.elapsed_s, search.budget
        self._repeatable = budget.time_limit_s is None and budget.iterations is not None
        self._until_s = np.inf if budget.time_limit_s is None else budget.time_limit_s
        self._hurry_s = min(UNHURRIED_S, self._until_s - self._begin_s)
        self._sides: Narrowing | None = None
        if len(demand.kind) > FEW_PAIRS and len(demand.need) <= MOST_TASKS:
            sides = Narrowing(search.instance, model, demand, search.best.allocation, search.seed)
            self._sides = None if sides.idle else sides

    def run(self) -> float:
        """Return the distance that is proven to be needed."""
        sides = self._sides
        if sides is not None:
            self._narrow(sides)
            if sides.closed or is_over(self._search):
                return sides.bound
        answer = self._put(sides)
        return answer.bound if sides is None else max(sides.bound, min(answer.bound, self._cost))

    @property
    def _cost(self) -> float:
        assert self._search.best is not None
        return self._search.best.evaluation.distance

    def _narrow(self, sides: Narrowing) -> None:
        """Narrow until bounds hardly rise any more, and half of the time has passed."""
        if self._repeatable:
            for number in range(REPEATABLE_SLICES):
                if sides.closed or self._search.interrupted:
                    return
                self._submit(sides.repeat(number))
            return
        with Pool(1) as pool:
            while not (is_over(self._search) or sides.closed):
                share = (self._search.elapsed_s - self._begin_s) / self._hurry_s if self._hurry_s > 0 else 1.0
                if share >= 1 or (sides.settled and share >= PART_ALONE):
                    return
                self._submit(sides.run(min(1.0, share), pool if self._search.threads > 1 else None))

    def _submit(self, plan: Allocation | None) -> None:
        if plan is not None:
            self._search.submit(plan)
        if self._sides is not None:
            self._sides.meet(self._cost)

    def _put(self, sides: Narrowing | None) -> Answer:
        """Put the rest to the solver; the calling thread goes on meanwhile if there are processors for both."""
        search, demand = self._search, self._demand
        assert search.best is not None
        if sides is not None:
            keep = sides.keep
            demand = replace(
                demand,
                kind=demand.kind[keep],
                goal=demand.goal[keep],
                weight=demand.weight[keep],
                most=demand.most[keep],
            )
        question = Question(
            demand=demand,
            cost=self._model.distance[self._model.pairs_at(demand)],
            hint=self._model.counts(demand, search.best.allocation),
            seconds=search.remaining_s,
            threads=max(1, search.threads - 1) if sides is not None else search.threads,
            seed=search.seed,
            repeatable=self._repeatable,
        )

        def meanwhile() -> bool:
            if sides is None or self._repeatable or search.threads == 1:
                return False
            share = (search.elapsed_s - self._begin_s) / self._hurry_s if self._hurry_s > 0 else 1.0
            self._submit(sides.run(min(1.0, share), None))
            return sides.closed

        answer = self._ask(question, Watch(search, self._model, demand, self._until_s, meanwhile))
        search.iteration += 1
        if answer.counts is not None:
            search.submit(self._model.allocation(demand, answer.counts))
        return answer


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
