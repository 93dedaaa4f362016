"""The policy `replan`: runs an allocator on a snapshot of the mission at every event."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.online.contract import Briefing, FleetDecider, Policy, PolicyInfo
from alloc.allocators.registry import load
from alloc.allocators.solve import solve
from alloc.problems import Instance, Objective
from alloc.problems.changes.remove import replaced
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.state import STAY, Order
from alloc.problems.missions.snapshot import snapshot

DEADLINE_SHARE = 0.7
"""Share of the decision's time limit that the method gets; the rest is for the snapshot and the orders."""


@dataclass(frozen=True)
class ReplanParameters(CheckedParameters):
    """Parameters of replanning.

    Attributes
    ----------
    method : str
        Name of the allocator, one of `names`.
    iterations : int
        Limit of each run, in the method's own unit: the same seed gives the same mission unless a deadline ends a run.
    move_price : float
        Penalty, in energy, for each agent whose task changes, >= 0; if positive, energy is minimised as well.
    """

    method: str = "local-search"
    iterations: int = bounded(20, low=0)
    move_price: float = bounded(0.0, low=0)


class Replan(Policy):
    """Runs an allocator of this package on a snapshot of the mission at every event.

    The snapshot has agents at their present places and tasks with the work left; the orders in force are the warm
    start. The allocator ignores later events, and that agents can take further tasks after their first.

    Raises
    ------
    InputError
        If the method is unknown, or a parameter is out of range.
    """

    info = PolicyInfo(name="replan", summary="any allocator on a snapshot of the mission, at every event", central=True)
    parameters_type: ClassVar[type] = ReplanParameters

    def __init__(self, parameters: ReplanParameters | None = None, **settings: object) -> None:
        super().__init__(parameters, **settings)
        self._method = load(self.parameters.method)
        solve(
            _tiny(self._method), self._method, iterations=1, time_limit_s=None, handle_signals=False
        )  # compiles loops

    def begin(self, briefing: Briefing) -> FleetDecider:
        """Return the planner for all agents."""
        return _Replanner(self, briefing)

    def plan(self, view: View, seed: int, time_limit_s: float | None) -> dict[str, str | None]:
        """Return the task of each agent in a new plan; empty if there is nothing to plan."""
        instance = snapshot(view)
        if instance is None:
            return {}
        if not self._method.method.finite_speeds and instance.has_travel_time:
            instance = replaced(instance, speed=np.full(instance.n, np.inf))
        price = self.parameters.move_price
        start = {name: self._in_force(view, name, instance) for name in instance.agent_ids}
        result = solve(
            instance,
            self._method,
            objective=Objective.MAKESPAN_ENERGY if price > 0 else Objective.MAKESPAN,
            iterations=self.parameters.iterations,
            time_limit_s=time_limit_s,
            seed=seed,
            threads=1,
            start=start if price > 0 or any(start.values()) else None,
            move_price=price,
            handle_signals=False,
        )
        return {} if result.allocation is None else result.allocation.to_ids(instance)

    def _in_force(self, view: View, name: str, instance: Instance) -> str | None:
        task = view.agents[name].task
        return task if task in instance.task_index else None


def _tiny(method: Allocator) -> Instance:
    """Return a tiny instance with all features of snapshots: travel times, batteries, more tasks than agents."""
    places = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    return Instance(
        ability=[1, 2],
        workload=[1, 1, 1],
        agent_position=places[:2],
        task_position=places,
        battery=[9, 9],
        speed=[1, 1] if method.method.finite_speeds else None,
    )


class _Replanner(FleetDecider):
    def __init__(self, policy: Replan, briefing: Briefing) -> None:
        self._policy, self._seed = policy, briefing.seed[0]
        limit = briefing.deadline_s
        self._time_limit_s = None if limit is None else DEADLINE_SHARE * limit

    def decide(self, view: View) -> Mapping[str, Order]:
        plan = self._policy.plan(view, self._seed, self._time_limit_s)
        return {name: STAY if task is None else Order(task) for name, task in plan.items()}
