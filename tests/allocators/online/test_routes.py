"""Route plans: schedules agree with the simulation, and the search finds optimal plans of tiny missions."""

from itertools import permutations, product

import numpy as np
import pytest

from alloc.allocators import load_policy, simulate
from alloc.allocators.online.contract import Briefing
from alloc.allocators.online.routes.describe import Describer, Foresight
from alloc.allocators.online.routes.evaluation import play, replay
from alloc.allocators.online.routes.plan import improved
from alloc.allocators.online.routes.record import new_schedule
from alloc.allocators.online.routes.search import value
from alloc.problems import MissionParameters, random_cfstp, random_mission
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import TaskStatus
from alloc.problems.vocabulary import Knowledge, MissionFamily

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]  # loops are compiled first: half a minute, more under load

FAMILIES = ("steady", "failures", "recharging", "growth", "deadlines")


def drawn(family, seed, agents=3, tasks=5):
    if family == "cfstp":
        return random_cfstp(agents, tasks, seed)
    return random_mission(MissionParameters(family=family, agents=agents, tasks=tasks, knowledge="full"), seed)


def described(mission):
    simulation = Simulation(mission)
    simulation.advance()
    return Describer(mission.end, 1.0, 0.0).describe(simulation.view(None), Foresight())


def worth(known, plan):
    """Return the value of a plan, and its schedule."""
    n, m = known.situation.start_distance.shape
    routes, lengths = np.zeros((n, m), np.int64), np.array([len(route) for route in plan])
    for i, route in enumerate(plan):
        routes[i, : len(route)] = route
    schedule = new_schedule(n, m, m, len(known.situation.events))
    play(known.situation, schedule, routes, lengths)
    return value(known.situation, schedule), schedule


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("family", FAMILIES)
def test_schedule_agrees_with_the_simulation(family, seed):
    """A plan made with full foresight and followed completes each task at the hour in its schedule."""
    mission = drawn(family, seed)
    policy = load_policy("clairvoyant", iterations=0, first_iterations=30)
    decider = policy.begin(Briefing.of(mission, Knowledge.FULL, 0, None, None, clairvoyant=True))
    simulation = Simulation(mission)
    planned = None
    while (request := simulation.advance()) is not None:
        view = simulation.view(None)
        orders = decider.decide(view)
        if planned is None:
            known = decider._search.describer.describe(view, decider.foresight(view))
            column = {task.facts.id: j for j, task in enumerate(known.tasks)}
            plan = [[column[name] for name in decider._routes[agent.facts.id]] for agent in known.agents]
            planned = dict(zip(column, worth(known, plan)[1].tasks["finish"], strict=True))
        for name, order in orders.items():
            assert name in request.agents
            assert simulation.order(name, order) is None
    for task in simulation.state.tasks:
        ended = task.closed if task.status is TaskStatus.DONE else np.inf
        assert ended == pytest.approx(planned[task.facts.id], rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("family", [*FAMILIES, "cfstp"])
def test_search_finds_the_optimum(family, seed):
    """With two agents and three tasks, no plan is better than the one found."""
    known = described(drawn(family, seed, agents=2, tasks=3))
    count = len(known.tasks)
    every = [route for size in range(count + 1) for route in permutations(range(count), size)]
    best = min(worth(known, plan)[0] for plan in product(every, repeat=len(known.agents)))
    routes, lengths, _ = improved(known, {}, 2000, 0, None)
    found = [routes[i, : lengths[i]].tolist() for i in range(len(known.agents))]
    assert worth(known, found)[0] <= best + 1e-6


@pytest.mark.parametrize(("agents", "most"), [(20, 35), (40, 10)])
def test_initial_plans_meet_most_deadlines(agents, most):
    """A first plan does most tasks in time before any search; inserted by least cost, 61 and 19 are undone."""
    known = described(random_cfstp(agents, 300, 1))
    routes, lengths, _ = improved(known, {}, 0, 0, None)
    schedule = worth(known, [route[:count].tolist() for route, count in zip(routes, lengths, strict=True)])[1]
    assert np.count_nonzero(np.isinf(schedule.tasks["finish"])) <= most


@pytest.mark.parametrize("family", FAMILIES)
def test_incremental_schedules_match_full_schedules(family):
    """Agents not affected by a change keep the schedule that scheduling the whole plan would give."""
    mission = drawn(family, 0, agents=5, tasks=12)
    policy = load_policy("clairvoyant")
    decider = policy.begin(Briefing.of(mission, Knowledge.FULL, 0, None, None, clairvoyant=True))
    simulation = Simulation(mission)
    simulation.advance()
    view = simulation.view(None)
    for foresight in (Foresight(), decider.foresight(view)):
        known = decider._search.describer.describe(view, foresight)
        n, m = known.situation.start_distance.shape
        size = n, m, m, len(known.situation.events)
        kept, whole = new_schedule(*size), new_schedule(*size)
        routes, lengths = np.zeros((n, m), np.int64), np.zeros(n, np.int64)
        rng = np.random.default_rng(0)
        play(known.situation, kept, routes, lengths)
        for _ in range(100):
            kept.agents["touched"] = kept.tasks["touched"] = 0
            before = routes.copy(), lengths.copy()
            i = rng.integers(n)
            lengths[i] = rng.integers(min(m, 4) + 1)
            routes[i, : lengths[i]] = rng.permutation(m)[: lengths[i]]
            replay(known.situation, kept, routes, lengths, *before)
            play(known.situation, whole, routes, lengths)
            np.testing.assert_array_equal(kept.agents["first"], whole.agents["first"])
            np.testing.assert_array_equal(kept.tasks["finish"], whole.tasks["finish"])
            np.testing.assert_allclose(kept.totals, whole.totals, rtol=1e-12)


def test_foresight_saves_time():
    """Over some missions, `clairvoyant` needs no more time than `routes`, and neither beats the lower bound."""
    total = {"routes": 0.0, "clairvoyant": 0.0}
    for seed in range(4):
        mission = drawn(MissionFamily.FAILURES, seed, tasks=6)
        for name in total:
            result = simulate(mission, name, iterations=300, first_iterations=1500).result
            assert result.mission_time >= result.mission_time_lower_bound - 1e-9
            total[name] += result.mission_time
    assert total["clairvoyant"] <= total["routes"]
