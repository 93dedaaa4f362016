"""Least number of unserved tasks, and the tasks that compete for too few agents."""

from dataclasses import dataclass, replace

import numpy as np

from alloc.problems.distances.neighbours import Neighbours, estimated_pairs
from alloc.problems.instance import Instance, IntArray
from alloc.problems.matching.agent_matching import AgentMatching
from alloc.problems.matching.clock import GATHERED_PER_SECOND, Clock, at_least, share_of, unlimited
from alloc.problems.matching.hopcroft_karp import match
from alloc.problems.matching.precedence import Precedence, differs, of_first, urgent_first
from alloc.problems.matching.priority import most_priority, sampled_matching, values_of_rows
from alloc.problems.matching.serving import needs_agent, serve_in_turn
from alloc.problems.vocabulary import IDLE

PROOF_SHARE = 0.5
"""Share of the time to determine whether all tasks can be served, if there may be enough agents."""

SHORTEST_S = 0.1
"""Minimum time in seconds for a table of all pairs, even without time left."""

FEW, SAMPLE = 8, 20
"""Number of agents near a task that a quick heuristic tries, and of sampled agents per task."""


@dataclass(frozen=True, eq=False)
class CompetingPart:
    """Tasks that compete for too few agents, with a matching.

    Attributes
    ----------
    agents : ndarray of int, shape (k,)
        Agents that serve one of `tasks` each, alone, in every allocation with the fewest unserved tasks.
    tasks : ndarray of int, shape (more than k,)
        All tasks that these agents serve in such an allocation, or that are unserved.
    task_of_agent : ndarray of int, shape (k,)
        A task of each of `agents`, without repetitions.
    unservable : ndarray of int
        A subset of `tasks` that fewer agents can reach.
    is_proven : bool
        Whether no allocation serves more tasks, or as many with more priority; False if time ran out.
    precedence : Precedence or None
        The matchings that serve the most priority; None if all serve the same.
    """

    agents: IntArray
    tasks: IntArray
    task_of_agent: IntArray
    unservable: IntArray
    is_proven: bool = True
    precedence: Precedence | None = None


def fewest_unserved(instance: Instance) -> int:
    """Return the least number of tasks with workload that any allocation leaves unserved.

    Parameters
    ----------
    instance : Instance

    Returns
    -------
    int
    """
    tasks, reach = needs_agent(instance), instance.reach
    if reach.is_complete:
        return max(0, len(tasks) - instance.n)
    if len(tasks) > instance.n and not reach.has_table:
        return len(tasks) - int((AgentMatching(instance, tasks, unlimited).task_of_agent != IDLE).sum())
    near = reach.neighbours
    if near is None:
        return sum(rivals is not None for rivals in serve_in_turn(instance, tasks))
    origin = _origin_of_task(instance, near, tasks)
    assert origin is not None, "there is no time limit"
    return int((origin[tasks] == IDLE).sum())


def _origin_of_task(
    instance: Instance, near: Neighbours, tasks: IntArray, time_left: Clock = unlimited
) -> IntArray | None:
    """Return the origin of a distinct agent for each of `tasks`, `IDLE` for none, shape (m,), by a maximum matching.

    None if time runs out.
    """
    degree, wanted = np.diff(near.first), np.zeros(instance.m, dtype=np.bool_)
    wanted[tasks] = True
    copies = np.minimum(np.bincount(instance.reach.origin, minlength=len(degree)), degree)
    origin = np.full(instance.m, IDLE, dtype=np.intp)
    for one in np.flatnonzero((copies == degree) & (degree > 1)).tolist():  # enough agents for all its tasks
        task = near.task[near.first[one] : near.first[one + 1]]
        origin[task] = one
    wanted &= origin == IDLE
    useful = wanted[near.task]
    first = np.concatenate([[0], np.cumsum(useful)])[near.first]
    row = np.repeat(np.arange(len(degree)), copies)
    length = np.diff(first)[row]
    if length.sum() > GATHERED_PER_SECOND * time_left():
        return None
    begin = np.concatenate([[0], np.cumsum(length)])
    entry = np.repeat(first[row] - begin[:-1], length) + np.arange(begin[-1])
    found, is_largest = match(begin, near.task[useful][entry], time_left)
    if not is_largest:
        return None
    origin[found[found != IDLE]] = row[found != IDLE]
    return origin


