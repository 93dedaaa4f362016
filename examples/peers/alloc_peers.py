"""Published programs and a plain model as methods: `prtpy`, `pygrape` and `classes`; see README.md."""

import sys
import types
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from alloc.allocators import Allocator, Method, Proposal, Search
from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.problems import Allocation, RefusedError, agent_classes


def refuse_ranges(search: Search) -> None:
    """Refuse an instance in which an agent cannot take every task."""
    if not search.instance.reach.is_complete:
        raise RefusedError("does not support ranges")


class Prtpy(Allocator):
    """Maximise the smallest weighted sum; prtpy sorts its bins, so they are matched to tasks in order of workload."""

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


class Classes(Allocator):
    """Maximise the minimum over tasks of the share of work done in an hour, in millionths."""

    method = Method(name="classes", summary="CP-SAT over classes of agents, the straightforward model")

    def allocate(self, search: Search) -> Proposal:
        """Solve, and assign the members of each class in order."""
        from ortools.sat.python import cp_model

        refuse_ranges(search)
        instance, fine = search.instance, 10**6
        classes = agent_classes(instance, by_place=False)
        ability, work = classes.ability.astype(int).tolist(), instance.workload.astype(int).tolist()
        model = cp_model.CpModel()
        x = [[model.new_int_var(0, int(count), "") for _ in work] for count in classes.count]
        pace = model.new_int_var(0, int(fine * instance.ability.sum() / min(work)) + 1, "")
        for j, h in enumerate(work):
            model.add(fine * sum(a * x[k][j] for k, a in enumerate(ability)) >= h * pace)
        for row, count in zip(x, classes.count.tolist(), strict=True):
            model.add(sum(row) <= count)
        model.maximize(pace)
        solver = cp_model.CpSolver()
        solver.parameters.max_time_in_seconds, solver.parameters.num_workers = search.remaining_s, search.threads
        if solver.solve(model) not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
            return Proposal(None)
        counts = np.array([[solver.value(variable) for variable in row] for row in x])
        bound = fine / max(solver.best_objective_bound + 1, 1)
        return Proposal(classes.spread(counts), makespan_lower_bound=bound)


@dataclass(frozen=True)
class PyGrapeParameters(CheckedParameters):
    """Communication radius of agents, measured between their starts."""

    communication_radius: float = bounded(np.inf, 0.0, infinite=True)


class PyGrape(Allocator):
    """pyGRAPE with its utility for heterogeneous agents, by shares of abilities; agents communicate within a radius."""

    method = Method(name="pygrape", summary="reference implementation of hedonic's game", requires=("pyGRAPE",))
    parameters_type: ClassVar[type] = PyGrapeParameters
    parameters: PyGrapeParameters

    def allocate(self, search: Search) -> Proposal:
        """Play to the end, ignoring the time limit."""
        refuse_ranges(search)
        for name in ("imageio", "imageio.v2"):  # needed for animations only
            sys.modules.setdefault(name, types.ModuleType(name))
        import pyGRAPE  # type: ignore[import-not-found]

        from alloc.allocators.heuristic.decentralised.communication import communication_graph

        instance, n = search.instance, search.instance.n
        graph = communication_graph(instance, self.parameters.communication_radius)
        heard = np.ones((n, n), dtype=int) - np.eye(n, dtype=int)
        if not graph.is_complete:
            heard[:] = 0
            heard[np.repeat(np.arange(n), np.diff(graph.begin)), graph.neighbour] = 1
        np.random.seed(0)  # noqa: NPY002 (pyGRAPE uses the global generator)
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
