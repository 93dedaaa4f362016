"""A compiled exchange, which reassigns agents of two groups to these groups at the least cost."""

import numpy as np

from alloc.allocators.heuristic.local_search.distances import compute_distance, effective_ability, listed_entry
from alloc.allocators.heuristic.local_search.instance_arrays import InstanceArrays
from alloc.allocators.heuristic.local_search.moves import apply_subset
from alloc.allocators.heuristic.local_search.plan import (
    MAX_SUMS,
    NOISE_SIZE,
    POOL_BY_HALVES,
    POOL_BY_SUMS,
    POOL_ENUMERATED,
    POOL_TRAVELLING,
    Needs,
    Plan,
    Weights,
    Workspace,
)
from alloc.allocators.heuristic.local_search.subsets import best_by_enumeration, best_by_halves, best_by_sums
from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.random import draw


@compiled
def add_to_pool(
    arrays: InstanceArrays,
    plan: Plan,
    work: Workspace,
    weights: Weights,
    makespan: float,
    group: int,
    first: int,
    task: int,
    other: int,
    most: int,
    pool: int,
) -> int:
    """Add up to `most` agents of `group` that can reach both tasks, starting at position `first`.

    Returns the new size of the pool.
    """
    size, begin, slot = plan.size[group], plan.begin[group], plan.slot
    idle = plan.demand.shape[0] - 1
    origins, ability, hours_per_distance = arrays.origin, arrays.ability, arrays.hours_per_distance
    table, costs_of, starts, goals = arrays.distance, arrays.cost, arrays.origin_position, arrays.task_position
    longest, battery, rate = arrays.longest_distance, arrays.battery, arrays.energy_per_distance
    list_begin, listed = arrays.list_begin, arrays.listed_task
    agents, contribution, other_contribution = work.agent, work.ability, work.other_ability
    listed_distance, listed_cost = arrays.listed_distance, arrays.listed_cost
    extra, costs, logistic = work.extra_cost, work.cost, work.logistic
    noise = draw(plan.random, NOISE_SIZE)
    full = pool + most
    for step in range(size):
        if pool == full:
            break
        position = first + step
        agent = slot[begin + (position if position < size else position - size)]
        row = origins[agent]
        there, cost_there = 0.0, 0.0
        if table.shape[0] > 0:
            here, cost_here = table[row, task], costs_of[row, task]
            if other != idle:
                there, cost_there = table[row, other], costs_of[row, other]
        elif listed_distance.shape[0] > 0:
            entry = listed_entry(list_begin, listed, row, task)
            if entry < 0:
                continue
            here, cost_here = listed_distance[entry], listed_cost[entry]
            if other != idle:
                entry = listed_entry(list_begin, listed, row, other)
                if entry < 0:
                    continue
                there, cost_there = listed_distance[entry], listed_cost[entry]
        else:
            here = compute_distance(starts, goals, longest, battery, list_begin, listed, rate, row, task)
            if other != idle:
                there = compute_distance(starts, goals, longest, battery, list_begin, listed, rate, row, other)
            cost_here, cost_there = here, there
        if here == np.inf or there == np.inf:
            continue
        w, slow = ability[agent], hours_per_distance[agent]
        agents[pool] = agent
        contribution[pool] = effective_ability(w, slow, makespan, here)
        other_contribution[pool] = 0.0 if other == idle else effective_ability(w, slow, makespan, there)
        extra[pool] = cost_here - cost_there
        costs[pool] = weights.cost * (cost_here - cost_there) + weights.noise * logistic[(noise + step) % NOISE_SIZE]
        pool += 1
    return pool


@compiled
def exchange(
    arrays: InstanceArrays,
    plan: Plan,
    work: Workspace,
    weights: Weights,
    makespan: float,
    agent: int,
    task: int,
    other: int,
) -> int:
    """Reassign the agents of two groups at the least sum of weighted flight costs, noise and shortfall penalties.

    Of large groups, only some agents take part: from `agent` on in its group, and from a random one on otherwise (-1).
    `other` may be the group of idle agents. Returns the number of agents that took part.
    """
    if plan.demand[other] < plan.demand[task] and other != plan.demand.shape[0] - 1:
        task, other = other, task
    by_sums = weights.integer_ability * POOL_BY_SUMS < MAX_SUMS
    most = POOL_BY_SUMS // 2 if by_sums else POOL_BY_HALVES // 2
    enumerated = POOL_ENUMERATED if arrays.instant_travel else POOL_TRAVELLING
    if plan.size[task] + plan.size[other] <= enumerated:
        most = enumerated
    elif not arrays.instant_travel:  # meeting in the middle does not apply, as contributions depend on the task
        most = enumerated // 2
    pool: int = np.int64(0)  # type: ignore[assignment]
    for group in (task, other):
        if plan.size[group] > 0:
            first = draw(plan.random, plan.size[group])
            if agent >= 0 and plan.group_of_agent[agent] == group:
                first = plan.position[agent]
            pool = add_to_pool(arrays, plan, work, weights, makespan, group, first, task, other, most, pool)
    missing = plan.demand[task] - plan.group_ability[task]
    other_missing = plan.demand[other] - plan.group_ability[other]
    total, members, largest = 0.0, 0, 0.0
    for index in range(pool):
        total += work.ability[index]
        largest = max(largest, work.ability[index])
        if plan.group_of_agent[work.agent[index]] == task:
            missing += work.ability[index]
            members += 1
        else:
            other_missing += work.other_ability[index]
    needs = Needs(
        missing=missing,
        other_missing=other_missing,
        price=plan.price[task],
        other_price=plan.price[other],
        all_in_pool=members == plan.size[task] and plan.demand[task] > 0.0,
        other_all_in_pool=pool - members == plan.size[other] and plan.demand[other] > 0.0,
    )
    if other == plan.demand.shape[0] - 1:
        most_needed = missing + largest  # a group that needs all its agents has a surplus below any of their abilities
    else:
        most_needed = max(missing, total - other_missing) + weights.surplus
    largest_sum = int(max(0.0, min(total, most_needed)))
    if by_sums and (pool > POOL_ENUMERATED or pool * largest_sum < 2 << pool):
        subset = best_by_sums(work, weights, pool, largest_sum, total, needs)
    elif pool > POOL_ENUMERATED:
        subset = best_by_halves(work, weights, pool, needs)
    else:
        subset = best_by_enumeration(work, weights, pool, needs)
    apply_subset(plan, work, pool, subset, task, other)
    return pool
