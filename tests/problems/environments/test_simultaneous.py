"""The PettingZoo environment."""

import numpy as np
import pytest

pytest.importorskip("pettingzoo")

from boards import EXTREMES, layout
from pettingzoo.test import parallel_api_test, parallel_seed_test

from alloc.problems import Allocation, Family, InputError, Instance, evaluate, paper_like, random_instance
from alloc.problems.environments import SimultaneousEnv
from alloc.problems.game import PAPER, PLANNING, Reward, Rules, TurnRule, difference_rewards, reset, step

SEEN = ("need", "priority", "flight", "brings", "seen", "ability", "members", "shortfall", "here")


def small(**options) -> SimultaneousEnv:
    return SimultaneousEnv([paper_like(8, 3, 30, seed) for seed in range(3)], **options)


def made() -> SimultaneousEnv:
    """An environment with random ranges, batteries and places, new at each reset."""
    family = Family(agents=6, tasks=4, starts="own", communication_range=(0.2, 0.8), battery=(0.5, 3.0))
    return SimultaneousEnv(lambda rng: random_instance(family, int(rng.integers(2**31))), max_steps=8)


@pytest.fixture
def street() -> Instance:
    """Tasks at 0, 3 and 7; agents at the first, the first and the last, with ranges of 5, 5 and 3; 2 energy a step."""
    return Instance(
        ability=[1, 2, 3],
        workload=[2, 2, 2],
        task_position=[[0, 0], [3, 0], [7, 0]],
        start_task=[0, 0, 2],
        communication_range=[5, 5, 3],
        battery=[10, 20, 6],
        energy_per_distance=2.0,
    )


def everybody(env: SimultaneousEnv, *actions: int) -> dict[str, int]:
    return dict(zip(env.agents, actions, strict=True))


@pytest.mark.parametrize("make", [small, made])
def test_passes_the_pettingzoo_tests(make) -> None:
    """The project's tests of interface and seeds pass, without a warning."""
    parallel_api_test(make(), num_cycles=100)
    parallel_seed_test(make, num_cycles=50)


@pytest.mark.parametrize("name", EXTREMES)
def test_observations_are_in_their_space(name: str) -> None:
    """Observations are within their bounds and rewards finite, also for extreme numbers."""
    for reward in Reward:
        rules = Rules(TurnRule.SIMULTANEOUS, reward, flying=True, returning=True)
        env = SimultaneousEnv([EXTREMES[name]], rules=rules, max_steps=4)
        seen, _ = env.reset(seed=0)
        while env.agents:
            for agent in env.agents:
                assert env.observation_space(agent).contains(seen[agent])
            actions = {agent: env.action_space(agent).sample(seen[agent]["action_mask"]) for agent in env.agents}
            seen, rewards, *_ = env.step(actions)
            assert np.isfinite(list(rewards.values())).all()


def test_observations_match_hand_calculation(street: Instance) -> None:
    """Within its range of 5 the first agent sees the tasks at 0 and 3, but not the agents at 7."""
    env = SimultaneousEnv([street])
    seen, _ = env.reset(seed=0)
    table = dict(zip(SEEN, seen["agent_0"]["tasks"].T.tolist(), strict=True))
    # nothing better than 2 h is possible: half of the mean ability of 2 for each task
    assert table["need"] == pytest.approx([0.5, 0.5, 0.5])
    assert table["seen"] == [1, 1, 0]
    assert table["ability"] == pytest.approx([1.5, 0, 0])
    assert table["members"] == [2, 0, 0]
    assert table["shortfall"] == pytest.approx([-1, 0.5, 0])
    assert table["here"] == [1, 0, 0]
    unit = env._game.board.scale.item()
    assert table["flight"] == pytest.approx([0, 3 * unit, 7 * unit])
    own = seen["agent_0"]["agent"].tolist()
    assert own == pytest.approx([-10 / 3 * unit, 0, 0, 1, 0.5, 0, 0], abs=1e-5)
    assert seen["agent_0"]["action_mask"].tolist() == [1, 1, 0, 1]
    assert seen["agent_2"]["action_mask"].tolist() == [0, 0, 1, 1]


