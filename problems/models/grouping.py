"""Grouping of agents in models: a variable per agent, or per class of agents."""

from enum import StrEnum

import numpy as np

from alloc.problems.classes import AgentClasses, agent_classes, count_classes
from alloc.problems.errors import RefusedError
from alloc.problems.instance import Instance

MAX_PAIRS = 2_000_000
"""Maximum number of pairs of agent, or class, and task in a model."""


class Grouping(StrEnum):
    """Grouping of agents, by the first letter of variable names."""

    AGENT = "x"
    ABILITY = "n"
    PLACE = "p"


def grouped(instance: Instance, grouping: Grouping) -> AgentClasses:
    """Return the classes whose agents the variables count; with `Grouping.AGENT`, each agent is a class.

    Raises
    ------
    RefusedError
        If there are more than `MAX_PAIRS` pairs of class and task.
    """
    is_single, by_place = grouping is Grouping.AGENT, grouping is Grouping.PLACE
    pairs = instance.m * (instance.n if is_single else count_classes(instance, by_place=by_place))
    if pairs > MAX_PAIRS:
        raise RefusedError(f"the model would have up to {pairs} variables; the limit is {MAX_PAIRS}")
    if not is_single:
        return agent_classes(instance, by_place=by_place)
    agents, reach = np.arange(instance.n), instance.reach
    distance, mask = reach.rows(reach.origin)
    cost = reach.costs(reach.origin[:, None], np.arange(instance.m), distance)
    ones = np.ones(instance.n, dtype=np.intp)
    return AgentClasses(agents, ones, instance.ability, instance.speed, distance, cost, mask)
