"""The planner: regions, targets, and plans for instances of every kind."""

import copy
from itertools import pairwise

import numpy as np
import pytest
import torch
from boards import EXTREMES
from oracle import brute_force
from tiny_instances import tiny_instance

from alloc.allocators import Budget, MakespanTolerance, Search, solve
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.play.batched_games import Games, play_games
from alloc.allocators.learned.play.rollout import Best
from alloc.allocators.learned.policy import Ppo
from alloc.allocators.learned.search.planner import Planner, PlannerParameters, most_helpers
from alloc.problems import IDLE, Allocation, Evaluation, Family, Instance, Objective, evaluate, random_instance
from alloc.problems.game import Board, make_board
from alloc.problems.game.regions import lay_out_regions
from alloc.problems.generate import paper_like
from alloc.problems.vocabulary import OBJECTIVES

pytestmark = pytest.mark.timeout(400)  # the first game waits for the compiler, long on a busy machine

QUICK = PlannerParameters(pairs_per_stream=1500, rounds=8)
ENERGY = Objective.MAKESPAN_ENERGY


@pytest.fixture(scope="module")
def network() -> ActorCritic:
    """An untrained network: what is shown here does not depend on training."""
    torch.manual_seed(0)
    network = ActorCritic(NetworkSize(8, 8, 2)).requires_grad_(False)
    network.reserve[-1].bias.fill_(-1.0)
    return network


def planner(
    network: ActorCritic,
    instance: Instance,
    objective: Objective = Objective.MAKESPAN,
    iterations: int | None = 3,
    time_limit_s: float | None = None,
    **settings: object,
) -> Planner:
    budget = Budget(time_limit_s, iterations)
    return Planner(Search(instance, objective, budget, **settings), [network], QUICK)  # type: ignore[arg-type]


def planned(network: ActorCritic, instance: Instance, **settings: object) -> Search:
    """Run a planner to its end."""
    one = planner(network, instance, **settings)  # type: ignore[arg-type]
    one.run()
    return one.search


def solved(
    network: ActorCritic, instance: Instance, objective: Objective = Objective.MAKESPAN, iterations: int = 6
) -> Evaluation:
    """Return the scores of what `solve` finds by a planner, once it has settled which tasks are served."""
    allocator = Ppo()
    allocator.networks, allocator.parameters = [network], QUICK
    result = solve(instance, allocator, objective=objective, time_limit_s=None, iterations=iterations)
    assert result.evaluation is not None
    return result.evaluation


def test_regions_contain_all_agents_of_their_tasks(network: ActorCritic) -> None:
    """Each region has the agents of its tasks and some idle ones; no agent is in two regions."""
    instance = paper_like(40, 9, 170, 1)
    one = planner(network, instance)
    one.plan = np.random.default_rng(0).integers(-1, 9, 40)
    for _ in range(10):
        tasks, agents = one._partition(np.zeros(9))
        together = np.concatenate(agents)
        assert len(np.unique(together)) == len(together)
        for some, who in zip(tasks, agents, strict=True):
            assert set(one.plan[who].tolist()) <= {*some.tolist(), IDLE}
            assert set(np.flatnonzero(np.isin(one.plan, some)).tolist()) <= set(who.tolist())
        assert set(np.flatnonzero(one.plan == IDLE).tolist()) <= set(together.tolist())


def test_sweep_moves_only_agents_of_accepted_regions(network: ActorCritic) -> None:
    """Agents of rejected regions, and those in no region, stay where they are."""
    instance = paper_like(40, 9, 170, 1)
    one = planner(network, instance)
    one.plan = instance.start_task.copy()
    tasks, agents = one._partition(one.target.surplus(one.plan))
    regions = lay_out_regions(instance, one.target.hours, one.plan, tasks, agents)
    accepted, slots = one._play_regions(network, regions, (0.4, 2.4))
    assert accepted.any()
    merged = regions.merge(one.plan, slots, accepted)
    may_move = np.concatenate([agents[region] for region in np.flatnonzero(accepted)])
    others = np.setdiff1d(np.arange(40), may_move)
    assert np.array_equal(merged[others], one.plan[others])
    assert not np.array_equal(merged, one.plan)
    assert evaluate(instance, Allocation(merged)).violations == ()


