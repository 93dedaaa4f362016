"""The compiled loops: distances, moves, and the best way to share the agents of two tasks out between them."""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.local_search.instance_arrays import Ground, Small
from alloc.allocators.heuristic.local_search.plan import (
    BEST,
    CHANGED,
    CROWDED,
    FLOWN,
    MOST_FREE,
    MOST_HALVED,
    MOST_SUMS,
    MOST_TRIED,
    SHORTS,
    TABLE_SIZE,
    Plan,
    Scratch,
    Weights,
)
from alloc.allocators.runtime.compiled import compiled, inlined
from alloc.allocators.runtime.random import draw
from alloc.problems.instance import FloatArray

EMPTY = 1e12
"""Penalty of a task without anybody, beyond all others."""

LOOK = 8
"""Sums of the second half that are looked at for each of the first, from the least that is enough on."""

UNREACHED = 1e300
"""Cost of a sum of abilities that no set of agents has."""


@compiled
def measured(
    place: FloatArray,
    goal: FloatArray,
    farthest: FloatArray,
    battery: FloatArray,
    first: NDArray[np.int64],
    listed: Small,
    scale: float,
    rate: float,
    row: int,
    task: int,
) -> float:
    """Work out the distance from an origin to a task, ``inf`` where it is out of reach; exactly as `Reach` has it."""
    total = 0.0
    for axis in range(3):
        step = place[row, axis] - goal[task, axis]
        total += step * step
    distance: float = np.sqrt(total) * scale
    if np.isnan(distance):
        distance = 0.0
    distance = min(distance, 1.7976931348623157e308)
    if not distance <= farthest[row] or not rate * distance <= battery[row]:
        return np.inf
    low, high = first[row], first[row + 1]
    if low == high:
        return distance
    while low < high:
        middle = (low + high) // 2
        if listed[middle] < task:
            low = middle + 1
        else:
            high = middle
    return distance if low < first[row + 1] and listed[low] == task else np.inf


@inlined
def distance_of(ground: Ground, row: int, task: int) -> float:
    """Return the distance from an origin to a task without looking it up."""
    return measured(
        ground.place,
        ground.goal,
        ground.farthest,
        ground.battery,
        ground.first,
        ground.listed,
        ground.scale,
        ground.energy_per_distance,
        row,
        task,
    )


@compiled
def fill_table(ground: Ground, table: FloatArray) -> None:
    """Write all distances into `table`, shape (origins, m)."""
    for row in range(table.shape[0]):
        for task in range(table.shape[1]):
            table[row, task] = distance_of(ground, row, task)


@compiled
def share_of(ability: float, slow: float, hours: float, distance: float) -> float:
    """Return the ability that an agent brings to a task done in `hours`, less for the time it takes to get there."""
    return ability if slow == 0.0 else ability * max(0.0, 1.0 - distance * slow / hours)


@compiled
def settle(ground: Ground, plan: Plan, hours: float) -> None:
    """Work out loads, distance and shortages of the plan from scratch."""
    idle = plan.need.shape[0] - 1
    task_of, load, origin, ability, slow = plan.task, plan.load, ground.origin, ground.ability, ground.slow
    table = ground.table
    for task in range(idle + 1):
        load[task] = 0.0
    total = 0.0
    for agent in range(task_of.shape[0]):
        task = task_of[agent]
        if task != idle:
            row = origin[agent]
            distance = table[row, task] if table.shape[0] > 0 else distance_of(ground, row, task)
            load[task] += share_of(ability[agent], slow[agent], hours, distance)
            total += distance
    plan.figure[FLOWN] = total
    plan.counter[SHORTS] = 0
    for task in range(idle):
        plan.short_at[task] = -1
        note_shortage(plan, task)


@inlined
def note_shortage(plan: Plan, task: int) -> None:
    """Put a task on the list of those that lack something, or take it off."""
    at, lacks = plan.short_at[task], plan.load[task] < plan.need[task]
    if lacks and at < 0:
        plan.short_at[task] = plan.counter[SHORTS]
        plan.short[plan.counter[SHORTS]] = task
        plan.counter[SHORTS] += 1
    elif not lacks and at >= 0:
        plan.counter[SHORTS] -= 1
        last = plan.short[plan.counter[SHORTS]]
        plan.short[at] = last
        plan.short_at[last] = at
        plan.short_at[task] = -1


