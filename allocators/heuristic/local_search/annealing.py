"""Simulated annealing over exchanges, compiled."""

from alloc.allocators.heuristic.local_search.candidates import Candidates
from alloc.allocators.heuristic.local_search.chains import FEW, chain, draw_candidate, draw_helper
from alloc.allocators.heuristic.local_search.exchange import exchange
from alloc.allocators.heuristic.local_search.instance_arrays import InstanceArrays
from alloc.allocators.heuristic.local_search.moves import save_best
from alloc.allocators.heuristic.local_search.plan import BEST, CURRENT, FULL_GROUP, N_SHORT, Plan, Weights, Workspace
from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.random import draw

PRICE_GROWTH = 0.3
"""Relative rise of the price of a task with each exchange that leaves it short, per relative shortfall."""

HIGHEST_PRICE = 1e6
"""Highest price, where the mean is 1 when the search for a target makespan begins."""

SMALLEST_GAIN = 1e-10
"""Relative improvement of the cost from which on a plan is saved as the best."""


@compiled
def raise_price(plan: Plan, task: int) -> None:
    """Raise the price of a short task, so that its shortfall goes on to tasks that can make up for it."""
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
    """Make `steps` exchanges, the noise multiplied by `cooling` before each; return the last noise.

    A task that stays short rises in price: shortfalls go on, over any number of tasks, to where agents are cheap, as in
    auctions. Where cost has no weight, only exchanges with short tasks are made, until there is none; otherwise the
    plan of least cost without a shortfall is saved.

    References
    ----------
    Penalties that rise where a constraint stays violated: Morris (1993), AAAI-93, 40-45; Yagiura, Ibaraki and Glover
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
            chain(arrays, plan, work, now, candidates, makespan, agent, task)
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
