"""Re-planning with a plan in force: moves may have a price, and agents may be pinned to tasks.

The price of a move is added to the cost of the agent's flight, so that methods minimise it, and prove bounds on it, as
they do for energy: they get an instance whose `Reach` has these costs. A pinned agent can do only its task, at no cost.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.contract.improvement import Improvement
from alloc.allocators.replanning.moves import Moves
from alloc.allocators.replanning.pins import pinned
from alloc.problems import IDLE, Allocation, InputError, Instance, Objective, evaluate
from alloc.problems.allocation import CarriedOver
from alloc.problems.distances.build import replanned
from alloc.problems.instance import FloatArray, IntArray

if TYPE_CHECKING:
    from alloc.allocators.result import Result

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Replanning:
    """The plan in force, prices of moves and pins of a run.

    Attributes
    ----------
    instance : Instance
        The instance as given, without prices and pins.
    objective : Objective
        The objective as given.
    plan, target : ndarray of int, shape (n,)
        The task of each agent in the plan in force, -1 for idle; and the same with the tasks of pinned agents.
    has_plan : bool
        Whether there is a plan in force.
    is_planned : ndarray of bool, shape (n,)
        Whether the agent is in the plan and its task still exists; other agents move at no price.
    pinned : ndarray of bool, shape (n,)
    price : float
        Energy that is added to the cost for each move.
    """

    instance: Instance
    objective: Objective
    plan: IntArray
    target: IntArray
    has_plan: bool
    is_planned: Flags
    pinned: Flags
    price: float

    @property
    def changes_costs(self) -> bool:
        """Whether the costs or tasks that methods see differ from those of the instance."""
        return self.price > 0 or bool(self.pinned.any()) or self.objective is Objective.MAKESPAN_MOVES

    @property
    def priced_instance(self) -> Instance:
        """The instance with prices and pins, on which methods run."""
        if not self.changes_costs:
            return self.instance
        only_moves = self.objective is Objective.MAKESPAN_MOVES
        price: FloatArray = np.where(self.is_planned, 1.0 if only_moves else self.price, 0.0)
        priced = replace(self.instance)
        priced.__dict__["reach"] = replanned(
            self.instance.reach,
            self.target,
            price,
            self.pinned,
            energy_counts=not only_moves,
            cost_counts=self.objective is not Objective.MAKESPAN,
        )
        return priced

    @property
    def method_objective(self) -> Objective:
        """The objective that methods optimise."""
        return Objective.MAKESPAN_ENERGY if self.objective is Objective.MAKESPAN_MOVES else self.objective

    def completed(self, allocation: Allocation) -> Allocation:
        """Return the allocation with all pinned agents on their tasks."""
        return Allocation(np.where(self.pinned, self.target, allocation.task_of_agent))

    def on_instance(self, improvement: Improvement) -> Improvement:
        """Convert an improvement on `priced_instance` to one on the instance itself."""
        if not self.changes_costs:
            return improvement
        allocation = self.completed(improvement.allocation)
        return replace(improvement, allocation=allocation, evaluation=evaluate(self.instance, allocation))

    @property
    def pins(self) -> dict[str, str | None]:
        """Task id of each agent id that is pinned, None for idle."""
        tasks: list[str | None] = [*self.instance.task_ids, None]
        return {self.instance.agent_ids[i]: tasks[self.target[i]] for i in np.flatnonzero(self.pinned).tolist()}

    def moves(self, allocation: Allocation, bound: float | None) -> Moves:
        """Return the differences between an allocation and the plan, and their cost.

        Parameters
        ----------
        allocation : Allocation
        bound : float or None
            Lower bound on the cost that methods minimise on `priced_instance`.
        """
        task, had = allocation.task_of_agent, self.plan
        moved = self.is_planned & (task != had) & (task != IDLE)
        idle = self.is_planned & (task == IDLE) & (had != IDLE)
        cost, unseen = None, 0.0  # methods do not see the cost of pinned agents
        pinned = float((moved & self.pinned).sum())
        if self.objective is Objective.MAKESPAN_MOVES:
            cost, unseen = float(moved.sum()), pinned
        elif self.price > 0:
            cost = evaluate(self.instance, allocation).energy + self.price * float(moved.sum())
            unseen = self.energy_of_pinned + self.price * pinned
        return Moves(
            agents=tuple(np.flatnonzero(moved).tolist()),
            stayed=int((self.is_planned & (task == had) & (had != IDLE)).sum()),
            idle=tuple(np.flatnonzero(idle).tolist()),
            price=self.price,
            cost=cost,
            cost_lower_bound=None if cost is None or bound is None else bound + unseen,
        )

    @property
    def energy_of_pinned(self) -> float:
        """Energy of the flights of pinned agents, which methods do not see."""
        agents = np.flatnonzero(self.pinned & (self.target != IDLE))
        task = np.full(self.instance.n, IDLE, dtype=np.intp)
        task[agents] = self.target[agents]
        return min(evaluate(self.instance, Allocation(task)).energy, sys.float_info.max)


def concluded(result: "Result", plan: Replanning) -> "Result":
    """Convert the result of a run on `Replanning.priced_instance` to one on the instance itself.

    Parameters
    ----------
    result : Result
    plan : Replanning
    """
    if result.allocation is None:
        return replace(result, instance=plan.instance, objective=plan.objective)
    if not plan.changes_costs:
        return replace(result, moves=plan.moves(result.allocation, None) if plan.has_plan else None)
    allocation = plan.completed(result.allocation)
    bound = result.energy_lower_bound
    energy_bound = bound
    if plan.price > 0 or plan.objective is Objective.MAKESPAN_MOVES:
        energy_bound = None
    elif bound is not None:
        energy_bound = bound + plan.energy_of_pinned
    return replace(
        result,
        instance=plan.instance,
        objective=plan.objective,
        allocation=allocation,
        evaluation=evaluate(plan.instance, allocation),
        energy_lower_bound=energy_bound,
        trace=tuple(replace(point, energy=point.energy + plan.energy_of_pinned) for point in result.trace),
        moves=plan.moves(allocation, bound) if plan.has_plan else None,
        pins=plan.pins,
    )


def replanning(
    instance: Instance,
    objective: Objective,
    plan: Allocation | None,
    carried: CarriedOver | None,
    price: float,
    pins: Mapping[str, str | None],
) -> Replanning:
    """Check and combine the plan in force, the price of moves and the pins of a run.

    Parameters
    ----------
    instance : Instance
    objective : Objective
    plan : Allocation or None
        The plan in force; if None, moves cannot have a price.
    carried : CarriedOver or None
        How the instance has changed since the plan was made.
    price : float
        Energy that is added to the cost for each move.
    pins : mapping
        Task id of each pinned agent by agent id, None for idle.

    Raises
    ------
    InputError
        If moves have a price and there is no plan, or a pinned agent cannot do its task.
    """
    if plan is None and (price > 0 or objective is Objective.MAKESPAN_MOVES):
        name = "move_price" if price > 0 else "objective"
        raise InputError("needs the plan in force; give it as start (--start)", name)
    if price > 0 and objective is not Objective.MAKESPAN_ENERGY:
        raise InputError(
            f"is weighed against energy; use it with the objective {Objective.MAKESPAN_ENERGY}", "move_price"
        )
    task = np.full(instance.n, IDLE, dtype=np.intp) if plan is None else plan.task_of_agent.copy()
    is_planned = np.full(instance.n, plan is not None)
    if carried is not None:
        unknown = [instance.agent_index[name] for name in (*carried.new_agents, *carried.agents_without_task)]
        is_planned[unknown] = False
    target, is_pinned = task.copy(), np.zeros(instance.n, dtype=np.bool_)
    for name, goal in pins.items():
        agent, target_task = pinned(instance, name, goal)
        is_pinned[agent], target[agent] = True, target_task
    return Replanning(instance, objective, task, target, plan is not None, is_planned, is_pinned, price)
