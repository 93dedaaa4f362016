"""Hyperparameters out of range are reported when they are set, whatever their source."""

import math
import subprocess
import sys
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from alloc.allocators.learned.algorithms.ddpg import Ddpg
from alloc.allocators.learned.algorithms.hyperparameter_ranges import RANGES
from alloc.allocators.learned.algorithms.hyperparameters import (
    A2cParameters,
    BreedingParameters,
    DdpgParameters,
    DqnParameters,
    GappoParameters,
    PpoParameters,
)
from alloc.allocators.learned.algorithms.learner import TrainingJob
from alloc.allocators.learned.network.actor_critic import NetworkSize
from alloc.allocators.learned.training.curriculum import Curriculum
from alloc.allocators.learned.training.validation import games_on
from alloc.problems import InputError
from alloc.problems.generate import paper_like

KINDS = (A2cParameters, BreedingParameters, DdpgParameters, DqnParameters, GappoParameters, PpoParameters)


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_has_a_range(kind: type[Any]) -> None:
    """All numbers of all methods are checked, and only numbers are accepted."""
    for field in fields(kind):
        if isinstance(field.default, bool):
            continue
        assert field.name in RANGES
        for wrong in (-1, -1e-3, math.nan, math.inf, -math.inf, 1e300, 10**30, "1", True):
            with pytest.raises(InputError, match=f"{field.name}: must be a"):
                kind(**{field.name: wrong})


@pytest.mark.parametrize(
    ("kind", "name", "wrong"),
    [
        (PpoParameters, "update_epochs", 0),
        (PpoParameters, "update_epochs", 1.5),
        (PpoParameters, "update_epochs", None),
        (GappoParameters, "minibatch_size", 0),
        (GappoParameters, "target_kl", 0.0),
        (PpoParameters, "reward_scale", 0.0),
        (PpoParameters, "clip_coef", 0.0),
        (PpoParameters, "gamma", 0.0),
        (PpoParameters, "gamma", 1.01),
        (PpoParameters, "gae_lambda", 1.01),
        (PpoParameters, "learning_rate", 0.0),
        (PpoParameters, "learning_rate", 1.1),
        (A2cParameters, "num_steps", 0),
        (DqnParameters, "temperature", 0.0),
        (DqnParameters, "buffer_size", 0),
        (DdpgParameters, "buffer_size", 0),
        (DdpgParameters, "softmax_temperature", 0.0),
        (DdpgParameters, "tau", 1.01),
        (BreedingParameters, "tournament_size", 0),
        (BreedingParameters, "mutation_probability", 1.01),
    ],
)
def test_values_outside_ranges_are_refused(kind: type[Any], name: str, wrong: Any) -> None:
    """Values that cause a division by zero, no learning or divergence are refused, however they are set."""
    with pytest.raises(InputError, match=f"{name}: must be a"):
        kind(**{name: wrong})
    with pytest.raises(InputError, match=f"{name}: must be a"):
        replace(kind(), **{name: wrong})


def test_values_at_the_ends_of_ranges_are_accepted() -> None:
    """Sensible extreme values and NumPy numbers are accepted."""
    assert PpoParameters(buffer_size=0, gae_lambda=0, gamma=1, learning_rate=1, ent_coef=0.0, target_kl=None)
    assert PpoParameters(update_epochs=np.int64(2), clip_coef=np.float32(0.5))  # type: ignore[arg-type]
    assert BreedingParameters(elite=0, mutation_probability=0, crossover_probability=1, mutation_sigma=0)


def test_entropy_bonus_of_zero_stays_zero() -> None:
    """A bonus with initial value 0 stays 0."""
    curriculum, _ = games_on([paper_like(8, 2, 35, 0)], Curriculum(games=(2, 2)))
    learner = Ddpg(NetworkSize(4, 4, 1), DdpgParameters(ent_coef=0.0))
    assert learner.train_on(TrainingJob(0, 20, curriculum, progress=0.5)).decisions >= 20


def test_torch_is_not_loaded() -> None:
    """Wrong hyperparameters are reported without loading torch."""
    code = (
        "import sys, alloc.allocators.learned.algorithms.registry as registry\n"
        "registry.method_parameters('gappo'); print('torch' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
