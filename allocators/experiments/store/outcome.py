"""How a run ended, whatever became of its process."""

from dataclasses import dataclass
from enum import StrEnum


class Outcome(StrEnum):
    """What became of a run."""

    SOLVED = "solved"
    """There is a result; its status says how good it is."""

    REFUSED = "refused"
    """The method cannot handle the instance within the budget, and said so."""

    FAILED = "failed"
    """An exception, whose traceback is kept."""

    EXITED = "exited"
    """The method ended its process, as `os._exit` does."""

    KILLED = "killed"
    """A signal from elsewhere, or a crash in native code, ended the process."""

    HUNG = "hung"
    """It was still running long after its budget, and was killed for it."""

    OUT_OF_MEMORY = "out of memory"
    """It ran into the memory limit, or an allocation failed."""

    MISSING_PACKAGE = "missing package"
    """A package that the method needs is not installed."""


TRANSIENT = frozenset({Outcome.MISSING_PACKAGE})
"""Outcomes that are never final: what was missing may have been installed since."""

UNSOLVED = frozenset(Outcome) - {Outcome.SOLVED, Outcome.REFUSED}
"""Outcomes that are tried again where that is asked for."""

TracePoints = tuple[tuple[float, float | None, float, float | None], ...]
"""Seconds, makespan in hours, energy, and lower bound in hours, of each improvement."""


@dataclass(frozen=True, kw_only=True)
class Ending:
    """How a run ended: a row of the store, beside what was run.

    Attributes
    ----------
    outcome : Outcome
    reason : str
        Why there is no result, in a line.
    details : str
        The traceback, or the end of what the process printed.
    exit_code : int or None
        That of the process, where it ended; negative for a signal.
    picked : str
        The method that ran, which differs from the one asked for where that is ``auto``.
    status, stop_reason : str
        Of the result; a mission has no reason to stop but its end.
    makespan, served_makespan, lower_bound, gap : float or None
        In hours, and the relative gap; None as in `Result`.
    energy, energy_lower_bound, energy_gap, distance, battery_remaining_percent, reward : float or None
    unserved : int or None
        Number of unserved tasks; in a mission, of those that were missed or are left.
    runtime_s : float or None
        Seconds of the run by its own clock.
    wall_s : float
        Seconds that passed until the outcome was known.
    cpu_s : float or None
        Processor time of the process during the run.
    memory_mb : float
        Largest resident memory seen, of the process and all its descendants, in MiB.
    memory_limit_mb : float
        The limit on it.
    cores : str
        Processors to which the process was pinned, such as ``0,1``; empty where it was not.
    at_once : int
        Runs that this command had going at once at most while this one ran, itself included.
    started_at, finished_at : float
        Seconds since 1970.
    trace : tuple
        See `TracePoints`.
    measures : str or None
        Of a mission: a `MissionResult` as JSON.
    host : str
        The machine of a cluster that made the run; empty for this one.
    revision : str
        Commit of alloc, where it ran from a checkout or was installed from one; see `revision`.
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