@inlined
def move(plan: Plan, agent: int, goal: int) -> None:
    """Put an agent into another group; loads are the caller's."""
    home = plan.task[agent]
    plan.size[home] -= 1
    last = plan.slot[plan.begin[home] + plan.size[home]]
    plan.slot[plan.begin[home] + plan.at[agent]] = last
    plan.at[last] = plan.at[agent]
    plan.slot[plan.begin[goal] + plan.size[goal]] = agent
    plan.at[agent] = plan.size[goal]
    plan.size[goal] += 1
    plan.task[agent] = goal
    if plan.counter[CHANGED] < plan.journal.shape[0]:
        plan.journal[plan.counter[CHANGED]] = agent
    plan.counter[CHANGED] += 1


@inlined
def keep(plan: Plan) -> None:
    """Remember the plan as the best so far, writing only what changed since the last time."""
    if plan.counter[CHANGED] > plan.journal.shape[0]:
        for agent in range(plan.task.shape[0]):
            plan.best[agent] = plan.task[agent]
    else:
        for entry in range(plan.counter[CHANGED]):
            agent = plan.journal[entry]
            plan.best[agent] = plan.task[agent]
    plan.counter[CHANGED] = 0
    plan.figure[BEST] = plan.figure[FLOWN]


@compiled
def penalty(weights: Weights, lack: float, nobody: bool) -> float:
    """Price of what a task lacks."""
    if lack <= 0.0:
        return 0.0
    return weights.charge + weights.lack * lack + (EMPTY if nobody else 0.0)


@compiled
def gather(
    ground: Ground,
    plan: Plan,
    scratch: Scratch,
    weights: Weights,
    hours: float,
    group: int,
    first: int,
    task: int,
    other: int,
    most: int,
    pool: int,
) -> int:
    """Put up to `most` agents of `group`, from the one at `first` on, into the pool if both tasks are open to them."""
    size, begin, slot = plan.size[group], plan.begin[group], plan.slot
    idle = plan.need.shape[0] - 1
    origin, ability, slow, table = ground.origin, ground.ability, ground.slow, ground.table
    place, goal, farthest, battery = ground.place, ground.goal, ground.farthest, ground.battery
    lists, listed, scale, rate = ground.first, ground.listed, ground.scale, ground.energy_per_distance
    agents, bring_here, bring_there = scratch.agent, scratch.here, scratch.there
    flights, prices, logistic = scratch.flight, scratch.price, scratch.logistic
    noise = draw(plan.random, TABLE_SIZE)
    room = pool + most
    for step in range(size):
        if pool == room:
            break
        position = first + step
        agent = slot[begin + (position if position < size else position - size)]
        row = origin[agent]
        there = 0.0
        if table.shape[0] > 0:
            here = table[row, task]
            if other != idle:
                there = table[row, other]
        else:
            here = measured(place, goal, farthest, battery, lists, listed, scale, rate, row, task)
            if other != idle:
                there = measured(place, goal, farthest, battery, lists, listed, scale, rate, row, other)
        if here == np.inf or there == np.inf:
            continue
        agents[pool] = agent
        bring_here[pool] = share_of(ability[agent], slow[agent], hours, here)
        bring_there[pool] = 0.0 if other == idle else share_of(ability[agent], slow[agent], hours, there)
        flights[pool] = here - there
        prices[pool] = weights.distance * (here - there) + weights.noise * logistic[(noise + step) % TABLE_SIZE]
        pool += 1
    return pool