def test_accepted_plans_have_less_shortfall(network: ActorCritic) -> None:
    """Every merged plan has less total shortfall, or the same with less distance."""
    instance = paper_like(40, 9, 170, 1)
    one = planner(network, instance)
    one.play_whole(1.0)
    met = []
    for _ in range(12):
        surplus, score = one.target.surplus(one.plan), evaluate(instance, Allocation(one.plan))
        met.append((round(float(-surplus[surplus < 0].sum()), 4), score.distance))
        tasks, agents = one._partition(surplus)
        regions = lay_out_regions(instance, one.target.hours, one.plan, tasks, agents)
        accepted, slots = one._play_regions(network, regions, (0.4, 2.4))
        one.plan = regions.merge(one.plan, slots, accepted)
    assert all(later <= earlier for earlier, later in pairwise(met))
    assert met[-1] < met[0]


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_never_worse_than_the_start(network: ActorCritic, objective: Objective) -> None:
    """The result is at least as good as the start, and each improvement is better than the previous one."""
    instance = paper_like(30, 6, 130, 2)
    start = Allocation(np.arange(30) % 6)
    search = planned(network, instance, objective=objective, start=start)
    assert search.best is not None
    assert not evaluate(instance, start).is_better_than(search.best.evaluation, objective)
    for earlier, later in pairwise(search.trace):
        assert later.makespan <= earlier.makespan * (1 + 1e-9)


@pytest.mark.parametrize("seed", range(30))
def test_tiny_instances_are_feasible_and_above_the_optimum(network: ActorCritic, seed: int) -> None:
    """On tiny instances plans are feasible, serve all servable tasks, and are not below the optimum."""
    instance = tiny_instance(seed)
    search = planned(network, instance, objective=ENERGY, iterations=2)
    best = brute_force(instance)
    assert search.best is not None
    got = search.best.evaluation
    assert got.violations == ()
    assert len(got.unserved_tasks) == best.unserved
    assert got.served_makespan >= best.makespan * (1 - 1e-9)


def test_most_tiny_instances_are_solved(network: ActorCritic) -> None:
    """Even with an untrained network, games on regions find the least makespan of four in five instances."""
    hit = 0
    for seed in range(20):
        instance = tiny_instance(seed)
        search = planned(network, instance, iterations=5)
        assert search.best is not None
        hit += search.best.evaluation.served_makespan <= brute_force(instance).makespan * (1 + 1e-9)
    assert hit >= 16


def test_targets_start_at_the_bound_and_are_bisected(network: ActorCritic) -> None:
    """First the bound; without progress, halfway to the best makespan; after success, nearer to the bound."""
    instance = Instance(ability=[3, 3, 3], workload=[4, 5])  # the bound of 1 cannot be met: 5 / 3 or 4 / 3 at best
    one = planner(network, instance)
    bound = one.target.hours
    assert bound == one.target.failed == one.search.lower_bound
    one._continue_from(np.array([0, 1, IDLE]))  # T = 5 / 3
    one.target.update(one.plan)
    assert one.target.hours == bound
    one.target.stale = one.target.patience
    one.target.update(one.plan)
    assert one.target.failed == bound
    assert one.target.hours == pytest.approx((bound + 5 / 3) / 2)
    assert one.target.stale == 0
    one._continue_from(np.array([0, 1, 1]))  # T = 4 / 3, which is within the target
    assert one.target.hours >= 4 / 3
    one.target.update(one.plan)
    assert one.target.hours == pytest.approx((bound + 4 / 3) / 2)
    one.target.stale = one.target.patience
    one.target.update(one.plan)
    assert one.target.failed == pytest.approx((bound + 4 / 3) / 2)


