"""Fine-tuning: when it happens, what it learns from, and that shipped networks are not modified."""

from itertools import permutations

import numpy as np
import pytest
import torch

from alloc.allocators import Budget, Search
from alloc.allocators.learned.algorithms.learner import TrainingStats
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.search.fine_tuning import (
    BREEDING,
    GENERATION,
    FineTuning,
    FineTuningParameters,
    _RegionGames,
)
from alloc.allocators.learned.search.planner import Planner, PlannerParameters
from alloc.problems import Objective
from alloc.problems.game.regions import Regions, lay_out_regions
from alloc.problems.generate import paper_like

pytestmark = pytest.mark.timeout(400)  # the first game waits for the compiler, long on a busy machine

FEW = FineTuningParameters(games=8, rounds=4)


@pytest.fixture
def networks() -> list[ActorCritic]:
    torch.manual_seed(0)
    return [ActorCritic(NetworkSize(8, 8, 2)).requires_grad_(False) for _ in range(2)]


@pytest.fixture
def regions() -> Regions:
    instance = paper_like(24, 6, 100, 0)
    tasks = np.array([[0, 1, 2], [3, 4, 5]])
    agents = [np.flatnonzero(np.isin(instance.start_task, some)) for some in tasks]
    plan = instance.start_task // 3 * 3 + (instance.start_task + 1) % 3  # everybody at another task of the same region
    return lay_out_regions(instance, 1.0, plan, tasks, agents)


def search(time_limit_s: float | None = 10.0, iterations: int | None = None, seed: int = 0) -> Search:
    return Search(paper_like(24, 6, 100, 0), Objective.MAKESPAN_ENERGY, Budget(time_limit_s, iterations), seed=seed)


def weights(networks: list[ActorCritic]) -> torch.Tensor:
    return torch.cat([weight.detach().flatten() for network in networks for weight in network.parameters()])


def test_fine_tuning_starts_and_ends_in_its_share_of_time(
    networks: list[ActorCritic], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It starts after three seconds, takes its share of the time, and never runs with iteration limits."""
    clock = [0.0]
    monkeypatch.setattr(Search, "elapsed_s", property(lambda self: clock[0]))
    tuning = FineTuning(search(), networks)
    for elapsed, spent, due in ((2.9, 0.0, False), (3.5, 0.0, True), (5.0, 0.59, True), (5.0, 0.61, False)):
        clock[0], tuning.spent_s = elapsed, spent
        assert tuning.is_due() is due
    clock[0] = 100.0
    assert not FineTuning(search(None, 10), networks).is_due()


def test_shipped_networks_are_not_modified(networks: list[ActorCritic], regions: Regions) -> None:
    """Updates change copies of each member; the policy's networks serve the next run unchanged."""
    before = weights(networks).clone()
    tuning = FineTuning(search(), networks, FEW)
    once = weights(list(tuning.learn(regions))).clone()
    half = len(once) // 2
    assert not torch.equal(once[:half], before[:half])
    assert torch.equal(once[half:], before[half:]), "the second member has not had its lesson yet"
    twice = weights(list(tuning.learn(regions)))
    assert not torch.equal(twice[half:], before[half:])
    assert torch.equal(weights(networks), before)
    assert tuning.spent_s > 0


def test_population_breeds_after_enough_jobs(networks: list[ActorCritic], regions: Regions) -> None:
    """After some jobs of each member the population is bred; weights stay finite and depend on the seed."""
    ends = []
    for seed in (0, 0, 1):
        tuning = FineTuning(search(seed=seed), networks, FEW)
        for _ in range(2 * GENERATION):
            learned = list(tuning.learn(regions))
        assert tuning._stats == [], "reports are forgotten with their generation"
        ends.append(weights(learned).clone())
        assert ends[-1].isfinite().all()
    assert torch.equal(ends[0], ends[1])
    assert not torch.equal(ends[0], ends[2])


@pytest.mark.parametrize("rewards", list(permutations((1.0, 2.0, 3.0))))
def test_elite_survives_a_generation(regions: Regions, rewards: tuple[float, ...]) -> None:
    """In any order of fitness, the elite passes unchanged, with weights and optimiser."""
    torch.manual_seed(0)
    shipped = [ActorCritic(NetworkSize(8, 8, 2)).requires_grad_(False) for _ in rewards]
    tuning = FineTuning(search(), shipped, FEW)
    for _ in range(len(rewards)):
        tuning.learn(regions)
    before = [(weights([one.policy]).clone(), moments(one)) for one in tuning.members]
    tuning._stats = [TrainingStats(1, 1, reward, 1.0, 0.0, 1e-4) for reward in rewards]
    tuning._breed()
    after = [(weights([one.policy]), moments(one)) for one in tuning.members]
    fittest = sorted(range(len(rewards)), key=lambda number: -rewards[number])[: BREEDING.elite]
    for place, number in enumerate(fittest):
        for mine, its in zip(after[place], before[number], strict=True):
            assert torch.equal(mine, its)


def moments(member: Ppo) -> torch.Tensor:
    """First moments of the member's optimiser."""
    return torch.cat([state["exp_avg"].flatten() for state in member.optimiser.state.values()]).clone()


def test_games_start_at_the_nearest_task_or_in_the_plan(regions: Regions) -> None:
    """Some agents start at the nearest task, others in the plan, with energy weights in the range."""
    games = _RegionGames(regions, FineTuningParameters(games=200))
    board = games.draw(np.random.default_rng(0), 0.0)
    assert board.shape[0] == 200
    assert 0.4 <= float(board.energy_weight.min()) < 0.6
    assert 1.6 < float(board.energy_weight.max()) <= 2.4
    row = [int(torch.nonzero((regions.board.need == need).all(1))[0]) for need in board.need]
    nearest, plan = regions.nearest[row], regions.board.start[row]
    assert ((board.start == nearest) | (board.start == plan)).all()
    assert (board.start != nearest).any()
    assert (board.start != plan).any()
    few = _RegionGames(regions, FineTuningParameters(pairs=3 * board.shape[1] * board.shape[2]))
    assert few.draw(np.random.default_rng(0), 0.0).shape[0] == 3


def test_planner_uses_fine_tuned_networks(networks: list[ActorCritic], monkeypatch: pytest.MonkeyPatch) -> None:
    """After fine-tuning, the planner plays with the updated networks."""
    run = search(None, 3)
    tuning = FineTuning(run, networks, FEW)
    monkeypatch.setattr(tuning, "is_due", lambda: True)
    planner = Planner(run, networks, PlannerParameters(pairs_per_stream=1500), tuning)
    planner.run()
    assert tuning.jobs == 3
    assert [id(one) for one in planner.networks] == [id(member.policy) for member in tuning.members]
    assert run.best is not None
    assert run.best.evaluation.violations == ()