@compiled
def exchange(
    ground: Ground, plan: Plan, scratch: Scratch, weights: Weights, hours: float, agent: int, task: int, other: int
) -> None:
    """Share the agents of two groups out anew, as cheaply as can be; `agent` is one of them, or -1.

    Of large groups some agents are left where they are. The prices of what is left are distances, noise, and penalties
    for shortages. `other` may be the idle ones.
    """
    if plan.need[other] < plan.need[task] and other != plan.need.shape[0] - 1:
        task, other = other, task
    by_sum = weights.sums * MOST_FREE < MOST_SUMS
    most = MOST_FREE // 2 if by_sum else MOST_HALVED // 2
    if plan.size[task] + plan.size[other] <= MOST_TRIED:
        most = MOST_TRIED
    elif not ground.instant:  # what an agent brings depends on the task: to be just enough for one is no guide
        most = MOST_TRIED // 2
    pool: int = np.int64(0)  # type: ignore[assignment]
    for group in (task, other):
        if plan.size[group] > 0:
            first = draw(plan.random, plan.size[group])
            if agent >= 0 and plan.task[agent] == group:
                first = plan.at[agent]
            pool = gather(ground, plan, scratch, weights, hours, group, first, task, other, most, pool)
    left, right = plan.need[task] - plan.load[task], plan.need[other] - plan.load[other]
    total, members = 0.0, 0
    for index in range(pool):
        total += scratch.here[index]
        if plan.task[scratch.agent[index]] == task:
            left += scratch.here[index]
            members += 1
        else:
            right += scratch.there[index]
    alone = members == plan.size[task] and plan.need[task] > 0.0
    lonely = pool - members == plan.size[other] and plan.need[other] > 0.0
    most_here = left if other == plan.need.shape[0] - 1 else max(left, total - right)
    span = int(max(0.0, min(total, most_here + weights.spare)))
    if by_sum and (pool > MOST_TRIED or pool * span < 2 << pool):
        chosen = by_sums(scratch, weights, pool, span, total, left, right, alone, lonely)
    elif pool > MOST_TRIED:
        chosen = by_halves(scratch, weights, pool, left, right)
    else:
        chosen = by_trial(scratch, weights, pool, left, right, alone, lonely)
    apply(plan, scratch, pool, chosen, task, other)


@inlined
def apply(plan: Plan, scratch: Scratch, pool: int, chosen: np.uint64, task: int, other: int) -> None:
    """Send the chosen agents of the pool to `task` and the others to `other`."""
    idle = plan.need.shape[0] - 1
    for index in range(pool):
        agent = scratch.agent[index]
        goal, sign = other, -1.0
        if (chosen >> np.uint64(index)) & np.uint64(1) != np.uint64(0):
            goal, sign = task, 1.0
        if plan.task[agent] == goal:
            continue
        if plan.begin[goal] + plan.size[goal] == plan.begin[goal + 1]:
            plan.counter[CROWDED] = 1
            continue
        move(plan, agent, goal)
        plan.load[task] += sign * scratch.here[index]
        plan.load[other] -= sign * scratch.there[index]
        plan.figure[FLOWN] += sign * scratch.flight[index]
    note_shortage(plan, task)
    if other != idle:
        note_shortage(plan, other)


@compiled
def by_sums(
    scratch: Scratch,
    weights: Weights,
    pool: int,
    span: int,
    total: float,
    left: float,
    right: float,
    alone: bool,
    lonely: bool,
) -> np.uint64:
    """Choose among sets of the pool by dynamic programming over their sums; return the best as bits.

    For each sum up to `span` the cheapest set is known, first of no agents, then of the first agent, and so on.
    Indices are unsigned, as the compiler then need not look for negative ones.
    """
    cost, sets, sizes, prices = scratch.cost, scratch.sets, scratch.here, scratch.price
    old, new = np.uint64(0), np.uint64(MOST_SUMS)
    one, top = np.uint64(1), np.uint64(0)
    last = np.uint64(span)
    cost[0], sets[0] = 0.0, np.uint64(0)
    for index in range(pool):
        size, price, bit = np.uint64(sizes[index]), prices[index], one << np.uint64(index)
        reach = min(last, top + size)
        for entry in range(top + one, reach + one):
            cost[old + entry], sets[old + entry] = UNREACHED, np.uint64(0)
        for entry in range(np.uint64(0), min(size, reach + one)):
            cost[new + entry], sets[new + entry] = cost[old + entry], sets[old + entry]
        for entry in range(size, reach + one):
            without, with_it = cost[old + entry], cost[old + entry - size] + price
            cheaper = with_it < without
            cost[new + entry] = with_it if cheaper else without
            sets[new + entry] = (sets[old + entry - size] | bit) if cheaper else sets[old + entry]
        top = reach
        old, new = new, old
    best, chosen = np.inf, np.uint64(0)
    for entry in range(int(top) + 1):
        value = cost[old + np.uint64(entry)] + penalty(weights, left - entry, alone and entry == 0)
        value += penalty(weights, right - (total - entry), lonely and entry == total)
        if value < best:
            best, chosen = value, sets[old + np.uint64(entry)]
    return chosen


