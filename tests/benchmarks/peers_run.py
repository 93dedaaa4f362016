"""One method on one instance, for `peers.py`: prints the allocation, seconds, the bound and peak memory as JSON."""

import json
import resource
import sys
import time
import types
from pathlib import Path

import numpy as np

from alloc.problems import Instance, read_instance

Answer = dict[str, object]
IMPOSSIBLE = "beyond it: "


def ours(name: str, instance: Instance, objective: str, limit_s: float, threads: int, radius: float | None) -> Answer:
    from alloc.allocators import RefusedError, load, solve

    allocator = load(name, communication_radius=radius)
    try:
        result = solve(instance, allocator, objective=objective, time_limit_s=limit_s, threads=threads)
    except RefusedError as refused:
        return {"why": "refused: " + str(refused).partition(": ")[2].partition(";")[0]}
    if result.allocation is None:
        return {"why": "no answer", "seconds": result.runtime_s}
    return {"task": result.allocation.task_of_agent.tolist(), "seconds": result.runtime_s, "bound": result.lower_bound}


def naive_cvxpy(instance: Instance, objective: str, limit_s: float) -> Answer:
    """Maximise 1 / T over every e_ij, then fly least at that T."""
    import cvxpy as cp

    begin = time.monotonic()
    e, pace = cp.Variable((instance.n, instance.m), boolean=True), cp.Variable()
    reach = instance.reach.mask[instance.reach.origin].astype(float)
    rules = [cp.sum(e, axis=1) <= 1, e <= reach]
    plan = None
    goals = [(cp.Maximize(pace), instance.ability @ e >= pace * instance.workload)]
    for stage in range(2 if objective == "makespan-energy" else 1):
        goal, rule = goals[stage]
        left = limit_s - (time.monotonic() - begin)
        if left <= 0:
            break
        try:
            problem = cp.Problem(goal, [*rules, rule])
            problem.solve(solver=cp.HIGHS, highs_options={"time_limit": left, "threads": 1})
        except cp.error.SolverError:
            break
        if e.value is None or problem.status not in ("optimal", "optimal_inaccurate", "user_limit"):
            break
        whole = np.round(e.value)
        group = instance.ability @ whole
        if (group[instance.workload > 0] <= 0).any():
            break  # at a limit without an incumbent cvxpy gives zeros
        plan = np.where(whole.any(axis=1), whole.argmax(axis=1), -1)
        best = float((group[instance.workload > 0] / instance.workload[instance.workload > 0]).min())
        distance = instance.reach.distance[instance.reach.origin]
        enough = instance.workload * best * (1 - 1e-9)
        goals.append((cp.Minimize(cp.sum(cp.multiply(distance, e))), instance.ability @ e >= enough))
    seconds = time.monotonic() - begin
    return {"why": "no plan in time", "seconds": seconds} if plan is None else _answer(plan, seconds)


def naive_cpsat(instance: Instance, objective: str, limit_s: float, threads: int) -> Answer:
    """Do the same by CP-SAT; abilities and workloads are scaled to whole numbers."""
    from ortools.sat.python import cp_model

    begin = time.monotonic()
    whole = (instance.ability == np.round(instance.ability)).all() and (instance.workload % 1 == 0).all()
    scale = 1 if whole else 10**4
    ability = np.round(instance.ability * scale).astype(int).tolist()
    work = np.round(instance.workload * scale).astype(int).tolist()
    mask, distance = (table[instance.reach.origin] for table in (instance.reach.mask, instance.reach.distance))
    model, fine = cp_model.CpModel(), 10**6
    e = {(i, j): model.new_bool_var("") for i, j in np.argwhere(mask).tolist()}
    for i in range(instance.n):
        model.add_at_most_one(e[i, j] for j in np.flatnonzero(mask[i]).tolist())
    pace = model.new_int_var(0, int(fine * sum(ability) / max(1, min(h for h in work if h > 0))) + 1, "")
    done = [sum(ability[i] * e[i, j] for i in np.flatnonzero(mask[:, j]).tolist()) for j in range(instance.m)]
    for j, h in enumerate(work):
        if h > 0:
            model.add(fine * done[j] >= h * pace)
    model.maximize(pace)
    plan = None
    for _ in range(2 if objective == "makespan-energy" else 1):
        solver = cp_model.CpSolver()
        left = limit_s - (time.monotonic() - begin)
        if left <= 0:
            break
        solver.parameters.max_time_in_seconds, solver.parameters.num_workers = left, threads
        if solver.solve(model) not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
            break
        plan = np.full(instance.n, -1)
        for (i, j), variable in e.items():
            if solver.value(variable):
                plan[i] = j
        model.add(pace >= solver.value(pace))
        model.minimize(sum(int(10**6 * distance[pair]) * variable for pair, variable in e.items()))
    seconds = time.monotonic() - begin
    return {"why": "no plan in time", "seconds": seconds} if plan is None else _answer(plan, seconds)