def competing_part(instance: Instance, time_left: Clock = unlimited) -> CompetingPart | None:
    """Return the tasks that compete for too few agents, and these agents.

    None if all tasks can be served, or if time or memory are insufficient to decide.
    """
    tasks, reach = needs_agent(instance), instance.reach
    if reach.is_complete:
        if instance.n >= len(tasks):
            return None
        everyone = np.arange(instance.n)
        chosen = _by_size(instance, everyone, urgent_first(instance, tasks)[: instance.n])
        order = of_first(instance, tasks, instance.n) if differs(instance, tasks) else None
        return CompetingPart(everyone, tasks, chosen, tasks[: instance.n + 1], precedence=order)
    if len(tasks) > instance.n and not reach.has_table:
        return _of_urgent_tasks(instance, tasks, time_left)
    part = _of_table_or_neighbours(instance, tasks, time_left)
    return None if part is None else _by_priority(instance, part, time_left)


def _of_urgent_tasks(instance: Instance, tasks: IntArray, time_left: Clock) -> CompetingPart:
    """Return the competing part for more tasks than agents, by a sample of pairs with the most urgent tasks first."""
    if not differs(instance, tasks):
        return _of_scarce_agents(instance, tasks, time_left)
    everyone = np.arange(instance.n)
    chosen = sampled_matching(instance, everyone, tasks, time_left)
    if (chosen != IDLE).all():
        order = of_first(instance, tasks, instance.n)
        return CompetingPart(everyone, tasks, chosen, tasks[: instance.n + 1], precedence=order)
    in_time, part, reach = share_of(PROOF_SHARE, time_left), None, instance.reach
    if estimated_pairs(reach) <= GATHERED_PER_SECOND * in_time() and reach.neighbours is not None:
        part = _of_neighbours(instance, tasks, reach.neighbours, in_time)
    part = part or _of_scarce_agents(instance, tasks, in_time, chosen)
    return _by_priority(instance, part, time_left, chosen)


def _by_priority(
    instance: Instance, part: CompetingPart, time_left: Clock, sampled: IntArray | None = None
) -> CompetingPart:
    """Return the competing part with a matching that serves the most priority."""
    if not len(part.agents) or not differs(instance, part.tasks):
        return part
    if instance.reach.has_table:
        time_left = at_least(SHORTEST_S, time_left)
    if sampled is not None:
        sampled = np.where(np.isin(sampled[part.agents], part.tasks), sampled[part.agents], IDLE)
    args = (instance, part.agents, part.tasks, part.task_of_agent, time_left)
    found, chosen, is_proven = most_priority(*args, sampled)
    return replace(part, task_of_agent=chosen, precedence=found, is_proven=part.is_proven and is_proven)


def _of_table_or_neighbours(instance: Instance, tasks: IntArray, time_left: Clock) -> CompetingPart | None:
    """Return the competing part if there may be enough agents, or if all pairs fit into a table."""
    reach = instance.reach
    time_left = share_of(PROOF_SHARE, time_left)
    if reach.has_table:
        time_left = at_least(SHORTEST_S, time_left)
    if _are_served_simply(instance, tasks, time_left):
        return None
    if not reach.has_table and estimated_pairs(reach) > GATHERED_PER_SECOND * time_left():
        return None
    return None if reach.neighbours is None else _of_neighbours(instance, tasks, reach.neighbours, time_left)


def _of_scarce_agents(
    instance: Instance, tasks: IntArray, time_left: Clock, start: IntArray | None = None
) -> CompetingPart:
    """Return the competing part for more tasks than agents, usually without enumerating all pairs."""
    matching = AgentMatching(instance, tasks, time_left, start)
    if matching.is_largest:
        agents, left = np.flatnonzero(~matching.replaceable), tasks[~matching.their_tasks[tasks]]
    else:
        agents, left = np.flatnonzero(matching.task_of_agent != IDLE), tasks
    unservable = left[: len(agents) + 1]
    return CompetingPart(agents, left, matching.task_of_agent[agents], unservable, matching.is_largest)


def _of_neighbours(instance: Instance, tasks: IntArray, near: Neighbours, time_left: Clock) -> CompetingPart | None:
    """Return the competing part from all pairs within reach."""
    origin = _origin_of_task(instance, near, tasks, time_left)
    if origin is None:
        return None
    left_out = tasks[origin[tasks] == IDLE]
    if not len(left_out):
        return None
    competing, origins = _rivals(near, origin, left_out, instance.m)
    first, by_origin = instance.reach.agents_by_origin
    held = competing[origin[competing] != IDLE]
    held = held[np.argsort(origin[held], kind="stable")]
    bounds = np.searchsorted(origin[held], [origins, origins + 1])
    agents = [by_origin[first[i] : first[i + 1]] for i in origins.tolist()]
    chosen = [
        _by_size(instance, group, held[begin:end]) for group, begin, end in zip(agents, *bounds.tolist(), strict=True)
    ]
    none: list[IntArray] = [np.zeros(0, dtype=np.intp)]
    unservable = _rivals(near, origin, left_out[:1], instance.m)[0]
    return CompetingPart(np.concatenate(agents + none), competing, np.concatenate(chosen + none), unservable)


