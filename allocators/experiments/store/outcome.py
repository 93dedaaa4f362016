"""Endings of runs, including failures of their processes."""

from dataclasses import dataclass
from enum import StrEnum


class Outcome(StrEnum):
    """Outcome of a run."""

    SOLVED = "solved"
    """The run has a result; see its status."""

    REFUSED = "refused"
    """The method refused the instance or the budget."""

    FAILED = "failed"
    """The method raised an exception; its traceback is kept."""

    EXITED = "exited"
    """The method ended its process, as `os._exit` does."""

    KILLED = "killed"
    """An external signal, or a crash in native code, ended the process."""

    HUNG = "hung"
    """The run far exceeded its time limit and was killed."""

    OUT_OF_MEMORY = "out of memory"
    """The run exceeded the memory limit, or could not allocate memory."""

    MISSING_PACKAGE = "missing package"
    """A package that the method needs is not installed."""


TRANSIENT = frozenset({Outcome.MISSING_PACKAGE})
"""Outcomes that are always retried, as the missing package may have been installed since."""

UNSOLVED = frozenset(Outcome) - {Outcome.SOLVED, Outcome.REFUSED}
"""Outcomes that are retried on request."""

TracePoints = tuple[tuple[float, float | None, float, float | None], ...]
"""Time in seconds, makespan in hours, energy, and lower bound in hours of each improvement."""


@dataclass(frozen=True, kw_only=True)
class Ending:
    """Ending of a run: the part of a row of the store that does not describe the run itself.

    Attributes
    ----------
    outcome : Outcome
    reason : str
        Why there is no result, in one line.
    details : str
        The traceback, or the end of the output of the process.
    exit_code : int or None
        Exit code of the process, if it ended; negative for a signal.
    picked : str
        The method that ran; differs from the requested one if that is ``auto``.
    status, stop_reason : str
        Status and stop reason of the result; a mission has no stop reason.
    makespan, served_makespan, lower_bound, gap : float or None
        In hours, and the relative gap; None as in `Result`.
    energy, energy_lower_bound, energy_gap, distance, battery_remaining_percent, reward : float or None
    unserved : int or None
        Number of unserved tasks; in a mission, of missed and remaining ones.
    runtime_s : float or None
        Duration of the run by its own clock.
    wall_s : float
        Seconds until the outcome was known.
    cpu_s : float or None
        Processor time of the process during the run.
    memory_mb : float
        Peak resident memory observed, of the process and all its descendants, in MiB.
    memory_limit_mb : float
        Limit on that memory.
    cores : str
        Processors to which the process was pinned, such as ``0,1``; empty if it was not.
    at_once : int
        Maximum number of parallel runs of this command during the run, including itself.
    started_at, finished_at : float
        Seconds since 1970.
    trace : tuple
        See `TracePoints`.
    measures : str or None
        For a mission, its `MissionResult` as JSON.
    host : str
        The cluster machine that executed the run; empty for this machine.
    revision : str
        Commit of alloc, if it ran or was installed from a checkout; see `revision`.
    """

    outcome: Outcome
    reason: str = ""
    details: str = ""
    exit_code: int | None = None
    picked: str = ""
    status: str = ""
    stop_reason: str = ""
    makespan: float | None = None
    served_makespan: float | None = None
    lower_bound: float | None = None
    gap: float | None = None
    energy: float | None = None
    energy_lower_bound: float | None = None
    energy_gap: float | None = None
    distance: float | None = None
    battery_remaining_percent: float | None = None
    reward: float | None = None
    unserved: int | None = None
    runtime_s: float | None = None
    wall_s: float = 0.0
    cpu_s: float | None = None
    memory_mb: float = 0.0
    memory_limit_mb: float = 0.0
    cores: str = ""
    at_once: int = 1
    started_at: float = 0.0
    finished_at: float = 0.0
    trace: TracePoints = ()
    measures: str | None = None
    host: str = ""
    revision: str = ""