def test_energy_counts_at_the_bound_or_late_in_the_run(network: ActorCritic) -> None:
    """With energy in the objective, the target becomes the best makespan at the bound or late in the run."""
    instance = Instance(ability=[3, 3, 3], workload=[4, 5])
    early, late = (planner(network, instance, ENERGY, iterations=10) for _ in range(2))
    late.search.iteration = 7
    for one in (early, late):
        one._continue_from(np.array([0, 1, 1]))
        one.target.update(one.plan)
    assert early.target.hours == early.target.failed
    assert late.target.hours == pytest.approx(4 / 3)
    met = planner(network, Instance(ability=[2, 1], workload=[2, 1], task_position=[[0, 0], [1, 0]]), ENERGY)
    met._continue_from(np.array([0, 1]))
    met.target.update(met.plan)
    assert met.target.hours == 1.0


def test_optimum_is_found_with_an_unreachable_bound(network: ActorCritic) -> None:
    """If the bound cannot be reached, bisection of the target still finds the optimum."""
    instance = Instance(ability=[5, 5, 5, 4, 4], workload=[9, 8, 6], agent_position=np.zeros((5, 2)))
    best = brute_force(instance)
    one = planner(network, instance, iterations=12)
    one.target.patience = 2
    one.run()
    assert one.search.best is not None
    assert best.makespan > one.search.lower_bound * 1.01
    assert one.search.best.evaluation.makespan == pytest.approx(best.makespan)


def test_unservable_tasks_do_not_count(network: ActorCritic) -> None:
    """A huge task out of reach, or more tasks than agents, affects neither bound nor search."""
    far = Instance(
        ability=[1] * 10,
        workload=[6, 4, 90],
        task_position=[[0, 0], [1, 0], [99, 0]],
        start_task=[0] * 10,
        communication_range=[5] * 10,
    )
    for objective in OBJECTIVES:
        assert solved(network, far, objective, iterations=6).served_makespan == pytest.approx(1.0)
    few = Instance(ability=[3, 1], workload=[2, 5, 1, 4])
    assert len(solved(network, few, iterations=6).unserved_tasks) == brute_force(few).unserved == 2


@pytest.mark.parametrize("seed", range(6))
def test_smallest_tasks_are_served_in_a_shortage(network: ActorCritic, seed: int) -> None:
    """With more tasks than agents and complete reach, the makespan equals brute force."""
    rng = np.random.default_rng(seed)
    instance = Instance(ability=rng.integers(1, 6, 3), workload=rng.integers(1, 30, 5))
    got, best = solved(network, instance, iterations=10), brute_force(instance)
    assert (len(got.unserved_tasks), got.served_makespan) == (best.unserved, pytest.approx(best.makespan))


def test_task_that_needs_most_agents_gets_them_in_the_first_game(network: ActorCritic) -> None:
    """One agent per round joins a task: games last as long as the largest task needs."""
    instance = Instance(ability=np.ones(60), workload=[48.0, *[2.0] * 6], start_task=np.arange(60) % 7)
    one = planner(network, instance)
    board = make_board([instance], [1.0], [1.0], np.random.default_rng(0))
    assert most_helpers(board) == 48
    asked = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "alloc.allocators.learned.search.planner.play_games",
            lambda *args, **settings: asked.append(settings["rounds"]) or play_games(*args, **settings),
        )
        one.play_whole(1.0)
    assert asked == [16 + 48]


@pytest.mark.parametrize(("pairs", "most", "games"), [(1, 9, 1), (10**9, 9, 9)])
def test_games_on_a_region_are_bounded(
    network: ActorCritic, monkeypatch: pytest.MonkeyPatch, pairs: int, most: int, games: int
) -> None:
    """Each region is played at least once, and at most as often as allowed, however many pairs there may be."""
    instance = paper_like(60, 20, 330, 3)
    one = Planner(
        Search(instance, ENERGY, Budget(None, 4)),
        [network],
        PlannerParameters(pairs_per_stream=pairs, games_per_region=most),
    )
    played: list[list[int]] = []

    def spy(network: ActorCritic, board: Board, games: Games, **settings: object) -> Best:
        played.append(np.bincount(games.row, minlength=len(board.energy_weight)).tolist())
        return play_games(network, board, games, **settings)  # type: ignore[arg-type]

    monkeypatch.setattr("alloc.allocators.learned.search.planner.play_games", spy)
    one.run()
    on_regions = [games for games in played if len(games) > 1]
    assert len(on_regions) > 0
    assert {count for games in on_regions for count in games} == {games}


