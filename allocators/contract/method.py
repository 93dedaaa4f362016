"""What is known of a method before it is loaded."""

from dataclasses import dataclass
from enum import StrEnum
from importlib.util import find_spec

from alloc.problems import Objective


class Kind(StrEnum):
    """Families of methods."""

    EXACT = "exact"
    HEURISTIC = "heuristic"
    LEARNED = "learned"


@dataclass(frozen=True, kw_only=True)
class Method:
    """Name, needs and capabilities of a method.

    Attributes
    ----------
    name : str
        As in ``--method``; lower-case letters, digits and hyphens.
    summary : str
        One line.
    kind : Kind
    requires : tuple of str
        Modules that must be installed.
    objectives : tuple of Objective
        What it optimises; with any other objective `solve` refuses it.
    finite_speeds : bool
        Whether it handles agents that need time to travel; `solve` refuses it where it cannot.
    makespan_slack : bool
        Whether it spends the slack that `MakespanTolerance` leaves to the makespan on less energy; `solve` refuses it
        where it does not.
    proves : bool
        Whether it proves bounds of its own.
    warm_start : bool
        Whether it builds on a start allocation.
    anytime : bool
        Whether a longer budget gives better answers.
    options : tuple of str
        Options that its constructor takes.
    citation : str
        Where it comes from.
    """

    name: str
    summary: str
    kind: Kind = Kind.HEURISTIC
    requires: tuple[str, ...] = ()
    objectives: tuple[Objective, ...] = (Objective.MAKESPAN, Objective.MAKESPAN_ENERGY)
    finite_speeds: bool = False
    makespan_slack: bool = False
    proves: bool = False
    warm_start: bool = False
    anytime: bool = False
    options: tuple[str, ...] = ()
    citation: str = ""

    @property
    def missing(self) -> tuple[str, ...]:
        """Modules in `requires` that are not installed."""
        return tuple(name for name in self.requires if find_spec(name) is None)
