"""Methods by name, and their hyperparameters as text."""

import pytest

from alloc.allocators.learned.methods import method_parameters, new_learner
from alloc.allocators.learned.network import NetworkSize
from alloc.allocators.learned.ppo import Ppo, PpoParameters
from alloc.problems import InputError


def test_learners_by_name() -> None:
    """A name gives a learner of this size."""
    learner = new_learner("ppo", NetworkSize(8, 8, 2), PpoParameters(), 0)
    assert isinstance(learner, Ppo)
    assert learner.policy.size == NetworkSize(8, 8, 2)


def test_settings_are_read_as_the_kind_of_their_defaults() -> None:
    """Whole numbers, broken ones and none are told apart."""
    read = method_parameters("ppo", {"epochs": "5", "clip": "0.1", "kl_target": "none"})
    assert read == PpoParameters(epochs=5, clip=0.1, kl_target=None)


@pytest.mark.parametrize(
    ("method", "settings", "message"),
    [
        ("gapo", {}, "did you mean 'gappo'"),
        ("ppo", {"clipp": "1"}, "did you mean 'clip'"),
        ("ppo", {"epochs": "1.5"}, "epochs must be like 3, got '1.5'"),
    ],
)
def test_mistakes_are_named(method: str, settings: dict[str, str], message: str) -> None:
    """Unknown methods, unknown parameters and unreadable values are told."""
    with pytest.raises(InputError, match=message):
        method_parameters(method, settings)