@compiled
def by_trial(
    scratch: Scratch, weights: Weights, pool: int, left: float, right: float, alone: bool, lonely: bool
) -> np.uint64:
    """Choose among all 2^pool sets by trying each; return the best as bits."""
    here, there, cost = scratch.trial_here, scratch.trial_there, scratch.trial_cost
    here[0], cost[0], there[0] = 0.0, 0.0, 0.0
    for index in range(pool):
        there[0] += scratch.there[index]
    for index in range(pool):
        half = 1 << index
        more, less, price = scratch.here[index], scratch.there[index], scratch.price[index]
        for entry in range(half):
            here[half + entry] = here[entry] + more
            there[half + entry] = there[entry] - less
            cost[half + entry] = cost[entry] + price
    count = 1 << pool
    best, chosen = np.inf, 0
    for entry in range(count):
        lack, other_lack = left - here[entry], right - there[entry]
        value = cost[entry]
        if lack > 0.0:
            value += penalty(weights, lack, alone and entry == 0)
        if other_lack > 0.0:
            value += penalty(weights, other_lack, lonely and entry == count - 1)
        if value < best:
            best, chosen = value, entry
    return np.uint64(chosen)


@compiled
def sorted_subsets(scratch: Scratch, begin: int, count: int, base: int) -> int:
    """Write all sets of `count` agents of the pool, in the order of their sums, from `base` on; return how many."""
    here, there, cost, sets = scratch.trial_here, scratch.trial_there, scratch.trial_cost, scratch.trial_set
    spare = 2 << (MOST_HALVED // 2)
    here[base], there[base], cost[base], sets[base] = 0.0, 0.0, 0.0, 0
    size = 1
    for index in range(begin, begin + count):
        more, less, price, bit = scratch.here[index], scratch.there[index], scratch.price[index], 1 << index
        without, with_it = base, base
        for entry in range(spare, spare + 2 * size):
            if with_it == base + size or (without < base + size and here[without] <= here[with_it] + more):
                here[entry], there[entry] = here[without], there[without]
                cost[entry], sets[entry] = cost[without], sets[without]
                without += 1
            else:
                here[entry], there[entry] = here[with_it] + more, there[with_it] + less
                cost[entry], sets[entry] = cost[with_it] + price, sets[with_it] | bit
                with_it += 1
        size *= 2
        for entry in range(size):
            here[base + entry], there[base + entry] = here[spare + entry], there[spare + entry]
            cost[base + entry], sets[base + entry] = cost[spare + entry], sets[spare + entry]
    return size


@compiled
def by_halves(scratch: Scratch, weights: Weights, pool: int, left: float, right: float) -> np.uint64:
    """Choose among sets of the pool that are just enough, each of one half and one of the other; return it as bits.

    By Horowitz and Sahni (1974), doi:10.1145/321812.321823: with both halves in order, for each set of the first one
    finds the sets of the second that make up for what is left.
    """
    here, there, cost, sets = scratch.trial_here, scratch.trial_there, scratch.trial_cost, scratch.trial_set
    middle = 1 << (MOST_HALVED // 2)
    size = sorted_subsets(scratch, 0, pool // 2, 0)
    other_size = sorted_subsets(scratch, pool // 2, pool - pool // 2, middle)
    total = 0.0
    for index in range(pool):
        total += scratch.there[index]
    best, chosen, enough = np.inf, 0, other_size
    for entry in range(size):
        while enough > 0 and here[entry] + here[middle + enough - 1] >= left:
            enough -= 1
        for fit in range(middle + max(0, enough - 1), middle + min(other_size, enough + LOOK)):
            value = cost[entry] + cost[fit] + penalty(weights, left - here[entry] - here[fit], False)
            value += penalty(weights, right - (total - there[entry] - there[fit]), False)
            if value < best:
                best, chosen = value, sets[entry] | sets[fit]
    return np.uint64(chosen)
