"""Learning on, on the instance at hand: games on its parts, PPO, and a generation now and then."""

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
from alloc.problems.game.parts import Parts

GENERATION = 4
"""Lessons of each member between two generations."""

BREEDING = BreedingParameters(mutation_sigma=0.002)


@dataclass(frozen=True)
class FineTuningParameters:
    """How a policy learns on.

    Attributes
    ----------
    after_s : float
        Seconds of play before any learning: short runs are better spent on playing.
    share : float
        Share of the time thereafter that is spent on learning.
    games, pairs : int
        Games of an update, at the most; and pairs of agent and candidate, so that no update takes long.
    rounds : int
        Most rounds of a game.
    price : (float, float)
        Least and most weight of energy.
    ppo : PpoParameters
    """

    after_s: float = 3.0
    share: float = 0.3
    games: int = 64
    pairs: int = 12_000
    rounds: int = 15
    price: tuple[float, float] = (0.4, 2.4)
    ppo: PpoParameters = field(
        default_factory=lambda: PpoParameters(learning_rate=1e-4, max_learning_rate=3e-4, update_epochs=2)
    )


@dataclass(frozen=True, eq=False)
class _PartGames:
    """A curriculum of games on the parts of a plan; see `Curriculum`."""

    parts: Parts
    parameters: FineTuningParameters

    def draw(self, rng: np.random.Generator, progress: float) -> Board:
        """Draw a board on which everybody begins at the nearest task, or where the plan has them."""
        board = self.parts.board
        games = max(1, min(self.parameters.games, self.parameters.pairs // (board.shape[1] * board.shape[2])))
        rows = torch.from_numpy(rng.integers(len(board.price), size=games))
        ruined = rng.uniform(0.2, 1.4, (games, 1))
        back = torch.from_numpy(rng.random((games, board.shape[1])) < ruined)
        low, high = np.log(self.parameters.price)
        price = torch.from_numpy(np.exp(rng.uniform(low, high, games)).astype(np.float32))
        return replace(board[rows], price=price, start=torch.where(back, self.parts.home[rows], board.start[rows]))

    def max_steps(self, board: Board) -> int:
        """Most rounds."""
        return self.parameters.rounds


class FineTuning:
    """The population at work on one instance, members in turn; after some lessons of each comes a generation.

    Parameters
    ----------
    search : Search
    networks : sequence of ActorCritic
        As shipped; they are left as they are.
    parameters : FineTuningParameters, optional
    """

    def __init__(
        self, search: Search, networks: Sequence[ActorCritic], parameters: FineTuningParameters | None = None
    ) -> None:
        self.search, self.shipped = search, networks
        self.parameters = parameters or FineTuningParameters()
        self.members: list[Ppo] = []
        self.spent_s = 0.0
        self.lessons = 0
        self._reports: list[TrainingStats] = []

    def is_due(self) -> bool:
        """Whether it is time to learn; runs without a time limit never learn on, so that they repeat."""
        since = self.search.elapsed_s - self.parameters.after_s
        limit = self.search.budget.time_limit_s
        return limit is not None and since > 0 and self.spent_s < self.parameters.share * since

    def learn(self, parts: Parts) -> Sequence[ActorCritic]:
        """Have the next member take a lesson on these parts; return the networks as they are now."""
        begin = time.monotonic()
        if not self.members:
            self.members = [_learner(network, self.parameters.ppo) for network in self.shipped]
        games = _PartGames(parts, self.parameters)
        job = TrainingJob(seed=(self.search.seed + self.lessons) % 2**63, decisions=1, curriculum=games)
        self._reports.append(self.members[self.lessons % len(self.members)].train_on(job))
        self.lessons += 1
        if self.lessons % (GENERATION * len(self.members)) == 0:
            self._breed()
        self.spent_s += time.monotonic() - begin
        return [member.policy for member in self.members]

    def _breed(self) -> None:
        """Replace the less fit, judged by the reward of their last lessons (12)."""
        count = len(self.members)
        latest = [self._reports[number::count][-GENERATION:] for number in range(count)]
        self._reports = []
        scores = fitness(
            [float(np.mean([report.reward for report in reports])) for reports in latest],
            [float(np.mean([report.entropy for report in reports])) for reports in latest],
            [sum(report.evaluations for report in reports) for reports in latest],
            BREEDING,
        )
        members = [copy.deepcopy(member.state_dict()) for member in self.members]  # loading one changes what it shares
        for member, state in zip(self.members, breed(members, scores, BREEDING, self.lessons), strict=True):
            member.load_state_dict(copy.deepcopy(state))


def _learner(network: ActorCritic, parameters: PpoParameters) -> Ppo:
    learner = Ppo(network.size, parameters)
    learner.network.load_state_dict(network.state_dict())
    return learner
