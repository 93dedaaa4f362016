"""The status of a run's answer: whether it is proven to be optimal, feasible or neither."""

from enum import StrEnum


class Status(StrEnum):
    """Status of an answer.

    `optimal`: every stage of the objective is proven to a relative gap of 1e-6; `feasible`: every task is served;
    `infeasible`: no allocation serves every task, and the answer serves as many as possible; `no_solution`: no
    allocation was found.
    """

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    NO_SOLUTION = "no_solution"
