"""Parameters of a training run."""

from dataclasses import dataclass, field

from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, GappoParameters, Hyperparameters
from alloc.allocators.learned.network.actor_critic import NetworkSize
from alloc.allocators.learned.training.curriculum import Curriculum
from alloc.problems import InputError
from alloc.problems.arguments import whole
from alloc.problems.game import PLANNING, Rules


@dataclass(frozen=True)
class TrainingParameters:
    """Parameters of a training run; together with the seed they decide the whole learning curve.

    Attributes
    ----------
    method : str
        One of `registry.METHODS`.
    population : int
        Members that learn; several are bred between generations.
    decisions : int
        Decisions of agents in a generation, for each member.
    network : NetworkSize
    learner : Hyperparameters or None
        Hyperparameters of the method; None for its defaults.
    breeding : BreedingParameters
    curriculum : Curriculum
    rules : Rules

    Raises
    ------
    InputError
        If a population of more than one is asked of a method that cannot be bred.
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
