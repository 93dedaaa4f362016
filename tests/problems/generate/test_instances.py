"""Generated instances agree with the paper's scenarios and with the parameters of families."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alloc.problems import (
    Family,
    InputError,
    Instance,
    makespan_lower_bound,
    paper,
    paper_like,
    random_instance,
)
from alloc.problems.formats import to_document

SIZES = {1: (100, 20, 400), 2: (300, 30, 1200), 3: (500, 30, 2400), 4: (500, 50, 2400)}


@pytest.mark.parametrize("scenario", SIZES)
def test_paper_scenarios_have_their_sizes_and_totals(scenario: int) -> None:
    """Sizes and totals are the paper's; abilities are integers from 1 to 10, workloads distinct and positive."""
    n, m, total = SIZES[scenario]
    for seed in range(20):
        instance = paper(scenario, seed)
        assert (instance.n, instance.m) == (n, m)
        assert instance.ability.sum() == instance.workload.sum() == total
        assert set(instance.ability.tolist()) <= set(map(float, range(1, 11)))
        assert len(set(instance.workload.tolist())) == m
        assert instance.workload.min() >= 1
        np.testing.assert_array_equal(instance.workload, np.round(instance.workload))
        assert makespan_lower_bound(instance) == 1


@pytest.mark.parametrize("scenario", SIZES)
def test_defaults_of_paper_scenarios(scenario: int) -> None:
    """Unit cube, every agent at some task, 6 units of energy per distance, batteries of 20 and 30, tau 0.5."""
    instance = paper(scenario, 7)
    assert instance.name == f"paper-{scenario}-seed-7"
    assert ((instance.task_position >= 0) & (instance.task_position < 1)).all()
    assert np.unique(instance.start_task).min() >= 0
    assert len(np.unique(instance.start_task)) > instance.m / 2
    assert np.isnan(instance.agent_position).all()
    assert (instance.energy_per_distance, instance.tau) == (6, 0.5)
    assert set(instance.battery.tolist()) == {20.0 if scenario == 1 else 30.0}
    assert np.isinf(instance.communication_range).all()
    assert not instance.has_travel_time


def test_large_abilities_occur() -> None:
    """The total is reached by changing single abilities: with mean 4, abilities up to 10 remain."""
    counts = sum(np.bincount(paper(1, seed).ability.astype(int), minlength=11) for seed in range(100))
    assert (counts[1:] > 0).all()
    assert counts[1] == counts.max()


def test_same_seed_gives_same_instance() -> None:
    """The same seed gives the same instance, another seed a different one."""
    for make in (lambda seed: paper(2, seed), lambda seed: random_instance(Family(), seed)):
        assert to_document(make(3)) == to_document(make(3))
        assert to_document(make(3)) != to_document(make(4))


@settings(max_examples=50, deadline=None)
@given(st.data())
def test_paper_like_instances_of_any_size(data: st.DataObject) -> None:
    """Instances are found for all feasible totals, including extreme ones."""
    n = data.draw(st.integers(1, 60))
    total = data.draw(st.integers(n, 10 * n))
    m = data.draw(st.integers(1, int((2 * total + 0.25) ** 0.5 - 0.5)))
    instance = paper_like(n, m, total, data.draw(st.integers(0, 2**40)))
    assert instance.ability.sum() == instance.workload.sum() == total
    assert instance.ability.min() >= 1
    assert instance.ability.max() <= 10
    assert len(set(instance.workload.tolist())) == m
    assert instance.workload.min() >= 1


@pytest.mark.parametrize("ability", ["equal", "uniform", "lognormal", "pareto"])
@pytest.mark.parametrize("workload", ["equal", "uniform", "lognormal", "pareto", "dirichlet"])
@pytest.mark.parametrize("integer", [True, False])
def test_load_is_met(ability: str, workload: str, integer: bool) -> None:
    """Total workload over total ability is the given load for any distributions."""
    family = Family(agents=200, tasks=30, ability=ability, workload=workload, integer=integer, load=0.8)
    instance = random_instance(family, 5)
    expected = 0.8 * instance.ability.sum()
    assert instance.workload.sum() == pytest.approx(round(expected) if integer else expected, rel=1e-12)
    assert (instance.ability == np.round(instance.ability)).all() == (integer or ability == "equal")
    assert (instance.workload == np.round(instance.workload)).all() == integer
    assert instance.ability.min() >= 1 or ability == "lognormal"
    if workload == "equal":
        assert np.ptp(instance.workload) <= 1


def test_ability_distributions_respect_their_limits() -> None:
    """Uniform abilities fill their range, lognormal ones sometimes exceed it, Pareto ones have no upper limit."""
    limits: dict[str, Any] = {"agents": 5000, "integer": False, "ability_min": 2, "ability_max": 8}
    uniform = random_instance(Family(**limits), 1).ability
    assert (2 <= uniform.min() < 2.1, 7.9 < uniform.max() <= 8) == (True, True)
    lognormal = random_instance(Family(**limits, ability="lognormal"), 1).ability
    assert np.mean((lognormal >= 2) & (lognormal <= 8)) == pytest.approx(0.95, abs=0.02)
    pareto = random_instance(Family(**limits, ability="pareto"), 1).ability
    assert pareto.min() >= 2
    assert pareto.max() > 80
    whole = random_instance(Family(agents=2000, ability_min=2.5, ability_max=4.5), 1).ability
    assert set(whole.tolist()) == {3, 4}


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("sites", ["uniform", "clustered"])
@pytest.mark.parametrize("starts", ["tasks", "own", "depots", "unknown"])
def test_positions_are_in_the_world(dimensions: int, sites: str, starts: str) -> None:
    """Sites and starts are in the world, with the given dimensions, at depots or tasks."""
    family = Family(dimensions=dimensions, sites=sites, starts=starts, world_size=50, depots=3)
    instance = random_instance(family, 2)
    for positions in (instance.task_position, instance.start_position):
        known = positions[~np.isnan(positions[:, 0])]
        assert ((known >= 0) & (known <= 50)).all()
        assert (known[:, 2] == 0).all() == (dimensions == 2 or not len(known))
    assert instance.task_position.max() > 10
    known = instance.start_position[~np.isnan(instance.start_position[:, 0])]
    distinct = len(np.unique(known, axis=0))
    assert {"tasks": distinct <= 20, "own": distinct > 90, "depots": distinct == 3, "unknown": distinct == 0}[starts]
    assert (instance.start_task >= 0).all() == (starts == "tasks")
    assert np.isnan(instance.start_position).all() == (starts == "unknown")


