"""Re-planning: a price on moves, pinned agents, and plans for other fleets, compared with brute force."""

from functools import cache
from itertools import product

import numpy as np
import pytest
from tiny_instances import tiny_instance, varied_instance

from alloc.allocators import Improvement, Result, load, solve
from alloc.allocators.registry import BUILT_IN
from alloc.problems import IDLE, Allocation, InputError, Instance, Objective, evaluate

METHODS = ("cpsat", "milp", "local-search", "ga", "gappo", "hedonic", "auction", "lp-round", "greedy")
EXACT = ("cpsat", "milp")
LONG = ("gappo", "hedonic", "lp-round", "ga")
"""Methods whose comparison with brute force takes seconds, and is left to CI."""


@cache
def cases() -> list[tuple[Instance, Allocation, dict[str, str | None]]]:
    """Return instances with a plan in force, and a pin in every other one."""
    found = []
    for seed in range(24):
        instance = varied_instance(seed) if seed % 2 else tiny_instance(seed)
        rng = np.random.default_rng(seed)
        plan = Allocation(rng.integers(-1, instance.m, instance.n))
        able = np.argwhere(instance.reach.mask[instance.reach.origin])
        pins = {}
        if len(able) and seed % 3 == 0:
            agent, task = able[int(rng.integers(len(able)))].tolist()
            pins = {instance.agent_ids[agent]: instance.task_ids[task]}
        found.append((instance, plan, pins))
    return found


@cache
def best_cost(number: int, objective: Objective, price: float) -> tuple[int, float, float]:
    """Return unserved tasks, makespan and cost of the best allocation in one of the cases, by trying all."""
    instance, plan, pins = cases()[number]
    mask = instance.reach.mask[instance.reach.origin]
    options = []
    for agent in range(instance.n):
        name = instance.agent_ids[agent]
        options.append([instance.task_index[pins[name]]] if name in pins else [IDLE, *np.flatnonzero(mask[agent])])
    scored = []
    for choice in product(*options):
        score = evaluate(instance, Allocation(choice))
        moved = sum(new not in (old, IDLE) for new, old in zip(choice, plan.task_of_agent, strict=True))
        cost = moved if objective is Objective.MAKESPAN_MOVES else score.energy + price * moved
        scored.append((len(score.unserved_tasks), score.served_makespan, cost))
    fewest = min(unserved for unserved, _, _ in scored)
    fastest = min(hours for unserved, hours, _ in scored if unserved == fewest)
    in_time = [cost for unserved, hours, cost in scored if unserved == fewest and hours <= fastest * (1 + 1e-9)]
    return fewest, fastest, min(in_time)


@pytest.mark.parametrize(
    ("objective", "price"), [(Objective.MAKESPAN_MOVES, 0.0), (Objective.MAKESPAN_ENERGY, 2.5)], ids=["moves", "price"]
)
@pytest.mark.parametrize(
    "method", [pytest.param(method, marks=[pytest.mark.slow] * (method in LONG)) for method in METHODS]
)
def test_moves_match_brute_force(method: str, objective: Objective, price: float) -> None:
    """Exact methods find the least cost of moves with all pins, and no method reports less."""
    allocator = load(method)
    for number, (instance, plan, pins) in enumerate(cases()):
        if instance.has_travel_time and not BUILT_IN[method].finite_speeds:
            continue
        unserved, hours, cost = best_cost(number, objective, price)
        result = solve(
            instance,
            allocator,
            objective=objective,
            move_price=price,
            start=plan,
            pins=pins,
            time_limit_s=None,
            iterations=None if method in EXACT else 20,
        )
        score, moves = result.evaluation, result.moves
        assert not score.violations
        assert len(score.unserved_tasks) == unserved
        assert all(result.allocation.to_ids(instance)[agent] == task for agent, task in pins.items())
        assert score.served_makespan >= hours * (1 - 1e-9)
        assert result.lower_bound is None or result.lower_bound <= hours * (1 + 1e-9)
        moved = (result.allocation.task_of_agent != plan.task_of_agent) & (result.allocation.task_of_agent != IDLE)
        assert moves.agents == tuple(np.flatnonzero(moved))
        if score.served_makespan <= hours * (1 + 1e-9):
            assert moves.cost >= cost * (1 - 1e-6) - 1e-9
            assert moves.cost_lower_bound is None or moves.cost_lower_bound <= cost * (1 + 1e-6) + 1e-9
        if method in EXACT:
            assert score.served_makespan == pytest.approx(hours, rel=1e-6)
            assert moves.cost == pytest.approx(cost, rel=1e-6, abs=1e-9)