def _by_size(instance: Instance, agents: IntArray, tasks: IntArray) -> IntArray:
    """Return one of `tasks` for each of as many agents, with larger workloads for more able agents."""
    chosen = np.empty(len(agents), dtype=np.intp)
    chosen[np.argsort(instance.ability[agents], kind="stable")] = tasks[
        np.argsort(instance.workload[tasks], kind="stable")
    ]
    return chosen


def _rivals(near: Neighbours, origin: IntArray, tasks: IntArray, m: int) -> tuple[IntArray, IntArray]:
    """Return all tasks that could replace one of `tasks` as unserved, and the origins that can take them.

    `origin` is a maximum matching of tasks with agents, in which each of `tasks` is unmatched.
    """
    first, by_task = near.by_task(m)
    held = np.flatnonzero(origin != IDLE)
    held = held[np.argsort(origin[held], kind="stable")]
    bounds = np.searchsorted(origin[held], np.arange(len(near.first)))
    is_rival, met = np.zeros(m, dtype=np.bool_), np.zeros(len(near.first) - 1, dtype=np.bool_)
    while len(tasks):
        is_rival[tasks] = True
        able = np.unique(values_of_rows(first, by_task, tasks))
        able = able[~met[able]]
        met[able] = True
        tasks = values_of_rows(bounds, held, able)
        tasks = tasks[~is_rival[tasks]]
    return np.flatnonzero(is_rival), np.flatnonzero(met)


def _are_served_simply(instance: Instance, tasks: IntArray, time_left: Clock) -> bool:
    """Return whether a quick heuristic serves all of `tasks`, as it does if there are plenty of agents."""
    if instance.n < len(tasks):
        return False
    return (_by_scarcity if instance.reach.has_table else _by_sample)(instance, tasks, time_left)


def _by_scarcity(instance: Instance, tasks: IntArray, time_left: Clock) -> bool:
    """Return whether a greedy heuristic serves all tasks: rarest first, by agents that can take the fewest tasks."""
    reach = instance.reach
    order = np.argsort(reach.mask[:, tasks].sum(axis=1), kind="stable")
    mask, left = reach.mask[np.ix_(order, tasks)], np.bincount(reach.origin, minlength=len(order))[order]
    for j in np.argsort(left @ mask, kind="stable").tolist():
        able = mask[:, j] & (left > 0)
        row = int(able.argmax())
        if not able[row] or time_left() <= 0:
            return False
        left[row] -= 1
    return True


def _by_sample(instance: Instance, tasks: IntArray, time_left: Clock) -> bool:
    """Return whether all tasks can be matched with nearby agents of a sample."""
    from scipy.spatial import cKDTree

    reach = instance.reach
    sample = np.random.default_rng(0).permutation(instance.n)[: SAMPLE * len(tasks)]
    sample = sample[~np.isnan(reach.place[reach.origin[sample], 0])]
    if np.isnan(reach.goal[tasks, 0]).any() or len(sample) < len(tasks):
        return False
    tree = cKDTree(reach.place[reach.origin[sample]])
    _, near = tree.query(reach.goal[tasks], k=min(FEW, len(sample)))
    agent, task = sample[near].ravel(), np.repeat(tasks, near.size // len(tasks))
    able = reach.allows(agent, task)
    first = np.concatenate([[0], np.cumsum(able.reshape(len(tasks), -1).sum(axis=1))])
    return bool((match(first, agent[able], time_left)[0] != IDLE).all())


def minimal_unservable_set(instance: Instance) -> IntArray | None:
    """Return an inclusion-minimal set of tasks that too few agents can reach, or None if all tasks can be served.

    Such a set has one task more than there are agents that can take any of them; every proper subset can be served
    (Hall 1935, doi:10.1112/jlms/s1-10.37.26).

    Parameters
    ----------
    instance : Instance

    Returns
    -------
    ndarray of int or None
        Task indices.
    """
    tasks, reach = needs_agent(instance), instance.reach
    if reach.is_complete:
        return tasks[: instance.n + 1] if len(tasks) > instance.n else None
    near = reach.neighbours
    if near is not None:
        origin = _origin_of_task(instance, near, tasks)
        assert origin is not None, "there is no time limit"
        left_out = tasks[origin[tasks] == IDLE]
        return _rivals(near, origin, left_out[:1], instance.m)[0] if len(left_out) else None
    return next((rivals for rivals in serve_in_turn(instance, tasks) if rivals is not None), None)
