"""Parameters of a general family of random instances."""

from dataclasses import dataclass

from alloc.problems.arguments import choice, flag, real, whole
from alloc.problems.errors import InputError
from alloc.problems.vocabulary import Distribution, Sites, Starts

LARGEST = 1e12
"""Largest value of a parameter."""

MAX_SIZE = 10_000_000
"""Maximum number of agents, and of tasks, of a generated instance."""

Spread = float | tuple[float, float] | None
"""A single value, the ends of a uniform distribution, or None for no limit."""


@dataclass(frozen=True, kw_only=True)
class Family:
    """Parameters of random instances.

    Parameters
    ----------
    agents, tasks : int
        Numbers of agents and tasks.
    ability : Distribution or str
        ``equal``: all `ability_max`; ``uniform`` from `ability_min` to `ability_max`; ``lognormal``: 95 % of the agents
        between the two; ``pareto``: at least `ability_min`, shape 1.5, mean three times that, no upper end.
    ability_min, ability_max : float
        Work per hour, > 0.
    workload : Distribution or str
        Shares of the total: ``equal``, ``uniform`` (from a tenth to one, before scaling), ``dirichlet`` (with all
        parameters 2), ``lognormal`` (sigma 1) or ``pareto`` (shape 1.5).
    load : float
        Total workload divided by total ability, > 0; with `integer`, rounded, with workloads of at least 1.
    integer : bool
        Whether abilities and workloads are whole numbers.
    sites : Sites or str
        ``uniform`` in the world, or ``clustered`` around `clusters` centres (normal, a twentieth of the world).
    clusters : int
    dimensions : int
        2 or 3.
    world_size : float
        Side of the square or cube, in units of distance, > 0.
    starts : Starts or str
        Each agent starts at a random task (``tasks``), at a place of its ``own`` distributed like the sites, at one of
        `depots` random ``depots``, or at an unknown place (``unknown``).
    depots : int
    communication_range, battery, speed : float, (float, float) or None
        In units of distance, energy, and distance per hour; None for no limit.
    priority : float or (float, float)
    allowed_fraction : float
        Share of the tasks that each agent may do, > 0; each gets a random subset of this size, at least one task.
    energy_per_distance, tau : float
        As in `Instance`.

    Raises
    ------
    InputError
        If a value is out of its range; `place` names the field.
    """

    agents: int = 100
    tasks: int = 20
    ability: Distribution | str = Distribution.UNIFORM
    ability_min: float = 1.0
    ability_max: float = 10.0
    workload: Distribution | str = Distribution.DIRICHLET
    load: float = 1.0
    integer: bool = True
    sites: Sites | str = Sites.UNIFORM
    clusters: int = 4
    dimensions: int = 3
    world_size: float = 1.0
    starts: Starts | str = Starts.TASKS
    depots: int = 1
    communication_range: Spread = None
    battery: Spread = 20.0
    speed: Spread = None
    priority: float | tuple[float, float] = 1.0
    allowed_fraction: float = 1.0
    energy_per_distance: float = 6.0
    tau: float = 0.5

    def __post_init__(self) -> None:
        for name in ("agents", "tasks", "clusters", "depots"):
            self._set(name, whole(getattr(self, name), name, 1, MAX_SIZE))
        for name in ("ability_min", "ability_max", "load", "world_size", "allowed_fraction"):
            self._set(name, real(getattr(self, name), name, 0, LARGEST, above=True))
        if self.ability_max < self.ability_min:
            raise InputError(
                f"must be at least ability_min = {self.ability_min:g}, got {self.ability_max:g}", "ability_max"
            )
        if self.allowed_fraction > 1:
            raise InputError(f"must be > 0 and at most 1, got {self.allowed_fraction:g}", "allowed_fraction")
        self._set("dimensions", whole(self.dimensions, "dimensions", 2, 3))
        self._set("integer", flag(self.integer, "integer"))
        real(self.energy_per_distance, "energy_per_distance")
        real(self.tau, "tau")
        for name in ("communication_range", "battery", "speed", "priority"):
            self._set(name, _spread(getattr(self, name), name))
        choices = {"ability": Distribution, "workload": Distribution, "sites": Sites, "starts": Starts}
        for name, kind in choices.items():
            self._set(name, choice(kind, getattr(self, name), name))
        if self.ability is Distribution.DIRICHLET:
            raise InputError("must not be dirichlet, which divides a total and is for workloads only", "ability")

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)


def _spread(spread: Spread, name: str) -> Spread:
    if spread is None and name != "priority":
        return None
    pair = tuple(spread) if isinstance(spread, list | tuple) else None
    ends = (spread, spread) if pair is None else pair
    if len(ends) != 2:
        raise InputError(f"must be a number or the two ends of a range, got {spread!r}", name)
    low, high = (real(end, name, 0, LARGEST, above=name == "speed") for end in ends)
    if low > high:
        raise InputError(f"must be an ascending range, got {low:g} to {high:g}", name)
    return low if pair is None else (low, high)
