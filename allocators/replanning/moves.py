"""The differences between an allocation and the plan in force."""

from dataclasses import dataclass

from alloc.allocators.contract.tolerance import relative_gap


@dataclass(frozen=True)
class Moves:
    """Differences between an allocation and the plan in force.

    Attributes
    ----------
    agents : tuple of int
        Agents that get a different task, including those that were idle.
    stayed : int
        Number of agents that keep their task.
    idle : tuple of int
        Agents that had a task and are idle now.
    price : float
        Energy that is added to the cost for each move.
    cost, cost_lower_bound : float or None
        The cost that was minimised at this makespan, which is energy plus prices of moves, or the number of moves if
        that is the objective; and a proven bound on it. None if moves have no price.
    """

    agents: tuple[int, ...]
    stayed: int
    idle: tuple[int, ...]
    price: float = 0.0
    cost: float | None = None
    cost_lower_bound: float | None = None

    @property
    def gap(self) -> float | None:
        """Relative gap (cost - bound) / cost."""
        if self.cost is None or self.cost_lower_bound is None:
            return None
        return relative_gap(self.cost, self.cost_lower_bound)