def test_targets_approached_too_slowly_are_abandoned(network: ActorCritic) -> None:
    """If most of the shortfall is left after a share of the budget, the target is bisected."""
    instance = paper_like(40, 8, 170, 0)
    one = planner(network, instance, iterations=100)
    one.play_whole(1.0)
    target, first = one.target, one.target.hours
    for shortfall in (50.0, 49.0, 48.0, 47.0, 46.0):
        target.record(np.array([-shortfall, 1.0]))
    one.search.iteration = 20
    target.update(one.plan)
    assert target.hours == first, "the first check has nothing to compare with"
    for _ in range(5):
        target.record(np.array([-30.0, 1.0]))
    target.update(one.plan)
    assert target.hours == first, "the share of the budget has not passed"
    one.search.iteration = 40
    target.update(one.plan)
    assert target.failed == first
    assert target.hours > first


def test_small_shortfall_does_not_end_a_target(network: ActorCritic) -> None:
    """A shortfall below the mean ability ends no target, and stagnation counts only after some sweeps."""
    one = planner(network, paper_like(40, 8, 170, 0), iterations=100)
    one.play_whole(1.0)
    target, first = one.target, one.target.hours
    for iteration in (20, 40, 60):
        for _ in range(5):
            target.record(np.array([-2.0, -1.0, 5.0]))
        target.search.iteration = iteration
        target.update(one.plan)
        assert target.hours == first
    assert target.stale == 14
    assert target.stagnation == pytest.approx((14 - 5) / (20 - 5))
    target.record(np.array([-2.0]))
    assert target.stagnation == 0


def test_small_shortfalls_of_many_tasks_end_a_target(network: ActorCritic) -> None:
    """If many tasks are short, a target is abandoned even at a small total, as it may be infeasible."""
    one = planner(network, paper_like(40, 8, 170, 0), iterations=100)
    one.play_whole(1.0)
    target, slow = one.target, []
    for iteration in (20, 40):
        for _ in range(5):
            target.record(np.full(8, -0.1))
        target.search.iteration = iteration
        before = target.hours
        target.update(one.plan)
        slow.append(target.hours > before)
    assert slow == [False, True]


def test_run_without_work_ends_at_once(network: ActorCritic) -> None:
    """Without work there is an answer, and no game on regions."""
    instance = Instance(ability=[1, 1], workload=[0], agent_position=[[0, 0]] * 2, task_position=[[9, 9]])
    search = planned(network, instance, iterations=None, time_limit_s=60.0)
    assert search.best is not None
    assert search.iteration == 0


def test_slack_and_limit_save_energy(network: ActorCritic) -> None:
    """More time for a plan means less flying; a given limit is the target."""
    instance = paper_like(24, 5, 100, 3)
    spent = []
    for tolerance in (MakespanTolerance(), MakespanTolerance(slack=0.3), MakespanTolerance(limit=3.0)):
        search = planned(network, instance, objective=ENERGY, iterations=8, tolerance=tolerance)
        assert search.best is not None
        assert search.best.evaluation.makespan is not None
        assert search.best.evaluation.makespan <= search.makespan_limit * (1 + 1e-9)
        spent.append(search.best.evaluation.energy)
    assert spent[2] < spent[1] < spent[0]
    assert planner(network, instance, ENERGY, tolerance=MakespanTolerance(limit=3.0)).target.hours == 3.0
    assert planner(network, instance, ENERGY, tolerance=MakespanTolerance(limit=0.5)).target.hours == pytest.approx(1.0)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_same_seed_gives_same_answer(network: ActorCritic, objective: Objective) -> None:
    """With a sweep budget, answers are identical with one thread and with two; those of another seed differ."""
    instance = random_instance(Family(agents=24, tasks=5, starts="own", speed=(0.5, 2.0)), 1)
    runs = [planned(network, instance, objective=objective, threads=threads, seed=4) for threads in (1, 1, 2)]
    other = planned(network, instance, objective=objective, seed=5)
    traces = [[(one.makespan, one.energy) for one in search.trace] for search in (*runs, other)]
    assert traces[0] == traces[1] == traces[2]
    assert traces[0] != traces[3]


