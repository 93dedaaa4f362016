"""The fewest unserved tasks: a bipartite matching of tasks with agents that can take them."""

from collections import deque

import numpy as np

from alloc.problems.allocation import Allocation
from alloc.problems.instance import IDLE, Instance, IntArray


class _Matching:
    """One agent kept for each served task, grown by augmenting paths (Berge 1957, doi:10.1073/pnas.43.9.842)."""

    def __init__(self, instance: Instance, task_of_agent: IntArray) -> None:
        self.reach, self.m = instance.reach, instance.m
        self.task_of_agent = task_of_agent.copy()
        self.keeper = np.full(instance.m, IDLE, dtype=np.intp)
        working = np.flatnonzero(task_of_agent != IDLE)
        self.keeper[task_of_agent[working]] = working
        self.kept_task = np.full(instance.n, IDLE, dtype=np.intp)
        held = np.flatnonzero(self.keeper != IDLE)
        self.kept_task[self.keeper[held]] = held
        self.spent = np.zeros(instance.n, dtype=bool)  # met by a search that failed: no later path leads through them

    def serve(self, task: int) -> IntArray | None:
        """Serve `task` along a path with the fewest moves; None if done, else the tasks that compete for its agents."""
        came_from: dict[int, tuple[int, int]] = {}  # task -> (task that wants its keeper, that keeper)
        seen_agents = self.spent.copy()
        queue, seen = deque([task]), {task}
        while queue:
            wanting = queue.popleft()
            able = np.flatnonzero(self.reach.mask[self.reach.origin, wanting] & ~seen_agents)
            free = able[self.kept_task[able] == IDLE]
            if len(free):
                self._augment(wanting, self._cheapest(free, wanting), came_from)
                return None
            seen_agents[able] = True
            for agent in able.tolist():
                held = int(self.kept_task[agent])
                if held not in seen:
                    seen.add(held)
                    came_from[held] = (wanting, agent)
                    queue.append(held)
        self.spent = seen_agents
        return np.array(sorted(seen), dtype=np.intp)

    def _cheapest(self, agents: IntArray, task: int) -> int:
        """Prefer an idle agent, then the nearest."""
        busy = self.task_of_agent[agents] != IDLE
        return int(agents[np.lexsort((self.reach.distance[self.reach.origin[agents], task], busy))[0]])

    def _augment(self, task: int, agent: int, came_from: dict[int, tuple[int, int]]) -> None:
        while True:
            self.keeper[task], self.kept_task[agent], self.task_of_agent[agent] = agent, task, task
            if task not in came_from:
                return
            task, agent = came_from[task]


def _needs_agent(instance: Instance) -> IntArray:
    return np.flatnonzero(instance.workload > 0)


def serve_all(instance: Instance, allocation: Allocation) -> Allocation:
    """Change `allocation` so that as few tasks as possible are unserved.

    Agents sent where they cannot go are idle in the answer. A task that is served stays served. Agents change places
    along augmenting paths alone, each with the fewest moves, at whose end an idle agent is preferred, then the nearest.
    """
    task = allocation.task_of_agent.copy()
    working = np.flatnonzero(task != IDLE)
    task[working[~instance.reach.allows(working, task[working])]] = IDLE
    served = np.zeros(instance.m, dtype=bool)
    served[task[task != IDLE]] = True
    unserved = [j for j in _needs_agent(instance).tolist() if not served[j]]
    if not unserved:
        return Allocation(task)
    matching = _start(instance, task)
    for j in unserved:
        matching.serve(j)
    return Allocation(matching.task_of_agent)


def _start(instance: Instance, task_of_agent: IntArray) -> _Matching:
    """Begin a matching in which tasks without workload keep nobody."""
    matching = _Matching(instance, task_of_agent)
    for j in np.flatnonzero(instance.workload == 0).tolist():
        if matching.keeper[j] != IDLE:
            matching.kept_task[matching.keeper[j]] = IDLE
            matching.keeper[j] = IDLE
    return matching


def fewest_unserved(instance: Instance) -> int:
    """Return how many tasks with workload no allocation can serve, at the least.

    By Hopcroft and Karp (1973), doi:10.1137/0202019, on origins with their number of agents as copies.
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import maximum_bipartite_matching

    tasks = _needs_agent(instance)
    if instance.reach.is_complete:
        return max(0, len(tasks) - instance.n)
    copies = np.minimum(np.bincount(instance.reach.origin, minlength=len(instance.reach.mask)), len(tasks))
    row_of_copy = np.repeat(np.arange(len(copies)), copies)
    graph = csr_matrix(instance.reach.mask[:, tasks][row_of_copy].T)
    return int((maximum_bipartite_matching(graph, perm_type="column") == IDLE).sum())


def contested_tasks(instance: Instance) -> IntArray | None:
    """Return an inclusion-minimal set of tasks that too few agents can reach, or None if all tasks can be served.

    Such a set has one task more than agents that can take any of them; without any one of its tasks, the rest could
    be served (Hall 1935, doi:10.1112/jlms/s1-10.37.26).
    """
    matching = _start(instance, np.full(instance.n, IDLE, dtype=np.intp))
    for j in _needs_agent(instance).tolist():
        rivals = matching.serve(j)
        if rivals is not None:
            return rivals
    return None
