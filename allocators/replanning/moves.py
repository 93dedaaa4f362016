"""How an allocation differs from the plan in force."""

from dataclasses import dataclass

from alloc.allocators.contract.tolerance import relative_gap


@dataclass(frozen=True)
class Moves:
    """How an allocation differs from the plan in force.

    Attributes
    ----------
    agents : tuple of int
        Agents that get another task than they had, those that were idle included.
    stayed : int
        Agents that keep their task.
    idle : tuple of int
        Agents that had a task and get none.
    price : float
        Energy that each move counts for.
    cost, cost_lower_bound : float or None
        What was minimised at this makespan: energy and price of all moves, or the number of moves where that is the
        objective; and a proven bound on it. None where moves had no price.
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
