"""Compiled moves of agents between groups, with updates of group abilities, shortfalls and the best plan."""

import numpy as np

from alloc.allocators.heuristic.local_search.distances import distance_and_cost, effective_ability
from alloc.allocators.heuristic.local_search.instance_arrays import InstanceArrays
from alloc.allocators.heuristic.local_search.plan import (
    BEST,
    CURRENT,
    FULL_GROUP,
    LOG_SIZE,
    N_LOGGED,
    N_MOVES,
    N_SHORT,
    Plan,
    Workspace,
)
from alloc.allocators.runtime.compiled import compiled, inlined


@compiled
def recompute(arrays: InstanceArrays, plan: Plan, makespan: float) -> None:
    """Compute group abilities, cost and shortfalls of the plan from scratch."""
    idle = plan.demand.shape[0] - 1
    group_of_agent, group_ability, origin = plan.group_of_agent, plan.group_ability, arrays.origin
    ability, hours_per_distance = arrays.ability, arrays.hours_per_distance
    for task in range(idle + 1):
        group_ability[task] = 0.0
    total = 0.0
    for agent in range(group_of_agent.shape[0]):
        task = group_of_agent[agent]
        if task != idle:
            row = origin[agent]
            distance, cost = distance_and_cost(arrays, row, task)
            group_ability[task] += effective_ability(ability[agent], hours_per_distance[agent], makespan, distance)
            total += cost
    plan.cost[CURRENT] = total
    plan.counter[N_SHORT] = 0
    for task in range(idle):
        plan.short_position[task] = -1
        update_shortfall(plan, task)


@inlined
def update_shortfall(plan: Plan, task: int) -> None:
    """Add a task to the list of tasks with a shortfall, or remove it, according to its group ability."""
    position, is_short = plan.short_position[task], plan.group_ability[task] < plan.demand[task]
    if is_short and position < 0:
        plan.short_position[task] = plan.counter[N_SHORT]
        plan.short_task[plan.counter[N_SHORT]] = task
        plan.counter[N_SHORT] += 1
    elif not is_short and position >= 0:
        plan.counter[N_SHORT] -= 1
        last = plan.short_task[plan.counter[N_SHORT]]
        plan.short_task[position] = last
        plan.short_position[last] = position
        plan.short_position[task] = -1


@inlined
def move(plan: Plan, agent: int, target: int) -> None:
    """Move an agent to another group, without updating group abilities."""
    source = plan.group_of_agent[agent]
    plan.size[source] -= 1
    last = plan.slot[plan.begin[source] + plan.size[source]]
    plan.slot[plan.begin[source] + plan.position[agent]] = last
    plan.position[last] = plan.position[agent]
    plan.slot[plan.begin[target] + plan.size[target]] = agent
    plan.position[agent] = plan.size[target]
    plan.size[target] += 1
    plan.group_of_agent[agent] = target
    entry = plan.counter[N_LOGGED] % LOG_SIZE
    plan.moved[entry], plan.source[entry] = agent, source
    plan.counter[N_LOGGED] += 1
    if plan.counter[N_MOVES] < plan.journal.shape[0]:
        plan.journal[plan.counter[N_MOVES]] = agent
    plan.counter[N_MOVES] += 1


@inlined
def apply_subset(plan: Plan, work: Workspace, pool: int, subset: np.uint64, task: int, other: int) -> None:
    """Move the agents of the pool that are in `subset` to `task`, and the rest to `other`."""
    idle = plan.demand.shape[0] - 1
    for index in range(pool):
        agent = work.agent[index]
        target, sign = other, -1.0
        if (subset >> np.uint64(index)) & np.uint64(1) != np.uint64(0):
            target, sign = task, 1.0
        if plan.group_of_agent[agent] == target:
            continue
        if plan.begin[target] + plan.size[target] == plan.begin[target + 1]:
            plan.counter[FULL_GROUP] = 1
            continue
        move(plan, agent, target)
        plan.group_ability[task] += sign * work.ability[index]
        plan.group_ability[other] -= sign * work.other_ability[index]
        plan.cost[CURRENT] += sign * work.extra_cost[index]
    update_shortfall(plan, task)
    if other != idle:
        update_shortfall(plan, other)


@inlined
def save_best(plan: Plan) -> None:
    """Save the plan as the best so far, writing only the changes since it was last saved."""
    if plan.counter[N_MOVES] > plan.journal.shape[0]:
        for agent in range(plan.group_of_agent.shape[0]):
            plan.best_group[agent] = plan.group_of_agent[agent]
    else:
        for entry in range(plan.counter[N_MOVES]):
            agent = plan.journal[entry]
            plan.best_group[agent] = plan.group_of_agent[agent]
    plan.counter[N_MOVES] = 0
    plan.cost[BEST] = plan.cost[CURRENT]