def test_planner_stops_in_time(network: ActorCritic) -> None:
    """Sweeps and their games end when time is up; even with zero time there is an answer."""
    instance = paper_like(100, 20, 400, 0)
    for limit in (0.0, 0.5):
        one = planner(network, instance, ENERGY, iterations=None, time_limit_s=limit)
        one.run()
        assert one.search.best is not None
        assert one.search.best.evaluation.unserved_tasks == ()
    assert one.search.iteration > 0
    assert one.search.elapsed_s < 5.0, "the machine may be busy, but not that busy"


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("name", list(EXTREMES))
def test_extreme_instances_give_feasible_plans(network: ActorCritic, name: str, objective: Objective) -> None:
    """Huge and tiny numbers, no positions, no able agent, no work: the plan is feasible."""
    search = planned(network, EXTREMES[name], objective=objective)
    assert search.best is not None
    assert search.best.evaluation.violations == ()


def test_idle_agents_are_assigned(network: ActorCritic) -> None:
    """Agents that start idle, or are left idle by a start, join tasks that need them."""
    instance = Instance(ability=np.ones(12), workload=np.full(3, 4.0), task_position=np.eye(3))
    start = Allocation(np.array([0, 1, 2, *[IDLE] * 9]))
    search = planned(network, instance, start=start, iterations=8)
    assert search.best is not None
    assert search.best.evaluation.makespan == 1.0


def test_all_networks_are_used(network: ActorCritic, monkeypatch: pytest.MonkeyPatch) -> None:
    """All networks of a policy play on regions, the first one on the whole instance."""
    networks = [network, *(copy.deepcopy(network) for _ in range(2))]
    asked: list[int] = []

    def spy(one: ActorCritic, *args: object, **settings: object) -> Best:
        asked.append([id(each) for each in networks].index(id(one)))
        return play_games(one, *args, **settings)  # type: ignore[arg-type]

    monkeypatch.setattr("alloc.allocators.learned.search.planner.play_games", spy)
    one = Planner(Search(paper_like(12, 4, 50, 3), ENERGY, Budget(None, 8)), networks, QUICK)
    one.play_whole(1.0)
    assert asked == [0]
    one.run()
    assert set(asked) == {0, 1, 2}


def test_target_allows_for_flights_with_finite_speeds() -> None:
    """Two agents of ability 1 fly 1 h and 3 h to work of 2 in total, which they finish after 3 h."""
    instance = Instance(
        ability=[1.0, 1.0],
        workload=[1.0, 1.0],
        task_position=[[0.0, 0.0], [1.0, 0.0]],
        agent_position=[[0.0, 1.0], [1.0, 3.0]],
        speed=[1.0, 1.0],
    )
    planner = Planner(Search(instance, Objective.MAKESPAN, Budget(1.0)), [ActorCritic()])
    planner.search.submit(Allocation([0, 1]))  # done after 2 h and 4 h
    planner.target.hours = 2.9
    planner.target.update(np.array([IDLE, IDLE]))
    assert planner.target.hours == 2.9, "where nobody works there is no work to divide"
    planner.target.update(np.array([0, 1]))
    assert planner.target.hours == pytest.approx(((1 + 1) + (1 + 3)) / 2)
