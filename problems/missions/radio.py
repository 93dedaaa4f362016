"""Parameters of a mission's radio and pace: who hears whom, and how fast groups work."""

import math
from dataclasses import dataclass

from alloc.problems.arguments import of_type, real
from alloc.problems.errors import InputError


@dataclass(frozen=True)
class Burst:
    """Burst losses: each link alternates between a good and a bad state (Gilbert-Elliott model).

    Attributes
    ----------
    good, bad : float
        Mean hours that a link stays in the good and the bad state, > 0.
    loss_good, loss_bad : float
        Loss probability of a message in each state, from 0 to 1.

    References
    ----------
    Gilbert (1960), doi:10.1002/j.1538-7305.1960.tb03959.x; Elliott (1963), doi:10.1002/j.1538-7305.1963.tb00955.x.
    """

    good: float
    bad: float
    loss_good: float = 0.0
    loss_bad: float = 1.0

    def __post_init__(self) -> None:
        for name in ("good", "bad"):
            object.__setattr__(self, name, float(real(getattr(self, name), f"radio.burst.{name}", above=True)))
        for name in ("loss_good", "loss_bad"):
            object.__setattr__(self, name, float(real(getattr(self, name), f"radio.burst.{name}", 0, 1)))

    @property
    def share_bad(self) -> float:
        """Share of the time in which a link is bad."""
        return self.bad / (self.good + self.bad)

    def probability_bad(self, was_bad: bool, hours: float) -> float:
        """Return the probability that a link is bad `hours` after it was bad or good."""
        forgotten = -math.expm1(-hours * (1 / self.good + 1 / self.bad))
        return self.share_bad + (was_bad - self.share_bad) * (1 - forgotten)


@dataclass(frozen=True)
class Radio:
    """Parameters of the radio.

    Attributes
    ----------
    radius : float
        Distance up to which a message is heard, by the places when it is sent; ``inf`` for no limit.
    period : float
        Hours between the messages of an agent, > 0; it senses its surroundings as often.
    loss : float
        Probability that a message is lost, independently of others, from 0 to 1.
    delay : float
        Hours from sending to receiving a message.
    burst : Burst or None
        Additional burst losses.
    """

    radius: float = math.inf
    period: float = 0.1
    loss: float = 0.0
    delay: float = 0.0
    burst: Burst | None = None

    def __post_init__(self) -> None:
        if self.radius != math.inf:
            object.__setattr__(self, "radius", float(real(self.radius, "radio.radius")))
        object.__setattr__(self, "period", float(real(self.period, "radio.period", 1e-9, 1e60)))
        object.__setattr__(self, "loss", float(real(self.loss, "radio.loss", 0, 1)))
        object.__setattr__(self, "delay", float(real(self.delay, "radio.delay", 0, 1e60)))
        if self.burst is not None:
            of_type(self.burst, Burst, "radio.burst")


@dataclass(frozen=True)
class Pace:
    """Random factor on the work of groups, drawn for each task and period uniformly from low to high.

    Attributes
    ----------
    low, high : float
        0 <= low <= high and high > 0.
    period : float
        Hours for which a factor applies, > 0.
    """

    low: float = 1.0
    high: float = 1.0
    period: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "low", float(real(self.low, "pace.low", 0, 1e60)))
        object.__setattr__(self, "high", float(real(self.high, "pace.high", 0, 1e60, above=True)))
        object.__setattr__(self, "period", float(real(self.period, "pace.period", 1e-9, 1e60)))
        if self.high < self.low:
            raise InputError(f"must be at least pace.low = {self.low:g}, got {self.high:g}", "pace.high")
