"""Compiled simulated annealing over exchanges and ejection chains."""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.local_search.candidates import Candidates
from alloc.allocators.heuristic.local_search.distances import distance_and_cost, effective_ability
from alloc.allocators.heuristic.local_search.exchange import exchange
from alloc.allocators.heuristic.local_search.instance_arrays import InstanceArrays, Int32Array
from alloc.allocators.heuristic.local_search.moves import move, save_best, update_shortfall
from alloc.allocators.heuristic.local_search.plan import (
    BEST,
    CURRENT,
    FULL_GROUP,
    LOG_SIZE,
    N_LOGGED,
    N_SHORT,
    NOISE_SIZE,
    Plan,
    Weights,
    Workspace,
)
from alloc.allocators.heuristic.local_search.subsets import penalty
from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.random import draw

TRIES = 30
"""Maximum number of draws to find an agent that can reach a task."""

ANY_TASK_PERIOD = 8
"""Period of exchanges with any task instead of a candidate, on average."""

FEW = 3
"""Number of agents in an exchange up to which an ejection chain follows, as few agents can do both tasks."""

LENGTH = 3
"""Maximum number of tasks through which an ejection chain passes a shortfall."""

PRICE_GROWTH = 0.3
"""Relative increase of the price of a task after each exchange that leaves it short, per relative shortfall."""

HIGHEST_PRICE = 1e6
"""Highest price; the mean price is 1 when the search for a target makespan begins."""

SMALLEST_GAIN = 1e-10
"""Least relative improvement of the cost for a plan to be saved as the best."""


@compiled
def draw_candidate(random: NDArray[np.uint64], tasks: int, candidates: Int32Array) -> int:
    """Return a random task from a row of candidates, or occasionally any task."""
    if draw(random, ANY_TASK_PERIOD) == 0:
        return draw(random, tasks)
    candidate: int = candidates[draw(random, candidates.shape[0])]
    return candidate


@compiled
def draw_helper(arrays: InstanceArrays, plan: Plan, candidates: Candidates, task: int) -> int:
    """Return a random agent, which can reach `task` if a few draws find such an agent.

    Without a table of distances, it is mostly an agent of a task that is near to, or listed for, an agent of `task`: of
    a million agents, hardly any reaches a given task.
    """
    agent = 0
    table, origin, random, agents = arrays.distance, arrays.origin, plan.random, plan.group_of_agent.shape[0]
    if table.shape[0] == 0 and plan.size[task] > 0 and draw(random, ANY_TASK_PERIOD) > 0:
        row = origin[plan.slot[plan.begin[task] + draw(random, plan.size[task])]]
        begin, count = arrays.list_begin[row], arrays.list_begin[row + 1] - arrays.list_begin[row]
        if count > 0:
            near = arrays.listed_task[begin + draw(random, count)]
        else:
            near = candidates.of_origin[candidates.row[row], draw(random, candidates.of_origin.shape[1])]
        if 0 <= near < plan.demand.shape[0] - 1 and near != task and plan.size[near] > 0:
            return int(plan.slot[plan.begin[near] + draw(random, plan.size[near])])
    for _ in range(TRIES):
        agent = draw(random, agents)
        if table.shape[0] == 0 or table[origin[agent], task] < np.inf:
            break
    return agent


@compiled
def note_group(plan: Plan, work: Workspace, weights: Weights, count: int, group: int) -> int:
    """Record ability and penalty of a group before it changes, once; return the number of recorded groups."""
    for index in range(count):
        if work.touched[index] == group:
            return count
    work.touched[count], work.touched_ability[count] = group, plan.group_ability[group]
    work.touched_penalty[count] = shortfall_penalty(plan, weights, group)
    return count + 1


@compiled
def shortfall_penalty(plan: Plan, weights: Weights, group: int) -> float:
    """Return the penalty of the current shortfall of a group; the group of idle agents has no demand."""
    missing = plan.demand[group] - plan.group_ability[group]
    return penalty(weights, plan.price[group], missing, plan.size[group] == 0)


@compiled
def relocate(arrays: InstanceArrays, plan: Plan, makespan: float, agent: int, task: int) -> bool:
    """Move an agent to another task unconditionally; return whether it can do that task."""
    row, w, slow = arrays.origin[agent], arrays.ability[agent], arrays.hours_per_distance[agent]
    other = plan.group_of_agent[agent]
    here, cost_here = distance_and_cost(arrays, row, task)
    if here == np.inf or plan.begin[task] + plan.size[task] == plan.begin[task + 1]:
        return False
    there, cost_there = distance_and_cost(arrays, row, other)
    move(plan, agent, task)
    plan.group_ability[task] += effective_ability(w, slow, makespan, here)
    plan.group_ability[other] -= effective_ability(w, slow, makespan, there)
    plan.cost[CURRENT] += cost_here - cost_there
    update_shortfall(plan, task)
    update_shortfall(plan, other)
    return True


@compiled
def undo(plan: Plan, work: Workspace, since: int, count: int, cost: float) -> None:
    """Undo the moves from entry `since` of the log on, and the changes of the first `count` recorded groups."""
    idle = plan.demand.shape[0] - 1
    for number in range(plan.counter[N_LOGGED] - 1, since - 1, -1):
        move(plan, plan.moved[number % LOG_SIZE], plan.source[number % LOG_SIZE])
    for index in range(count):
        group = work.touched[index]
        plan.group_ability[group] = work.touched_ability[index]
        if group != idle:
            update_shortfall(plan, group)
    plan.cost[CURRENT] = cost


