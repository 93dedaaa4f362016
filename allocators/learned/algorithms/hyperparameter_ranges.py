"""Allowed ranges of hyperparameters, checked when they are set; does not import torch."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import TYPE_CHECKING, cast

from alloc.problems import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True)
class Range:
    """Finite numbers from `low` to `high`.

    Attributes
    ----------
    low, high : float
    above : bool
        Whether `low` itself is excluded.
    whole : bool
        Whether only integers are allowed.
    optional : bool
        Whether None is allowed as well.
    """

    low: float
    high: float
    above: bool = False
    whole: bool = False
    optional: bool = False

    def __contains__(self, value: object) -> bool:
        if value is None:
            return self.optional
        if isinstance(value, bool) or not isinstance(value, Integral if self.whole else Real):
            return False
        number = cast("float", value)  # numpy's numbers can be compared as well
        return bool((self.low < number if self.above else self.low <= number) and number <= self.high)

    def __str__(self) -> str:
        kind = "a whole number" if self.whole else "a number"
        ends = f"above {self.low:g} and at most {self.high:g}" if self.above else f"from {self.low:g} to {self.high:g}"
        return f"{kind} {ends}{' or none' if self.optional else ''}"


MAX_VALUE = 1e9
"""Upper limit of all hyperparameters; its square is far below the overflow of 32-bit floats."""

COUNT = Range(1, 1_000_000, whole=True)
SHARE = Range(0, 1)
RATE = Range(0, 1, above=True)
POSITIVE = Range(1 / MAX_VALUE, MAX_VALUE)
WEIGHT = Range(0, MAX_VALUE)

RANGES: Mapping[str, Range] = {
    **dict.fromkeys(
        ("update_epochs", "minibatch_size", "batch_size", "num_steps", "target_update_interval", "tournament_size"),
        COUNT,
    ),
    **dict.fromkeys(("replay_draws", "genes"), COUNT),
    **dict.fromkeys(("final_lr_fraction", "actor_lr_fraction", "tau", "mutated_fraction"), SHARE),
    **dict.fromkeys(("gae_lambda", "exploration_initial_eps", "crossover_probability", "mutation_probability"), SHARE),
    **dict.fromkeys(("learning_rate", "max_learning_rate", "gamma"), RATE),
    **dict.fromkeys(("clip_coef", "reward_scale", "max_grad_norm"), POSITIVE),
    **dict.fromkeys(("temperature", "final_temperature", "softmax_temperature"), POSITIVE),
    **dict.fromkeys(("ent_coef", "final_ent_coef", "vf_coef"), WEIGHT),
    **dict.fromkeys(
        ("return_weight", "entropy_weight", "cost_weight", "mutation_sigma", "gene_sigma", "replay_ratio"), WEIGHT
    ),
    **dict.fromkeys(("buffer_size", "elite", "breeding_interval"), Range(0, MAX_VALUE, whole=True)),
    "target_kl": Range(1 / MAX_VALUE, MAX_VALUE, optional=True),
}
"""Range of each hyperparameter by name, for all methods."""


def check_ranges(parameters: "DataclassInstance", **others: Range) -> None:
    """Raise an `InputError` for the first field that is out of its range in `others`, or else in `RANGES`."""
    for field in fields(parameters):
        allowed, value = others.get(field.name) or RANGES.get(field.name), getattr(parameters, field.name)
        if allowed is not None and value not in allowed:
            shown = f"{value:g}" if isinstance(value, float) else repr(value)
            raise InputError(f"must be {allowed}, got {shown}", field.name)
