"""Parameters of a training run, and their description, which identifies a checkpoint."""

import hashlib
from dataclasses import asdict, dataclass, field, fields, replace

from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, GappoParameters, Hyperparameters
from alloc.allocators.learned.network.actor_critic import NetworkSize
from alloc.allocators.learned.training.curriculum import Curriculum
from alloc.allocators.learned.training.validation import VALIDATION
from alloc.problems import InputError, Instance
from alloc.problems.arguments import whole
from alloc.problems.game import FEATURE_SET, PLANNING, Rules


@dataclass(frozen=True)
class TrainingParameters:
    """Parameters of a training run; together with the seed, they determine the learning curve.

    Attributes
    ----------
    method : str
        One of `registry.METHODS`.
    population : int
        Number of members that learn; several are bred between generations.
    decisions : int
        Decisions of agents per generation and member.
    network : NetworkSize
    learner : Hyperparameters or None
        Hyperparameters of the method; None for its defaults.
    breeding : BreedingParameters
    curriculum : Curriculum
    rules : Rules

    Raises
    ------
    InputError
        If the population is larger than one, but the method cannot be bred.
    """

    method: str = "gappo"
    population: int = 4
    decisions: int = 20_000
    network: NetworkSize = field(default_factory=NetworkSize)
    learner: Hyperparameters | None = field(default_factory=GappoParameters)
    breeding: BreedingParameters = field(default_factory=BreedingParameters)
    curriculum: Curriculum = field(default_factory=Curriculum)
    rules: Rules = PLANNING

    def __post_init__(self) -> None:
        if whole(self.population, "population", 1) > 1 and self.method == "ddpg":
            raise InputError("breeding crosses single networks, ddpg has an actor and a critic; use 1", "population")


def described(parameters: TrainingParameters, seed: int) -> dict[str, str]:
    """Return everything that determines the learning curve, as a flat mapping of text."""
    instances = parameters.curriculum.instances
    plain = replace(parameters, curriculum=replace(parameters.curriculum, instances=()))
    text = {"seed": str(seed), "features": FEATURE_SET, "validation": VALIDATION, **_flat("", asdict(plain))}
    text["instances"] = ", ".join(_digest(one.instance) for one in instances) or "none"
    return text


def _flat(prefix: str, values: dict[str, object]) -> dict[str, str]:
    flat = {}
    for name, value in values.items():
        if isinstance(value, dict):
            flat.update(_flat(f"{prefix}{name}.", value))
        else:
            flat[prefix + name] = ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)
    return flat


def _digest(instance: Instance) -> str:
    """Return the name of an instance and a hash of its content."""
    digest = hashlib.sha256()
    for column in fields(instance):
        value = getattr(instance, column.name)
        digest.update(value.tobytes() if hasattr(value, "tobytes") else repr(value).encode())
    return f"{instance.name} ({digest.hexdigest()[:8]})"
