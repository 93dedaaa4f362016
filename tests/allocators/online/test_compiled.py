"""Compiled policies other than networks agree with the reference; their tuning can be resumed."""

import dataclasses
import math
import random
from pathlib import Path

import pytest

from alloc.allocators import load_policy, simulate
from alloc.allocators.learned.missions.training.trainer import MissionTrainingParameters
from alloc.allocators.online.compiled.run import run_compiled
from alloc.allocators.online.compiled.tuning import tune
from alloc.problems import InputError, MissionParameters, random_mission
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Burst, Pace, Radio

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]  # loops are compiled first: half a minute, more under load

RADIOS = [None, Radio(radius=0.3, burst=Burst(good=1.0, bad=1.0)), Radio(radius=0.4, loss=0.2, delay=0.17)]
KEPT = ("joins", "appears", "deadline", "growth", "events", "horizon", "knowledge", "sensing", "seed")


def missions() -> list[Mission]:
    """Return small missions with all features: events, deadlines, growth, bursts and delays."""
    kinds = ("steady", "failures", "recharging", "growth", "deadlines", "silence")
    drawn = [random_mission(MissionParameters(kind, 7, 10), seed) for seed, kind in enumerate(kinds)]
    radios = [RADIOS[number % len(RADIOS)] or mission.radio for number, mission in enumerate(drawn)]
    return [
        Mission(mission.instance, **{name: getattr(mission, name) for name in KEPT}, radio=radio)
        for mission, radio in zip(drawn, radios, strict=True)
    ]


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("nearest", {}),
        ("greedy", {"age": 0.1, "memory": 3.0}),
        ("hedonic", {"age": 0.1, "flight": 0.2}),
        ("auction", {"stay": math.inf}),
        ("auction", {"stay": 2.0, "age": 0.1, "seats": 1.5, "flight": 2.0}),
        ("gappo", {"periods": 10}),
    ],
)
def test_compiled_runs_match_the_reference(name: str, settings: dict[str, float]) -> None:
    """A policy reaches the same mission time, energy, switches and bytes in both simulations."""
    policy = load_policy(name, **settings)
    for seed, mission in enumerate(missions()):
        expected, found = simulate(mission, policy, seed=seed).result, run_compiled(mission, policy, seed)
        for kind in ("mission_time", "tasks_done", "energy", "switches", "messages", "bytes"):
            value = getattr(expected, kind)
            assert getattr(found, kind) == (None if value is None else pytest.approx(value, rel=1e-9)), (seed, kind)


LOOPS = ("nearest", "greedy", "hedonic", "auction", "gappo")
FAMILIES = ("steady", "waves", "hot-spots", "failures", "recharging", "growth", "deadlines", "silence")


def drawn_mission(seed: int) -> Mission:
    """Return a small mission of any family, with any radio."""
    rng, family = random.Random(seed), FAMILIES[seed % len(FAMILIES)]
    knowledge = rng.choice(["local"] * 9 + ["full"])
    mission = random_mission(MissionParameters(family, rng.randint(2, 6), rng.randint(2, 8), knowledge=knowledge), seed)
    burst = Burst(rng.uniform(0.1, 2), rng.uniform(0.1, 2), rng.uniform(0, 0.3), rng.uniform(0.5, 1))
    radio = Radio(
        radius=rng.choice([0.15, 0.3, 0.6, math.inf]),
        period=rng.choice([0.1, 0.25, 0.37]),
        loss=rng.choice([0.0, 0.2, 0.8]),
        delay=rng.choice([0.0, 0.0, 0.05, 0.31]),
        burst=rng.choice([None, None, burst]),
    )
    kept = {name: getattr(mission, name) for name in KEPT if name != "sensing"}
    pace = rng.choice([None, None, None, Pace(1, 2, 1)])
    return Mission(mission.instance, **kept, radio=radio, pace=pace, sensing=rng.choice([0.15, 0.3, 0.6, math.inf]))


def test_random_missions_match_the_reference(request: pytest.FixtureRequest) -> None:
    """In small missions of all families and radios, all measures agree except decision times."""
    for seed in range(request.config.getoption("--draws") or 40):
        mission, policy = drawn_mission(seed), load_policy(LOOPS[seed // len(FAMILIES) % len(LOOPS)])
        expected = dataclasses.asdict(simulate(mission, policy, seed=seed).result)
        found = dataclasses.asdict(run_compiled(mission, policy, seed))
        for name, value in expected.items():
            if not name.startswith(("decision", "runtime")):
                same = pytest.approx(value, rel=1e-9, abs=1e-9) if isinstance(value, float) else value
                assert found[name] == same, (seed, policy.info.name, name)


def test_grid_finds_nearby_agents() -> None:
    """With more than a hundred agents, nearby ones are found by a grid of cells, and both simulations agree."""
    drawn = random_mission(MissionParameters("failures", 150, 20, radius=0.12, sensing=0.12), 5)
    kept = {name: getattr(drawn, name) for name in KEPT if name != "horizon"}
    mission = Mission(drawn.instance, **kept, horizon=0.6, radio=drawn.radio)
    policy = load_policy("nearest")
    expected, found = simulate(mission, policy, seed=0).result, run_compiled(mission, policy, 0)
    assert expected.messages > 500
    for kind in ("tasks_done", "switches", "messages", "bytes"):
        assert getattr(found, kind) == getattr(expected, kind)
    assert found.energy == pytest.approx(expected.energy, rel=1e-9)


def test_policies_without_a_compiled_version_are_refused() -> None:
    """A central policy is an error, not a wrong result."""
    with pytest.raises(InputError, match="no compiled version"):
        run_compiled(missions()[0], load_policy("idle"))


def test_interrupted_tuning_is_resumed(tmp_path: Path) -> None:
    """Two generations in two runs are the same as in one run."""
    small = MissionTrainingParameters(missions=1, candidates=4, validations=1)
    whole = list(tune("auction", 2, 3, setting=small))
    state = tmp_path / "state.npz"
    first = next(tune("auction", 2, 3, state, small))
    assert [first, *tune("auction", 2, 3, state, small)] == whole
    assert whole[1].missions == 8
