"""A new best allocation of a run, and its figures, which are kept in the trace."""

from dataclasses import dataclass

from alloc.problems import Allocation, Evaluation


@dataclass(frozen=True)
class TracePoint:
    """The figures of one improvement of a run.

    Attributes
    ----------
    time_s : float
        Seconds since the run began.
    makespan : float or None
        In hours; None if a task is unserved.
    energy : float
    lower_bound : float or None
        Best lower bound on the makespan at that time, in hours; None if it is unknown, as in a result that was read
        from a file.
    """

    time_s: float
    makespan: float | None
    energy: float
    lower_bound: float | None = None


@dataclass(frozen=True)
class Improvement:
    """A new best allocation, as passed to `on_improvement`.

    Attributes
    ----------
    time_s : float
        Seconds since the run began.
    allocation : Allocation
    evaluation : Evaluation
    lower_bound : float
        Best lower bound on the makespan at that time, in hours.
    """

    time_s: float
    allocation: Allocation
    evaluation: Evaluation
    lower_bound: float

    @property
    def figures(self) -> TracePoint:
        """The figures without the allocation, which take little memory."""
        return TracePoint(self.time_s, self.evaluation.makespan, self.evaluation.energy, self.lower_bound)
