"""Creation of a trainer from the options of a training run."""

from collections.abc import Sequence
from pathlib import Path

from alloc.allocators.learned.algorithms.hyperparameters import Hyperparameters
from alloc.allocators.learned.files.policy_file import load_policy
from alloc.allocators.learned.network.actor_critic import NetworkSize
from alloc.allocators.learned.training.curriculum import Curriculum
from alloc.allocators.learned.training.parameters import TrainingParameters
from alloc.allocators.learned.training.trainer import Trainer
from alloc.allocators.learned.training.validation import games_on
from alloc.problems import Instance
from alloc.problems.arguments import choice, whole
from alloc.problems.game import Board, Reward, Rules, TurnRule


def new_trainer(
    method: str,
    learner: Hyperparameters,
    population: int,
    decisions: int,
    families: Sequence[str],
    *,
    turn: str,
    reward: str,
    seed: int,
    instances: Sequence[Instance] | None = None,
    init: Path | str | None = None,
) -> Trainer:
    """Return the trainer of a new run; see `train` for the parameters.

    The networks have the same size as those of `init`, if it is given.
    """
    initial = [] if init is None else load_policy(init, None)
    curriculum = Curriculum(tuple(families))
    boards: list[Board] | None = None
    if instances is not None:
        curriculum, boards = games_on(instances, curriculum)
    parameters = TrainingParameters(
        method=method,
        population=population,
        decisions=whole(decisions, "decisions", 1),
        network=initial[0].size if initial else NetworkSize(),
        learner=learner,
        curriculum=curriculum,
        rules=Rules(choice(TurnRule, turn, "turn"), choice(Reward, reward, "reward")),
    )
    return Trainer(parameters, seed, boards, [network.state_dict() for network in initial])
