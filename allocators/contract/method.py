"""Descriptions of methods, available before they are loaded."""

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
    """Name, requirements and capabilities of a method.

    Attributes
    ----------
    name : str
        As in ``--method``; lower-case letters, digits and hyphens.
    summary : str
        One-line description.
    kind : Kind
    requires : tuple of str
        Modules that must be installed.
    objectives : tuple of Objective
        Objectives that it supports; `solve` refuses it for any other.
    finite_speeds : bool
        Whether it supports travel times; if not, `solve` refuses it for instances with finite speeds.
    makespan_slack : bool
        Whether it uses the makespan slack of `MakespanTolerance` to reduce the energy; if not, `solve` refuses runs
        with slack or a makespan limit.
    proves : bool
        Whether it proves bounds of its own.
    warm_start : bool
        Whether it makes use of a start allocation.
    anytime : bool
        Whether a larger budget gives better answers.
    options : tuple of str
        Options of its constructor.
    citation : str
        Source of the method.
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
