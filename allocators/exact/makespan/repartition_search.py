"""Plans by `repartition`: from where the search is, on for one T after the other."""

from collections.abc import Callable

import numpy as np

from alloc.allocators.exact.makespan.repartition import wander
from alloc.allocators.exact.model import Model
from alloc.problems import Allocation
from alloc.problems.instance import FloatArray, IntArray
from alloc.problems.vocabulary import IDLE

MOST_PLACES = 4_000_000
"""Pairs of agent and task beyond which this is none of its business."""

STEPS = 20
"""Splits in one go: less than a millisecond as a rule, a tenth of a second at worst."""


class Wanderer:
    """Splits the agents of a few tasks anew, again and again; every agent that can be of use has a task.

    Parameters
    ----------
    model : Model
    seed : int
    """

    def __init__(self, model: Model, seed: int) -> None:
        self._model = model
        self._state = np.random.default_rng(seed).integers(1, 2**63, 1).astype(np.uint64)
        self._place: IntArray = np.zeros(0, dtype=np.int64)
        self._tasks: IntArray = model.tasks

    @property
    def able(self) -> bool:
        """Whether the model is of a size for this."""
        return len(self._model.classes.class_of_agent) * len(self._model.tasks) <= MOST_PLACES

    def settle(self, allocation: Allocation) -> None:
        """Begin from this plan; tasks that it leaves unserved stay so."""
        model, task = self._model, allocation.task_of_agent
        served = np.isin(model.tasks, task)
        self._tasks = np.flatnonzero(served)
        column = np.full(model.classes.mask.shape[1] + 1, IDLE)
        column[model.tasks[served]] = np.arange(len(self._tasks))
        place = column[task]  # the last entry is that of idle agents
        idle = place == IDLE
        mask = model.classes.mask[:, model.tasks[served]]
        place[idle] = mask.argmax(axis=1)[model.classes.class_of_agent[idle]]
        self._place = place.astype(np.int64)

    def walk(self, time: float, should_stop: Callable[[], bool], *, most_steps: int) -> tuple[bool, Allocation]:
        """Look for a plan with makespan `time`.

        Returns
        -------
        bool
            Whether it was found.
        Allocation
            That plan, else the one met in which the shortest task lacked the smallest part.
        """
        able, need = self._model.uncapped(time)
        work = np.ascontiguousarray(able[:, self._tasks][self._model.classes.class_of_agent])
        need, best, most, steps = need[self._tasks], self._place, -1.0, 0
        while True:
            lacking, part, place = wander(work, need, self._place, STEPS, self._state)
            steps += STEPS
            if lacking == 0.0:
                return True, self._plan(work, self._place)
            if part > most:
                most, best = part, place
            if steps >= most_steps or should_stop():
                return False, self._plan(work, best)

    def _plan(self, work: FloatArray, place: IntArray) -> Allocation:
        useful = work[np.arange(len(place)), place] > 0
        return Allocation(np.where(useful, self._model.tasks[self._tasks[place]], IDLE))


def compile_loops() -> None:
    """Compile what this needs, or read it from the cache, so that no run waits for it."""
    wander(np.ones((4, 2)), np.full(2, 2.0), np.array([0, 0, 0, 1]), 1, np.ones(1, dtype=np.uint64))