def test_objects_out_of_range_are_not_seen(street: Instance) -> None:
    """What the third agent does, at distance 7, does not affect the first one's observation, and vice versa."""
    views = []
    for last in (2, 3):
        env = SimultaneousEnv([street])
        env.reset(seed=0)
        views.append(env.step(everybody(env, 0, 0, last))[0])
    np.testing.assert_equal(views[0]["agent_0"]["tasks"], views[1]["agent_0"]["tasks"])
    assert views[0]["agent_2"]["tasks"][2, 5] != views[1]["agent_2"]["tasks"][2, 5]
    env.reset(seed=0)
    moved = env.step(everybody(env, 1, 0, 2))[0]
    assert moved["agent_0"]["tasks"][:, 4].tolist() == [1, 1, 1]  # from 3, all are within 5


def test_energy_and_battery_add_up_over_the_hops(street: Instance) -> None:
    """The first agent flies 3 and back: 12 units of energy, all of its 10; so it may not fly back."""
    env = SimultaneousEnv([street])
    env.reset(seed=0)
    seen, _, _, _, infos = env.step(everybody(env, 1, 1, 2))
    assert infos["agent_1"]["episode_energy"] == pytest.approx(2 * (3 + 3))
    assert infos["agent_1"]["episode_battery"] == pytest.approx(100 * (0.4 + 0.7 + 1) / 3)
    assert seen["agent_0"]["agent"][3] == pytest.approx(0.4)
    assert seen["agent_0"]["action_mask"].tolist() == [0, 1, 0, 1]
    _, _, _, _, infos = env.step(everybody(env, 0, 0, 2))
    assert infos["agent_0"]["illegal"]
    assert not infos["agent_1"]["illegal"]
    assert infos["agent_0"]["episode_energy"] == pytest.approx(2 * (3 + 6))


def test_rewards_match_the_game(street: Instance) -> None:
    """Each agent gets its difference reward, by (3) as in the paper or by the makespan."""
    for rules in (PAPER, Rules(TurnRule.SIMULTANEOUS)):
        env = SimultaneousEnv([street], rules=rules, energy_weight=0.25)
        env.reset(seed=0)
        _, rewards, *_ = env.step(everybody(env, 1, 3, 2))
        board = layout(street, hours=2.0, energy_weight=0.25)
        slot = board.start.new_tensor([[1, 3, 2]])
        expected = difference_rewards(board, reset(board), slot, rules)[0].tolist()
        assert list(rewards.values()) == pytest.approx(expected)
        assert step(board, reset(board), slot).done.item() is False


def test_termination_and_truncation(street: Instance) -> None:
    """A step without moves ends the game, too many steps truncate it; in both cases the plan is scored as usual."""
    env = SimultaneousEnv([street], max_steps=2)
    env.reset(seed=0)
    env.step(everybody(env, 1, 0, 2))
    _, _, ended, cut, infos = env.step(everybody(env, 1, 0, 2))
    assert all(ended.values())
    assert not any(cut.values())
    assert env.agents == []
    assert env.step({}) == ({}, {}, {}, {}, {})
    scores = evaluate(street, Allocation([1, 0, 2]))
    assert infos["agent_0"]["makespan"] == scores.makespan == 2
    assert infos["agent_0"]["energy"] == pytest.approx(scores.energy)
    assert infos["agent_0"]["unserved"] == 0
    env.reset()
    env.step(everybody(env, 1, 0, 2))
    _, _, ended, cut, infos = env.step(everybody(env, 1, 1, 2))
    assert all(cut.values())
    assert not any(ended.values())
    assert infos["agent_0"]["unserved"] == 1


def test_same_seed_gives_same_games() -> None:
    """The seed determines the sequence of instances; other seeds give other ones."""

    def games(seed: int) -> list[float]:
        env = made()
        first = [env.reset(seed=seed)] + [env.reset() for _ in range(3)]
        return [float(seen["agent_0"]["tasks"].sum()) for seen, _ in first]

    assert games(1) == games(1)
    assert len({*games(1), *games(2)}) == 8


def test_wrong_use_is_refused() -> None:
    """Bidding rules, missing instances, and instances of different sizes are errors."""
    with pytest.raises(InputError, match="BiddingEnv"):
        small(rules=PLANNING)
    with pytest.raises(InputError, match="none"):
        SimultaneousEnv([])
    with pytest.raises(InputError, match="equal size"):
        SimultaneousEnv([paper_like(8, 3, 30, 0), paper_like(9, 3, 30, 0)])
    env = SimultaneousEnv(lambda rng: paper_like(int(rng.integers(3, 30)), 3, 30, 0))
    with pytest.raises(InputError, match="agents and 3 tasks"):
        env.reset(seed=1)
