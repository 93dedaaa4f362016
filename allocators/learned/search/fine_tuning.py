"""Fine-tuning of policies on the instance to be solved: PPO on games on its regions, and breeding."""

import copy
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch

from alloc.allocators.contract.search import Search
from alloc.allocators.learned.algorithms.gappo import breed, fitness
from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, PpoParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob, TrainingStats
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.problems.game import Board
from alloc.problems.game.regions import Regions

GENERATION = 4
"""Updates of each member between two generations."""

BREEDING = BreedingParameters(mutation_sigma=0.002)


@dataclass(frozen=True)
class FineTuningParameters:
    """Parameters of fine-tuning.

    Attributes
    ----------
    after_s : float
        Seconds of playing before learning begins, as short runs are better spent on playing.
    share : float
        Share of the subsequent time that is spent on learning.
    games, pairs : int
        Maximum number of games in an update, and of pairs of agent and candidate in them.
    rounds : int
        Maximum number of rounds of a game.
    energy_weight : (float, float)
        Minimum and maximum weight of energy.
    ppo : PpoParameters
    """

    after_s: float = 3.0
    share: float = 0.3
    games: int = 64
    pairs: int = 12_000
    rounds: int = 15
    energy_weight: tuple[float, float] = (0.4, 2.4)
    ppo: PpoParameters = field(
        default_factory=lambda: PpoParameters(learning_rate=1e-4, max_learning_rate=3e-4, update_epochs=2)
    )


@dataclass(frozen=True, eq=False)
class _RegionGames:
    """A curriculum of games on the regions of a plan, in place of `Curriculum`."""

    regions: Regions
    parameters: FineTuningParameters

    def draw(self, rng: np.random.Generator, progress: float) -> Board:
        """Draw a board on which each agent starts at the nearest task or at its task in the plan."""
        board = self.regions.board
        games = max(1, min(self.parameters.games, self.parameters.pairs // (board.shape[1] * board.shape[2])))
        rows = torch.from_numpy(rng.integers(len(board.energy_weight), size=games))
        moved_share = rng.uniform(0.2, 1.4, (games, 1))
        at_nearest = torch.from_numpy(rng.random((games, board.shape[1])) < moved_share)
        low, high = np.log(self.parameters.energy_weight)
        energy_weight = torch.from_numpy(np.exp(rng.uniform(low, high, games)).astype(np.float32))
        return replace(
            board[rows],
            energy_weight=energy_weight,
            start=torch.where(at_nearest, self.regions.nearest[rows], board.start[rows]),
        )

    def max_steps(self, board: Board) -> int:
        """Return the maximum number of rounds."""
        return self.parameters.rounds


class FineTuning:
    """Fine-tuning of a population on one instance, whose members learn in turn and are bred periodically.

    Parameters
    ----------
    search : Search
    networks : sequence of ActorCritic
        The shipped networks, which are not changed.
    parameters : FineTuningParameters, optional
    """

    def __init__(
        self, search: Search, networks: Sequence[ActorCritic], parameters: FineTuningParameters | None = None
    ) -> None:
        self.search, self.shipped = search, networks
        self.parameters = parameters or FineTuningParameters()
        self.members: list[Ppo] = []
        self.spent_s = 0.0
        self.jobs = 0
        self._stats: list[TrainingStats] = []

    def is_due(self) -> bool:
        """Return whether it is time to learn; runs without a time limit never learn, so that they are reproducible."""
        since = self.search.elapsed_s - self.parameters.after_s
        limit = self.search.budget.time_limit_s
        return limit is not None and since > 0 and self.spent_s < self.parameters.share * since

    def learn(self, regions: Regions) -> Sequence[ActorCritic]:
        """Train the next member on these regions; return the current networks."""
        begin = time.monotonic()
        if not self.members:
            self.members = [_learner(network, self.parameters.ppo) for network in self.shipped]
        games = _RegionGames(regions, self.parameters)
        job = TrainingJob(seed=(self.search.seed + self.jobs) % 2**63, decisions=1, curriculum=games)
        self._stats.append(self.members[self.jobs % len(self.members)].train_on(job))
        self.jobs += 1
        if self.jobs % (GENERATION * len(self.members)) == 0:
            self._breed()
        self.spent_s += time.monotonic() - begin
        return [member.policy for member in self.members]

    def _breed(self) -> None:
        """Breed the next generation; the fitness (12) is that in the last updates."""
        count = len(self.members)
        latest = [self._stats[number::count][-GENERATION:] for number in range(count)]
        self._stats = []
        scores = fitness(
            [float(np.mean([stats.reward for stats in member])) for member in latest],
            [float(np.mean([stats.entropy for stats in member])) for member in latest],
            [sum(stats.evaluations for stats in member) for member in latest],
            BREEDING,
        )
        members = [copy.deepcopy(member.state_dict()) for member in self.members]  # loading changes shared tensors
        for member, state in zip(self.members, breed(members, scores, BREEDING, self.jobs), strict=True):
            member.load_state_dict(copy.deepcopy(state))


def _learner(network: ActorCritic, parameters: PpoParameters) -> Ppo:
    learner = Ppo(network.size, parameters)
    learner.network.load_state_dict(network.state_dict())
    return learner