def prtpy(instance: Instance, limit_s: float) -> Answer:
    """Maximise the smallest weighted sum; it sorts its bins, so they go to the tasks in order of their workloads."""
    import prtpy as library

    if not instance.reach.is_complete:
        return {"why": IMPOSSIBLE + "ranges"}
    items = dict(enumerate(instance.ability.tolist()))
    begin = time.monotonic()
    try:
        bins = library.partition(
            algorithm=library.partitioning.integer_programming,
            numbins=instance.m,
            items=items,
            weights=instance.workload.tolist(),
            objective=library.obj.MaximizeSmallestSum,
            outputtype=library.out.Partition,
            time_limit=limit_s,
        )
    except ValueError as error:
        return {"why": str(error), "seconds": time.monotonic() - begin}
    seconds, plan = time.monotonic() - begin, np.full(instance.n, -1)
    by_sum = sorted(bins, key=lambda members: sum(items[i] for i in members))
    for members, task in zip(by_sum, np.argsort(instance.workload).tolist(), strict=True):
        plan[members] = task
    return _answer(plan, seconds)


def pygrape(instance: Instance, folder: str, radius: float | None) -> Answer:
    """Play with its utility for unequal agents, by shares of abilities; agents communicate within `radius`."""
    if not folder:
        return {"why": "not at hand (--pygrape)"}
    if not instance.reach.is_complete:
        return {"why": IMPOSSIBLE + "ranges"}
    for name in ("imageio", "imageio.v2"):  # for films alone
        sys.modules.setdefault(name, types.ModuleType(name))
    sys.path.insert(0, folder)
    import pyGRAPE  # type: ignore[import-not-found]

    from alloc.allocators.heuristic.decentralised.communication import communication_graph

    graph, n = communication_graph(instance, np.inf if radius is None else radius), instance.n
    heard = np.ones((n, n), dtype=int) - np.eye(n, dtype=int)
    if not graph.is_complete:
        heard[:] = 0
        heard[np.repeat(np.arange(n), np.diff(graph.begin)), graph.neighbour] = 1
    np.random.seed(0)  # noqa: NPY002 (the one that it draws from)
    scenario = {
        "num_agents": n,
        "num_tasks": instance.m,
        "agent_comm_matrix": heard,
        "initial_allocation": np.full(n, -1),
        "environment": {
            "task_locations": np.nan_to_num(instance.task_position),
            "task_demands": instance.workload,
            "agent_locations": np.nan_to_num(instance.start_position),
            "agent_resources": instance.ability,
        },
    }
    begin = time.monotonic()
    found = pyGRAPE.grape_allocation(scenario, display_progress=False, util_type="energy_balanced")
    return _answer(np.array(found["final_allocation"]), time.monotonic() - begin)


def _answer(plan: np.ndarray, seconds: float) -> Answer:
    return {"task": plan.tolist(), "seconds": seconds, "bound": None}


def run(name: str, path: str, objective: str, limit_s: float, threads: int, folder: str) -> Answer:
    instance = read_instance(Path(path))
    name, _, distance = name.partition("@")
    radius = float(distance) if distance else None
    if name in ("naive-cvxpy", "naive-cpsat", "prtpy", "pygrape") and instance.has_travel_time:
        return {"why": IMPOSSIBLE + "finite speeds"}
    if name == "naive-cvxpy":
        return naive_cvxpy(instance, objective, limit_s)
    if name == "naive-cpsat":
        return naive_cpsat(instance, objective, limit_s, threads)
    if name == "prtpy":
        return prtpy(instance, limit_s)
    if name == "pygrape":
        return pygrape(instance, folder, radius)
    return ours(name, instance, objective, limit_s, threads, radius)


if __name__ == "__main__":
    method, path, objective, limit_s, threads, folder = sys.argv[1:]
    answer = run(method, path, objective, float(limit_s), int(threads), folder)
    answer["memory_mib"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print("\n" + json.dumps(answer))
