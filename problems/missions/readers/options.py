"""Options for the import of records."""

from dataclasses import dataclass
from datetime import date

from alloc.problems.arguments import of_type, real, whole
from alloc.problems.errors import InputError


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """Options for the import of records of calls or fires: the fleet, the period of time, and its compression.

    Attributes
    ----------
    agents : int or None
        Number of agents; None for 10, or for all vehicles in the file of the fleet.
    ability : float
        Work per hour of each agent, > 0.
    speed : float or None
        In km per hour, > 0; None for the default of the format.
    compress : float
        Divisor of the hours between records, > 0: real records are so sparse that agents would mostly wait.
    first, last : date or None
        First and last day of the records to import, both included.
    fleet : str or None
        File with the list of vehicles, for ``london``.

    Raises
    ------
    InputError
        If a value is out of range; the error's ``place`` is the field.
    """

    agents: int | None = None
    ability: float = 1.0
    speed: float | None = None
    compress: float = 1.0
    first: date | None = None
    last: date | None = None
    fleet: str | None = None

    def __post_init__(self) -> None:
        if self.agents is not None:
            whole(self.agents, "agents", 1)
        real(self.ability, "ability", above=True)
        real(self.compress, "compress", above=True)
        if self.speed is not None:
            real(self.speed, "speed", above=True)
        for name in ("first", "last"):
            if getattr(self, name) is not None:
                of_type(getattr(self, name), date, name)
        if self.first is not None and self.last is not None and self.last < self.first:
            raise InputError(f"must not be before {self.first}, got {self.last}", "last")