@compiled
def eject(
    arrays: InstanceArrays,
    plan: Plan,
    work: Workspace,
    weights: Weights,
    candidates: Candidates,
    makespan: float,
    agent: int,
    task: int,
) -> None:
    """Move an agent to another task, repair the resulting shortfalls in turn, and keep the result if cheaper.

    Its former task takes idle agents, or agents of a third task, which may then become short in turn; finally, `task`
    releases the agents that it no longer needs. Penalties of intermediate shortfalls are ignored.

    References
    ----------
    Ejection chains: Glover (1996), doi:10.1016/0166-218X(94)00037-E; for generalised assignment Yagiura, Ibaraki and
    Glover (2004), doi:10.1287/ijoc.1030.0036.
    """
    idle, since, cost = plan.demand.shape[0] - 1, plan.counter[N_LOGGED], plan.cost[CURRENT]
    former = short = plan.group_of_agent[agent]
    if short == task or plan.demand[task] == 0.0 or plan.demand[short] == 0.0:  # the demand of idle agents is 0
        return
    count = note_group(plan, work, weights, 0, idle)
    count = note_group(plan, work, weights, count, short)
    count = note_group(plan, work, weights, count, task)
    if not relocate(arrays, plan, makespan, agent, task):
        return
    for _ in range(LENGTH):
        if plan.size[idle] > 0:
            exchange(arrays, plan, work, weights, makespan, -1, short, idle)
        if plan.group_ability[short] >= plan.demand[short]:
            break
        helper = draw_helper(arrays, plan, candidates, short)
        third = plan.group_of_agent[helper]
        is_way_back = third == task and short == former
        if third != short and plan.demand[third] > 0.0 and not is_way_back:
            count = note_group(plan, work, weights, count, third)
            exchange(arrays, plan, work, weights, makespan, helper, short, third)
            if plan.group_ability[third] < plan.demand[third]:
                short = third
    exchange(arrays, plan, work, weights, makespan, -1, task, idle)
    gain = weights.cost * (cost - plan.cost[CURRENT])
    for index in range(count):
        gain += work.touched_penalty[index] - shortfall_penalty(plan, weights, work.touched[index])
    noise = weights.noise * work.logistic[draw(plan.random, NOISE_SIZE)]
    if gain <= noise or plan.counter[FULL_GROUP] > 0:
        undo(plan, work, since, count, cost)


@compiled
def raise_price(plan: Plan, task: int) -> None:
    """Raise the price of a short task, so that its shortfall moves to tasks that can compensate for it."""
    shortfall = 1.0 - plan.group_ability[task] / plan.demand[task]
    plan.price[task] = min(plan.price[task] * (1.0 + PRICE_GROWTH * shortfall), HIGHEST_PRICE)


@compiled
def anneal(
    arrays: InstanceArrays,
    plan: Plan,
    work: Workspace,
    candidates: Candidates,
    makespan: float,
    steps: int,
    weights: Weights,
    cooling: float,
) -> float:
    """Make `steps` exchanges, multiplying the noise by `cooling` before each; return the last noise.

    The price of a task that stays short rises: shortfalls move, over any number of tasks, to where agents are cheap, as
    in auctions. If cost has no weight, only exchanges with short tasks are made, until there are none; otherwise the
    plan of least cost without a shortfall is saved.

    References
    ----------
    Penalties that rise while a constraint is violated: Morris (1993), AAAI-93, 40-45; Yagiura, Ibaraki and Glover
    (2004), doi:10.1287/ijoc.1030.0036.
    """
    tasks, agents = plan.demand.shape[0] - 1, plan.group_of_agent.shape[0]
    noise = weights.noise
    for _ in range(steps):
        noise *= cooling
        now = Weights(
            weights.cost, noise, weights.short_task, weights.shortfall, weights.surplus, weights.integer_ability
        )
        agent = -1
        if plan.counter[N_SHORT] > 0 and (weights.cost == 0.0 or draw(plan.random, 4) == 0):
            task = plan.short_task[draw(plan.random, plan.counter[N_SHORT])]
            if plan.size[tasks] > 0 and draw(plan.random, 2) == 0:
                other = tasks
            else:
                agent = draw_helper(arrays, plan, candidates, task)
                other = plan.group_of_agent[agent]
        else:
            agent = draw(plan.random, agents)
            other = plan.group_of_agent[agent]
            task = draw_candidate(plan.random, tasks, candidates.of_origin[candidates.row[arrays.origin[agent]]])
            surplus = other < tasks and plan.group_ability[other] > plan.demand[other]
            if other < tasks and (task == other or (surplus and draw(plan.random, 4) == 0)):
                if surplus or plan.size[tasks] > 0:
                    task, other = other, tasks
                else:
                    task = draw_candidate(plan.random, tasks, candidates.of_task[other])
        if task < 0 or other < 0 or task == other or plan.demand[task] == 0.0:
            continue
        if other < tasks and plan.demand[other] == 0.0:
            continue
        pool = exchange(arrays, plan, work, now, makespan, agent, task, other)
        if weights.cost > 0.0 and pool <= FEW and agent >= 0 and plan.counter[FULL_GROUP] == 0:
            eject(arrays, plan, work, now, candidates, makespan, agent, task)
        if plan.counter[FULL_GROUP] > 0:
            break
        if plan.group_ability[task] < plan.demand[task]:
            raise_price(plan, task)
        if plan.counter[N_SHORT] == 0:
            if weights.cost == 0.0:
                break
            if plan.cost[CURRENT] < plan.cost[BEST] * (1 - SMALLEST_GAIN):
                save_best(plan)
    return noise