def test_clusters_are_denser() -> None:
    """Clustered sites have much nearer neighbours."""

    def nearest(sites: str) -> float:
        places = random_instance(Family(tasks=100, sites=sites), 3).task_position
        distance = np.linalg.norm(places[:, None] - places, axis=2)
        return float(np.median(np.where(distance == 0, np.inf, distance).min(axis=1)))

    assert nearest("clustered") < nearest("uniform") / 2


def test_limits_and_lists() -> None:
    """A number applies to all, two are a range, None is no limit; each agent gets its share of the tasks."""
    family = Family(communication_range=0.5, battery=(1, 2), speed=None, priority=(0, 3), allowed_fraction=0.3, tau=0.9)
    instance = random_instance(family, 4, name="mine")
    assert instance.name == "mine"
    assert set(instance.communication_range.tolist()) == {0.5}
    assert (1 <= instance.battery.min() < 1.1, 1.9 < instance.battery.max() <= 2) == (True, True)
    assert np.isinf(instance.speed).all()
    assert np.ptp(instance.priority) > 2
    assert instance.allowed_tasks is not None
    assert all(tasks is not None and len(tasks) == 6 for tasks in instance.allowed_tasks)
    assert len({tasks.tobytes() for tasks in instance.allowed_tasks if tasks is not None}) > 90
    least = random_instance(Family(tasks=3, allowed_fraction=0.01), 4).allowed_tasks
    assert least is not None
    assert all(tasks is not None and len(tasks) == 1 for tasks in least)


WRONG: list[tuple[dict[str, Any], str]] = [
    *(({field: value}, field) for field in ("agents", "tasks", "clusters", "depots") for value in (0, -1, 1.5, True)),
    ({"agents": 10**12}, "agents"),
    ({"tasks": "20"}, "tasks"),
    *(
        ({field: value}, field)
        for field in ("ability_min", "ability_max", "load", "world_size", "allowed_fraction")
        for value in (0, -1, float("nan"), float("inf"), 1e300, "1", None, True)
    ),
    ({"ability_min": 5, "ability_max": 4}, "ability_max"),
    ({"allowed_fraction": 1.1}, "allowed_fraction"),
    ({"dimensions": 4}, "dimensions"),
    ({"ability": "normal"}, "ability"),
    ({"ability": "dirichlet"}, "ability"),
    ({"workload": None}, "workload"),
    ({"sites": "grid"}, "sites"),
    ({"starts": "depot"}, "starts"),
    ({"battery": -1}, "battery"),
    ({"battery": (1, 2, 3)}, "battery"),
    ({"battery": (2, 1)}, "battery"),
    ({"communication_range": float("nan")}, "communication_range"),
    ({"speed": 0}, "speed"),
    ({"speed": (0, 1)}, "speed"),
    ({"priority": None}, "priority"),
]


@pytest.mark.parametrize(("fields", "place"), WRONG)
def test_parameters_out_of_range_are_refused(fields: dict[str, Any], place: str) -> None:
    """Parameters out of their range are errors that name them."""
    with pytest.raises(InputError) as caught:
        Family(**fields)
    assert caught.value.place == place


@pytest.mark.parametrize(
    ("make", "place"),
    [
        (lambda: paper(5, 0), "scenario"),
        (lambda: paper(1, -1), "seed"),
        (lambda: paper(1, True), "seed"),
        (lambda: paper(1, 1.5), "seed"),
        (lambda: random_instance(Family(), -3), "seed"),
        (lambda: random_instance(Family(tau=1), 0), "tau"),
        (lambda: random_instance(Family(energy_per_distance=-1), 0), "energy_per_distance"),
        (lambda: paper_like(10, 3, 9, 0), "total"),
        (lambda: paper_like(10, 3, 101, 0), "total"),
        (lambda: paper_like(10, 5, 14, 0), "total"),
        (lambda: paper_like(0, 5, 14, 0), "agents"),
    ],
)
def test_invalid_scenarios_seeds_and_totals_are_refused(make: Any, place: str) -> None:
    """Invalid scenarios, seeds and totals are errors that name the parameter."""
    with pytest.raises(InputError) as caught:
        make()
    assert caught.value.place == place


def test_a_hundred_thousand_agents() -> None:
    """Large integer instances have their exact total, also with heavy tails."""
    instance = random_instance(Family(agents=100_000, tasks=200, ability="pareto", starts="own"), 0)
    assert isinstance(instance, Instance)
    assert instance.workload.sum() == instance.ability.sum()
