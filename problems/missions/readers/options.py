"""What files of others leave open."""

from dataclasses import dataclass
from datetime import date

from alloc.problems.arguments import of_type, real, whole
from alloc.problems.errors import InputError


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """What records of calls or fires do not say: who answers them, and what part of them is wanted.

    Attributes
    ----------
    agents : int or None
        Number of agents; None for 10, or for those of a list of the fleet.
    ability : float
        Work per hour of each agent, > 0.
    speed : float or None
        In km per hour, > 0; None for that of the format.
    compress : float
        Hours between records are divided by this, > 0: real ones are so sparse that agents would mostly wait.
    first, last : date or None
        Days that are wanted, the last one included.
    fleet : str or None
        List of the vehicles, for ``london``.

    Raises
    ------
    InputError
        If a value is out of its range; its place is the field.
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
