"""Repartition search for plans with given target makespans, starting from the fastest plan."""

from collections.abc import Callable

import numpy as np

from alloc.allocators.exact.makespan.repartition.partition import search_repartitions
from alloc.allocators.exact.makespan.repartition.pools import Partners
from alloc.allocators.exact.model import Model
from alloc.problems import Allocation
from alloc.problems.instance import FloatArray, IntArray
from alloc.problems.vocabulary import IDLE

MAX_PAIRS = 4_000_000
"""Number of agent-task pairs above which the search is not used."""

USUAL_LOSS = 0.05
"""Relative loss of an agent's work, by travel to another task, at which its weight falls to 1/e."""

MIN_USE, GOOD_USE = 1e-3, 0.02
"""Minimum weight of an agent in the choice of tasks, and weight above which it is of good use."""

MIN_PRICE = 0.2
"""Smallest price of a need relative to the largest, so that every shortfall counts."""

STEPS = 20
"""Repartitions between two checks of the clock: usually less than a millisecond, at worst a tenth of a second."""


class RepartitionSearch:
    """Repeatedly reassigns the agents of a few tasks; every agent of use has a task.

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
    def is_tractable(self) -> bool:
        """Whether the model is small enough."""
        return len(self._model.classes.class_of_agent) * len(self._model.tasks) <= MAX_PAIRS

    def start(self, allocation: Allocation) -> None:
        """Start from this plan; tasks that it leaves unserved stay so."""
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

    def run(
        self, time: float, should_stop: Callable[[], bool], *, max_steps: int, price: FloatArray | None = None
    ) -> tuple[bool, Allocation]:
        """Search for a plan with makespan `time`.

        Parameters
        ----------
        price : ndarray, shape (t,), optional
            Value of a unit of each need; all equal by default.

        Returns
        -------
        bool
            Whether it was found.
        Allocation
            That plan, or otherwise the one with the largest minimum share of needs met.
        """
        weight, need = self._model.uncapped(time)
        work = np.ascontiguousarray(weight[:, self._tasks][self._model.classes.class_of_agent])
        need, best, largest, steps = need[self._tasks], self._place, -1.0, 0
        if price is not None:
            value = np.maximum(price[self._tasks], MIN_PRICE * price.max())
            work, need = work * value, need * value
        partners = partners_of(work, has_travel_time=self._model.travel_time is not None)
        while True:
            shortfall, part, place = search_repartitions(work, need, partners, self._place, STEPS, self._state)
            steps += STEPS
            if shortfall == 0.0:
                return True, self._plan(work, self._place)
            if part > largest:
                largest, best = part, place
            if steps >= max_steps or should_stop():
                return False, self._plan(work, best)

    def _plan(self, work: FloatArray, place: IntArray) -> Allocation:
        useful = work[np.arange(len(place)), place] > 0
        return Allocation(np.where(useful, self._model.tasks[self._tasks[place]], IDLE))


def partners_of(work: FloatArray, *, has_travel_time: bool = False) -> Partners:
    """Return partners drawn by the number of agents of use to both tasks, of nearly equal use if travel takes time."""
    use = (work > 0).astype(float)
    if has_travel_time:
        loss = 1 - work / np.maximum(work.max(axis=1, keepdims=True), 1e-300)
        use *= np.maximum(MIN_USE, np.exp(-loss / USUAL_LOSS))
    common = use.T @ use
    np.fill_diagonal(common, 0.0)
    up_to = np.cumsum(common, axis=1)
    total = up_to[:, -1:]
    up_to = np.divide(up_to, total, out=np.zeros_like(up_to), where=total > 0)
    return Partners(up_to, (work > 0).astype(np.int8) + (use > GOOD_USE))


def compile_loops() -> None:
    """Compile the loops, or load them from the cache, so that they do not delay a run."""
    place = np.array([0, 0, 0, 1])
    work = np.ones((4, 2))
    search_repartitions(work, np.full(2, 2.0), partners_of(work), place, 1, np.ones(1, dtype=np.uint64))
