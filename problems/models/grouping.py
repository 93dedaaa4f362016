"""Whom a variable of the model stands for: an agent, or the agents of a class."""

from enum import StrEnum

import numpy as np

from alloc.problems.classes import AgentClasses, agent_classes, count_classes
from alloc.problems.errors import RefusedError
from alloc.problems.instance import Instance

MOST_PAIRS = 2_000_000
"""Pairs of agent, or class, and task beyond which no model is made."""


class Grouping(StrEnum):
    """Whom a variable stands for, by the first letter of its name."""

    AGENT = "x"
    ABILITY = "n"
    PLACE = "p"


def grouped(instance: Instance, grouping: Grouping) -> AgentClasses:
    """Return the classes whose agents the variables count; with `Grouping.AGENT` each agent is a class.

    Raises
    ------
    RefusedError
        If there are more than `MOST_PAIRS` pairs of a class and a task.
    """
    is_single, by_place = grouping is Grouping.AGENT, grouping is Grouping.PLACE
    pairs = instance.m * (instance.n if is_single else count_classes(instance, by_place=by_place))
    if pairs > MOST_PAIRS:
        raise RefusedError(f"the model would have up to {pairs} variables; at most {MOST_PAIRS} are written")
    if not is_single:
        return agent_classes(instance, by_place=by_place)
    agents, reach = np.arange(instance.n), instance.reach
    distance, mask = reach.rows(reach.origin)
    cost = reach.costs(reach.origin[:, None], np.arange(instance.m), distance)
    ones = np.ones(instance.n, dtype=np.intp)
    return AgentClasses(agents, ones, instance.ability, instance.speed, distance, cost, mask)
