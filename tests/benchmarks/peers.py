"""Models as one would state them without further thought, and published programs, as methods of `alloc compare`.

    export PYTHONPATH=tests/benchmarks:FOLDER    # with peers-1.0.dist-info and, for pygrape, pyGRAPE.py
    alloc compare paper-1:0-4 'covering[agents=9,tasks=3,ability_max=20]:0-4' --methods cpsat,naive-cvxpy,naive-cpsat,prtpy \
        --time-limit 3 --store peers.db --report peers.md

`naive-cvxpy` and `naive-cpsat` decide every pair of agent and task (e_ij), first for the makespan and then, in what time
is left, for the energy at it; `prtpy` is its integer programme for the weighted largest smallest sum (pip install
alloc-mrta[bench]); `pygrape` is github.com/inmo-jang/pyGRAPE, in which agents hear each other up to
`communication_radius`.
"""  # noqa: E501

import sys
import types
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from alloc.allocators import Allocator, Method, Proposal, Search
from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.problems import Allocation, Objective, RefusedError


def stages(search: Search) -> int:
    """Return how many programmes are solved: one for the makespan, and where it counts one for the energy."""
    return 2 if search.objective is Objective.MAKESPAN_ENERGY else 1


def refuse_ranges(search: Search) -> None:
    """Refuse an instance in which an agent cannot take every task."""
    if not search.instance.reach.is_complete:
        raise RefusedError("ranges are beyond it")


class NaiveCvxpy(Allocator):
    """Maximise 1 / T over every e_ij, then fly least at that T."""

    method = Method(name="naive-cvxpy", summary="every e_ij by cvxpy and HiGHS", requires=("cvxpy", "highspy"))

    def allocate(self, search: Search) -> Proposal:
        """Solve both programmes, as far as the time goes."""
        import cvxpy as cp

        instance = search.instance
        e, pace = cp.Variable((instance.n, instance.m), boolean=True), cp.Variable()
        reach = instance.reach.mask[instance.reach.origin].astype(float)
        rules = [cp.sum(e, axis=1) <= 1, e <= reach]
        goals = [(cp.Maximize(pace), instance.ability @ e >= pace * instance.workload)]
        has_work = instance.workload > 0
        for stage in range(stages(search)):
            goal, rule = goals[stage]
            if search.remaining_s <= 0:
                break
            problem = cp.Problem(goal, [*rules, rule])
            try:
                problem.solve(solver=cp.HIGHS, highs_options={"time_limit": search.remaining_s, "threads": 1})
            except cp.error.SolverError:
                break
            if e.value is None or problem.status not in ("optimal", "optimal_inaccurate", "user_limit"):
                break
            whole = np.round(e.value)
            group = instance.ability @ whole
            if (group[has_work] <= 0).any():
                break  # at a limit without an incumbent cvxpy gives zeros
            search.submit(Allocation(np.where(whole.any(axis=1), whole.argmax(axis=1), -1)))
            best = float((group[has_work] / instance.workload[has_work]).min())
            distance = instance.reach.distance[instance.reach.origin]
            enough = instance.workload * best * (1 - 1e-9)
            goals.append((cp.Minimize(cp.sum(cp.multiply(distance, e))), instance.ability @ e >= enough))
        return Proposal()


class NaiveCpsat(Allocator):
    """Do the same by CP-SAT; abilities and workloads are scaled to whole numbers."""

    method = Method(name="naive-cpsat", summary="every e_ij by CP-SAT", requires=("ortools",))

    def allocate(self, search: Search) -> Proposal:
        """Solve both programmes, as far as the time goes."""
        from ortools.sat.python import cp_model

        instance = search.instance
        whole = (instance.ability == np.round(instance.ability)).all() and (instance.workload % 1 == 0).all()
        scale, fine = 1 if whole else 10**4, 10**6
        ability = np.round(instance.ability * scale).astype(int).tolist()
        work = np.round(instance.workload * scale).astype(int).tolist()
        mask, distance = (table[instance.reach.origin] for table in (instance.reach.mask, instance.reach.distance))
        model = cp_model.CpModel()
        e = {(i, j): model.new_bool_var("") for i, j in np.argwhere(mask).tolist()}
        for i in range(instance.n):
            model.add_at_most_one(e[i, j] for j in np.flatnonzero(mask[i]).tolist())
        pace = model.new_int_var(0, int(fine * sum(ability) / max(1, min(h for h in work if h > 0))) + 1, "")
        for j, h in enumerate(work):
            if h > 0:
                model.add(fine * sum(ability[i] * e[i, j] for i in np.flatnonzero(mask[:, j]).tolist()) >= h * pace)
        model.maximize(pace)
        for _ in range(stages(search)):
            solver = cp_model.CpSolver()
            if search.remaining_s <= 0:
                break
            solver.parameters.max_time_in_seconds = search.remaining_s
            solver.parameters.num_workers = search.threads
            if solver.solve(model) not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
                break
            plan = np.full(instance.n, -1)
            for (i, j), variable in e.items():
                if solver.value(variable):
                    plan[i] = j
            search.submit(Allocation(plan))
            model.add(pace >= solver.value(pace))
            model.minimize(sum(int(10**6 * distance[pair]) * variable for pair, variable in e.items()))
        return Proposal()


class Prtpy(Allocator):
    """Maximise the smallest weighted sum; it sorts its bins, so they go to the tasks in order of their workloads."""

    method = Method(name="prtpy", summary="the integer programme of prtpy", requires=("prtpy",))

    def allocate(self, search: Search) -> Proposal:
        """Partition the abilities."""
        import prtpy as library

        refuse_ranges(search)
        instance = search.instance
        items = dict(enumerate(instance.ability.tolist()))
        bins = library.partition(
            algorithm=library.partitioning.integer_programming,
            numbins=instance.m,
            items=items,
            weights=instance.workload.tolist(),
            objective=library.obj.MaximizeSmallestSum,
            outputtype=library.out.Partition,
            time_limit=search.remaining_s,
        )
        plan = np.full(instance.n, -1)
        by_sum = sorted(bins, key=lambda members: sum(items[i] for i in members))
        for members, task in zip(by_sum, np.argsort(instance.workload).tolist(), strict=True):
            plan[members] = task
        return Proposal(Allocation(plan))


@dataclass(frozen=True)
class PyGrapeParameters(CheckedParameters):
    """How far agents hear each other from their starts."""

    communication_radius: float = bounded(np.inf, 0.0, infinite=True)


class PyGrape(Allocator):
    """Play with its utility for unequal agents, by shares of abilities; agents communicate within a radius."""

    method = Method(name="pygrape", summary="the reference of the game that hedonic plays", requires=("pyGRAPE",))
    parameters_type: ClassVar[type] = PyGrapeParameters
    parameters: PyGrapeParameters

    def allocate(self, search: Search) -> Proposal:
        """Play to the end, whatever the limit."""
        refuse_ranges(search)
        for name in ("imageio", "imageio.v2"):  # for films alone
            sys.modules.setdefault(name, types.ModuleType(name))
        import pyGRAPE  # type: ignore[import-not-found]

        from alloc.allocators.heuristic.decentralised.communication import communication_graph

        instance, n = search.instance, search.instance.n
        graph = communication_graph(instance, self.parameters.communication_radius)
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
        found = pyGRAPE.grape_allocation(scenario, display_progress=False, util_type="energy_balanced")
        return Proposal(Allocation(np.array(found["final_allocation"])))