def test_plan_for_a_changed_instance_is_adapted() -> None:
    """Removed agents and tasks are reported and ignored; agents without a task move at no cost."""
    then = Instance(
        ability=[1, 2, 3, 4], workload=[2, 3, 4], task_position=[[0, 0], [1, 0], [2, 0]], start_task=[0] * 4
    )
    plan = Allocation([0, 1, 2, 2]).to_ids(then)
    now = then.without_agents(["a1"]).without_tasks(["t2"]).with_agents([{"id": "new", "like": "a4"}])
    result = solve(now, "cpsat", objective="makespan-moves", start=plan, makespan_slack=1.0)
    assert "since the plan was made, 1 agent has gone, 1 task has gone, 1 agent is new" in result.notes
    assert result.moves.agents == ()
    assert result.status == "optimal"
    assert "0 of 2 move" in str(result)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"move_price": 2.0, "objective": "makespan-energy"}, "move_price: needs the plan in force"),
        ({"objective": "makespan-moves"}, "objective: needs the plan in force"),
        ({"move_price": 2.0, "start": {"a1": "t1"}}, "move_price: is weighed against energy"),
        ({"pins": {"a9": "t1"}}, "no agent 'a9'"),
        ({"pins": {"a1": "t9"}}, "no task 't9'"),
        ({"pins": {"a1": "t2"}}, "'a1' cannot do 't2': distance 5 exceeds the range 1"),
        ({"start": {"b1": "t1"}}, "names no agent"),
    ],
)
def test_invalid_arguments_are_refused(arguments: dict, message: str) -> None:
    """Invalid combinations are refused before the run."""
    instance = Instance(
        ability=[1, 1],
        workload=[1, 1],
        agent_position=[[0, 0]] * 2,
        task_position=[[0, 0], [5, 0]],
        communication_range=[1, 9],
    )
    with pytest.raises(InputError, match=message):
        solve(instance, "greedy", **arguments)


def test_proofs_with_pins_are_qualified() -> None:
    """Bounds hold only with the pins: the result lists them, and the summary says so."""
    instance = Instance(ability=[5, 1], workload=[10, 1])
    result = solve(instance, "cpsat", pins={"a1": "t2"})
    assert (result.status, result.makespan, dict(result.pins)) == ("optimal", 10.0, {"a1": "t2"})
    assert "with 1 agent pinned: optimal" in str(result)
    assert "cannot be faster while some are pinned" in str(result)
    assert Result.from_dict(result.to_dict(), instance).pins == result.pins
    assert solve(instance, "cpsat").makespan == 2.0


@pytest.mark.parametrize("method", EXACT)
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)])
def test_energy_stage_minimises_costs(method: str, seed: int) -> None:
    """Return flights of all agents cost twice the energy: the same optimum is proven."""
    rng = np.random.default_rng(seed)
    fields = {
        "ability": rng.integers(1, 10, 40),
        "workload": rng.integers(10, 60, 8),
        "agent_position": rng.random((40, 2)),
        "task_position": rng.random((8, 2)),
    }
    back = solve(Instance(**fields, returns=[True] * 40), method, objective="makespan-energy", time_limit_s=20)
    twice = solve(Instance(**fields, energy_per_distance=2), method, objective="makespan-energy", time_limit_s=20)
    assert (back.status, twice.status) == ("optimal", "optimal")
    assert back.energy == pytest.approx(twice.energy, rel=1e-6)


def test_improvements_refer_to_the_given_instance() -> None:
    """In callbacks, pinned agents are at their tasks, and their flights count there and in the trace."""
    instance = varied_instance(3, {"rates"})
    agent, task = next(iter(np.argwhere(instance.reach.mask[instance.reach.origin]).tolist()))
    told: list[Improvement] = []
    result = solve(
        instance,
        "local-search",
        objective="makespan-energy",
        pins={instance.agent_ids[agent]: instance.task_ids[task]},
        iterations=20,
        time_limit_s=None,
        on_improvement=told.append,
    )
    assert all(one.allocation.task_of_agent[agent] == task for one in told)
    assert told[-1].evaluation.energy == pytest.approx(result.energy)
    assert result.trace[-1].energy == pytest.approx(result.energy)


def test_pins_need_no_table_of_pairs() -> None:
    """Without costs, a pin is a list of one task, which needs no table of all pairs."""
    rng = np.random.default_rng(0)
    instance = Instance(
        ability=np.ones(60_000),
        workload=np.full(400, 5.0),
        agent_position=rng.random((60_000, 2)),
        task_position=rng.random((400, 2)),
    )
    result = solve(instance, "greedy", pins={"a1": "t1"}, time_limit_s=20)
    assert result.allocation.task_of_agent[0] == 0
    assert result.makespan is not None
