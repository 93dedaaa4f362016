"""What hyperparameters may be, so that nonsense is told when it is set; knows nothing of torch."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any

from alloc.problems import InputError


@dataclass(frozen=True)
class Range:
    """Finite numbers from `low` to `high`.

    Attributes
    ----------
    low, high : float
    above : bool
        Whether `low` itself is out.
    whole : bool
    optional : bool
        Whether None will do as well.
    """

    low: float
    high: float
    above: bool = False
    whole: bool = False
    optional: bool = False

    def __contains__(self, value: Any) -> bool:
        if value is None:
            return self.optional
        kind: type[Any] = Integral if self.whole else Real
        if isinstance(value, bool) or not isinstance(value, kind):
            return False
        return bool((self.low < value if self.above else self.low <= value) and value <= self.high)

    def __str__(self) -> str:
        kind = "a whole number" if self.whole else "a number"
        ends = f"above {self.low:g} and at most {self.high:g}" if self.above else f"from {self.low:g} to {self.high:g}"
        return f"{kind} {ends}{' or none' if self.optional else ''}"


MOST = 1e9
"""What no hyperparameter need exceed; squares of it are still far from where 32 bits end."""

COUNT = Range(1, 1_000_000, whole=True)
SHARE = Range(0, 1)
RATE = Range(0, 1, above=True)
POSITIVE = Range(1 / MOST, MOST)
WEIGHT = Range(0, MOST)

RANGES: Mapping[str, Range] = {
    **dict.fromkeys(("epochs", "minibatch", "steps", "target_period", "tournament"), COUNT),
    **dict.fromkeys(("final_share", "actor_share", "target_share", "mutated_share"), SHARE),
    **dict.fromkeys(("smoothing", "exploring", "crossover_probability", "mutation_probability"), SHARE),
    **dict.fromkeys(("learning_rate", "highest_rate", "discount"), RATE),
    **dict.fromkeys(("clip", "reward_scale", "max_gradient_norm"), POSITIVE),
    **dict.fromkeys(("temperature", "final_temperature", "softness"), POSITIVE),
    **dict.fromkeys(("entropy_weight", "final_entropy_weight", "value_weight"), WEIGHT),
    **dict.fromkeys(("return_weight", "cost_weight", "mutation_size", "reuse"), WEIGHT),
    **dict.fromkeys(("capacity", "elite"), Range(0, MOST, whole=True)),
    "kl_target": Range(1 / MOST, MOST, optional=True),
}
"""What each may be, whatever the method."""


def check_ranges(parameters: Any, **others: Range) -> None:
    """Raise an `InputError` for the first field out of its range: that in `others`, else that in `RANGES`."""
    for field in fields(parameters):
        allowed, value = others.get(field.name) or RANGES.get(field.name), getattr(parameters, field.name)
        if allowed is not None and value not in allowed:
            shown = f"{value:g}" if isinstance(value, float) else repr(value)
            raise InputError(f"must be {allowed}, got {shown}", field.name)
