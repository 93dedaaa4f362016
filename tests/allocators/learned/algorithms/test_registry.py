"""Methods by name, and their hyperparameters as text."""

from dataclasses import fields

import pytest

from alloc.allocators.learned.algorithms.hyperparameters import PpoParameters
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.allocators.learned.algorithms.registry import METHODS, method_parameters, new_learner
from alloc.allocators.learned.network.actor_critic import NetworkSize
from alloc.problems import InputError


def test_learners_are_made_by_name() -> None:
    """A name gives a learner of the given size."""
    learner = new_learner("ppo", NetworkSize(8, 8, 2), PpoParameters(), 0)
    assert isinstance(learner, Ppo)
    assert learner.policy.size == NetworkSize(8, 8, 2)


def test_settings_are_parsed_by_the_type_of_their_defaults() -> None:
    """Integers, decimals and none are distinguished."""
    read = method_parameters("ppo", {"update_epochs": "5", "clip_coef": "0.1", "target_kl": "none"})
    assert read == PpoParameters(update_epochs=5, clip_coef=0.1, target_kl=None)


@pytest.mark.parametrize(
    ("method", "settings", "message"),
    [
        ("gapo", {}, "did you mean 'gappo'"),
        ("ppo", {"clip_coeff": "1"}, "ppo has no parameter 'clip_coeff'"),
        ("ppo", {"update_epochs": "1.5"}, "update_epochs must be like 3, got '1.5'"),
        ("ppo", {"update_epochs": "none"}, "update_epochs must be like 3, got 'none'"),
        ("dqn", {"double_q": "maybe"}, "double_q must be like true, got 'maybe'"),
        ("ppo", {"learning_rate": "-1"}, "learning_rate must be a number above 0 and at most 1, got -1$"),
        ("ppo", {"reward_scale": "0"}, "reward_scale must be a number from 1e-09 to 1e[+]09, got 0$"),
        ("ppo", {"clip_coef": "nan"}, "clip_coef must be a number from 1e-09 to 1e[+]09, got nan$"),
        ("ppo", {"update_epochs": "0"}, "update_epochs must be a whole number from 1 to 1e[+]06, got 0$"),
    ],
)
def test_wrong_settings_are_reported(method: str, settings: dict[str, str], message: str) -> None:
    """Unknown methods and parameters, unreadable values, and values out of range are reported."""
    with pytest.raises(InputError, match=message):
        method_parameters(method, settings)


@pytest.mark.parametrize("method", METHODS)
def test_unknown_parameter_error_lists_all_parameters(method: str) -> None:
    """All names and defaults of the method are listed in the form in which they are set."""
    with pytest.raises(InputError) as caught:
        method_parameters(method, {"unknown": "1"})
    listed = caught.value.message.rpartition(": ")[2].split(", ")
    assert method_parameters(method, dict(entry.split("=") for entry in listed)) == method_parameters(method)
    assert len(listed) == len(fields(method_parameters(method)))
