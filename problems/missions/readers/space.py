"""Random missions from configuration files of the SPACE simulator."""

import math

import numpy as np

from alloc.problems.errors import InputError, MissingPackageError
from alloc.problems.fields import FloatArray
from alloc.problems.formats.files import named, read_text
from alloc.problems.formats.messages import described, message_line
from alloc.problems.instance import Instance
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Radio
from alloc.problems.units import Units
from alloc.problems.vocabulary import Knowledge

YAML_MISSING = "needs PyYAML; install it with: pip install 'alloc-mrta[tables]'"

STEPS_PER_MESSAGE = 10
"""Steps between two messages; in SPACE agents send one in every step, which changes little and costs much."""


def read_space(path: str, name: str, seed: int) -> Mission:
    """Read a configuration and draw a mission from it: uniform positions and workloads, tasks in waves.

    Acceleration, turning, and the radius within which a task counts as reached are ignored: agents fly at full speed.

    Parameters
    ----------
    path : str
        YAML.
    name : str
    seed : int
        Seed of all random numbers.

    Raises
    ------
    InputError
        If it cannot be read, or a field is missing or invalid.
    MissingPackageError
        If PyYAML is not installed.
    """
    config = _Config(_parsed(path), named(path))
    rng = np.random.default_rng(seed)
    n, frequency = config.whole("agents.quantity", low=1), config.number("simulation.sampling_freq", 1.0, above=True)
    appears = _hours(config)
    low, high = config.number("tasks.amounts.min"), config.number("tasks.amounts.max")
    if high < low:
        raise config.error(f"must be at least {low:g}, the least amount", "tasks.amounts.max")
    instance = Instance(
        name=name,
        ability=np.full(n, config.number("agents.work_rate", above=True) * frequency),
        agent_position=_places(config, "agents", n, rng),
        speed=np.full(n, config.number("agents.max_speed", above=True)),
        workload=rng.uniform(low, high, len(appears)),
        task_position=_places(config, "tasks", len(appears), rng),
        units=Units(time="s"),
    )
    horizon = config.number("simulation.max_simulation_time", 0.0)
    radius, sensing = (
        config.number(f"agents.{field}", 0.0) or np.inf
        for field in ("communication_radius", "situation_awareness_radius")
    )
    return Mission(
        instance,
        appears=appears,
        horizon=horizon or np.inf,
        knowledge=Knowledge.LOCAL,
        sensing=sensing,
        radio=Radio(radius=radius, period=STEPS_PER_MESSAGE / frequency),
        seed=seed,
    )


def _parsed(path: str) -> object:
    try:
        import yaml
    except ModuleNotFoundError as error:
        raise MissingPackageError(YAML_MISSING, source=named(path)) from error
    try:
        value: object = yaml.safe_load(read_text(path))
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = "" if mark is None else f"line {mark.line + 1}"
        message = message_line(f"is not YAML: {getattr(error, 'problem', None) or 'it cannot be read'}")
        raise InputError(message, place, named(path)) from error
    return value


def _hours(config: "_Config") -> FloatArray:
    """Return the hour at which each task appears: initial ones, then those of each later generation."""
    first = config.whole("tasks.quantity", low=0)
    place = "tasks.dynamic_task_generation"
    waves = each = 0
    interval = 0.0
    if config.flag(f"{place}.enabled"):
        waves, each = config.whole(f"{place}.max_generations"), config.whole(f"{place}.tasks_per_generation")
        interval = config.number(f"{place}.interval_seconds")
    if first + waves * each == 0:
        raise config.error("must be at least 1 where no tasks are generated later", "tasks.quantity")
    return np.concatenate([np.zeros(first), np.repeat(interval * np.arange(1, waves + 1), each)])


def _places(config: "_Config", kind: str, count: int, rng: np.random.Generator) -> FloatArray:
    ends = [[config.number(f"{kind}.locations.{axis}_{end}", low=-math.inf) for end in ("min", "max")] for axis in "xy"]
    for axis, (low, high) in zip("xy", ends, strict=True):
        if high < low:
            raise config.error(f"must be at least {low:g}, the least {axis}", f"{kind}.locations.{axis}_max")
    low, high = np.array(ends).T
    return rng.uniform(low, high, (count, 2))


class _Config:
    """The fields of a configuration by their paths, such as ``agents.quantity``."""

    def __init__(self, document: object, source: str) -> None:
        self._document, self._source = document, source

    def error(self, message: str, place: str) -> InputError:
        """Return an error about a field."""
        return InputError(message, place, self._source)

    def number(self, place: str, default: float | None = None, low: float = 0.0, *, above: bool = False) -> float:
        """Return a finite number >= `low`, or > `low` if `above`."""
        value = self._value(place)
        value = default if value is None else value
        number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
        if low <= number < math.inf and (number > low or not above):
            return number
        least = "" if low == -math.inf else f" {'>' if above else '>='} {low:g}"
        problem = "is missing; it" if value is None else f"is {described(value)}, but"
        raise self.error(f"{problem} must be a number{least}", place)

    def whole(self, place: str, low: int = 0) -> int:
        """Return a whole number."""
        value = self._value(place)
        if isinstance(value, int) and not isinstance(value, bool) and value >= low:
            return value
        problem = "is missing; it" if value is None else f"is {described(value)}, but"
        raise self.error(f"{problem} must be a whole number >= {low}", place)

    def flag(self, place: str) -> bool:
        """Return a flag, False if it is missing."""
        return self._value(place) is True

    def _value(self, place: str) -> object:
        value = self._document
        for name in place.split("."):
            value = value.get(name) if isinstance(value, dict) else None
        return value
