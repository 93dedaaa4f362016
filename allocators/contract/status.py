"""How good the answer of a run is proven to be."""

from enum import StrEnum


class Status(StrEnum):
    """How good an answer is proven to be.

    `optimal`: every stage of the objective is proven to 1e-6 relative; `feasible`: every task is served; `infeasible`:
    no allocation serves every task, the answer as many as possible; `no_solution`: there is no allocation.
    """

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    NO_SOLUTION = "no_solution"
