"""Classes of interchangeable agents, which exact models count instead of deciding on each agent."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alloc.problems.allocation import Allocation
from alloc.problems.arguments import flag, of_type
from alloc.problems.distances.origins import group_rows
from alloc.problems.instance import FloatArray, Instance, IntArray
from alloc.problems.vocabulary import IDLE


@dataclass(frozen=True, eq=False)
class AgentClasses:
    """Classes of interchangeable agents.

    Attributes
    ----------
    class_of_agent : ndarray of int, shape (n,)
        Class of each agent.
    count : ndarray of int, shape (k,)
        Agents in each class.
    ability, speed : ndarray, shape (k,)
        Work per hour, and distance per hour (``inf`` where travel takes no time).
    distance, cost : ndarray, shape (k, m)
        Distance to each task, and `Reach.cost`; those of one member if the classes ignore places.
    mask : ndarray of bool, shape (k, m)
        Which tasks the class can take.
    """

    class_of_agent: IntArray
    count: IntArray
    ability: FloatArray
    speed: FloatArray
    distance: FloatArray
    cost: FloatArray
    mask: NDArray[np.bool_]

    @property
    def size(self) -> int:
        """Number of classes, k."""
        return len(self.count)

    def spread(self, counts: IntArray) -> Allocation:
        """Return an allocation with the given numbers of agents per class and task; the remaining agents are idle.

        Parameters
        ----------
        counts : ndarray of int, shape (k, m)
            Agents of each class on each task; no row may sum to more than the size of its class.
        """
        task = np.full(len(self.class_of_agent), IDLE, dtype=np.intp)
        order = np.argsort(self.class_of_agent, kind="stable")
        first = np.concatenate([[0], np.cumsum(self.count)])
        kind, goal = np.nonzero(counts)
        used = np.zeros(self.size, dtype=np.intp)
        for k, j in zip(kind.tolist(), goal.tolist(), strict=True):
            begin = first[k] + used[k]
            used[k] += counts[k, j]
            task[order[begin : begin + counts[k, j]]] = j
        if (used > self.count).any():
            raise ValueError("more agents used than a class has")
        return Allocation(task)

    def tally(self, allocation: Allocation) -> IntArray:
        """Return the number of agents per class and task, shape (k, m): the inverse of `spread`."""
        counts = np.zeros(self.mask.shape, dtype=np.intp)
        working = np.flatnonzero(allocation.task_of_agent != IDLE)
        np.add.at(counts, (self.class_of_agent[working], allocation.task_of_agent[working]), 1)
        return counts


def agent_classes(instance: Instance, *, by_place: bool) -> AgentClasses:
    """Group the agents of `instance` that are interchangeable.

    Parameters
    ----------
    by_place : bool
        Whether places matter, as they do for energy. If not, agents with the same ability and the same reachable tasks
        are in one class wherever they are, unless travel takes time or the reachability table is too large to
        compare its rows (`Reach.has_table`).

    Returns
    -------
    AgentClasses
    """
    example, class_of_agent = _group(instance, by_place=by_place)
    reach = instance.reach
    origin = reach.origin[example]
    distance, mask = reach.rows(origin)
    cost = distance if reach.cost_is_distance else reach.costs(origin[:, None], np.arange(instance.m), distance)
    return AgentClasses(
        class_of_agent=class_of_agent,
        count=np.bincount(class_of_agent),
        ability=instance.ability[example],
        speed=instance.speed[example],
        distance=distance,
        cost=cost,
        mask=mask,
    )


def count_classes(instance: Instance, *, by_place: bool) -> int:
    """Return the number of classes that `agent_classes` would make, without building their reachability table.

    Parameters
    ----------
    instance : Instance
    by_place : bool
        As in `agent_classes`.
    """
    return len(_group(instance, by_place=by_place)[0])


def _group(instance: Instance, *, by_place: bool) -> tuple[IntArray, IntArray]:
    """Return one member of each class, and the class of each agent."""
    reach = of_type(instance, Instance, "instance").reach
    if flag(by_place, "by_place") or instance.has_travel_time:
        row = np.arange(len(reach.place))
    elif reach.is_complete:
        row = np.zeros(len(reach.place), dtype=np.intp)
    elif reach.has_table:
        packed = np.ascontiguousarray(np.packbits(reach.mask, axis=1))
        _, row = np.unique(packed.view(np.dtype((np.void, packed.shape[1])))[:, 0], return_inverse=True)
    else:
        row = np.arange(len(reach.place))
    return group_rows([instance.ability, row[reach.origin].astype(np.float64), instance.speed])
