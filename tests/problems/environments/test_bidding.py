"""The Gymnasium environment."""

import numpy as np
import pytest

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")

from boards import EXTREMES
from gymnasium.utils.env_checker import check_env

from alloc.problems import Allocation, Family, InputError, Instance, evaluate, paper_like, random_instance
from alloc.problems.environments import BiddingEnv
from alloc.problems.game import PAPER, Reward, Rules, utility


def small(**options) -> BiddingEnv:
    return BiddingEnv([paper_like(8, 3, 30, seed) for seed in range(3)], **options)


def made() -> BiddingEnv:
    """An environment with random ranges, batteries and places, new at each reset."""
    family = Family(agents=6, tasks=4, starts="own", communication_range=(0.2, 0.8), battery=(0.5, 3.0))
    return BiddingEnv(lambda rng: random_instance(family, int(rng.integers(2**31))))


@pytest.fixture
def street() -> Instance:
    """Tasks at 0 and 3; two agents of ability 1 and 2 begin at the first."""
    return Instance(ability=[1, 2], workload=[1, 2], task_position=[[0, 0], [3, 0]], start_task=[0, 0], battery=[6, 12])


@pytest.mark.parametrize("make", [small, made])
def test_passes_the_gymnasium_check(make) -> None:
    """The project's test of interface and seeds passes, without a warning; there is nothing to render."""
    check_env(make(), skip_render_check=True)


@pytest.mark.parametrize("make", [small, made])
def test_passes_the_stable_baselines3_check(make) -> None:
    """So does that of Stable-Baselines3."""
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(make(), warn=True)


@pytest.mark.parametrize("name", EXTREMES)
def test_observations_are_in_their_space(name: str) -> None:
    """Observations are within their bounds and rewards finite, also for extreme numbers."""
    for reward in Reward:
        env = BiddingEnv([EXTREMES[name]], rules=Rules(reward=reward, flying=True))
        seen, _ = env.reset(seed=0)
        over = False
        while not over:
            assert env.observation_space.contains(seen)
            seen, gained, ended, cut, _ = env.step(env.action_space.sample(env.action_masks().astype(np.int8)))
            assert np.isfinite(gained)
            over = ended or cut


def test_game_matches_hand_calculation(street: Instance) -> None:
    """The second agent flies 3 to the second task, then the planner stops: both tasks take an hour, for 3 of energy."""
    env = BiddingEnv([street], energy_weight=0.0)
    env.reset(seed=0)
    assert env.action_masks().tolist() == [False, True, True, False, True, True, True]
    _, reward, ended, cut, info = env.step(np.int64(4))
    # before: short by 2 of 3 in total, by all of it on average over two, and at the worst
    assert reward == pytest.approx(4 * 2 / 3 + 2 / 2 + 1)
    assert (ended, cut) == (False, False)
    assert info == {"episode_energy": pytest.approx(3), "episode_battery": pytest.approx(100 * (1 + 0.75) / 2),
                    "illegal": False}  # fmt: skip
    assert env.action_masks().tolist() == [False, True, True, False, False, True, True]
    _, reward, ended, cut, info = env.step(np.int64(6))
    assert (reward, ended, cut) == (0, True, False)
    assert not env.action_masks().any()
    scores = evaluate(street, Allocation([0, 1]))
    assert (info["makespan"], info["unserved"], info["energy"]) == (scores.makespan, 0, scores.energy) == (1, 0, 3)


def test_illegal_actions_change_nothing(street: Instance) -> None:
    """Staying is not a bid: it uses up a step and gives the illegal reward."""
    env = BiddingEnv([street], illegal_reward=-0.1, max_steps=2)
    before, _ = env.reset(seed=0)
    seen, reward, ended, cut, info = env.step(np.int64(0))
    np.testing.assert_equal(seen, before)
    assert (reward, ended, cut, info["illegal"]) == (-0.1, False, False, True)
    assert env.step(np.int64(0))[3]


@pytest.mark.parametrize("rules", [Rules(), Rules(reward="coverage"), Rules(flying=True, returning=True)])
def test_rewards_sum_to_the_increase_of_utility(rules: Rules) -> None:
    """Rewards of any episode sum to the increase of the utility."""
    env = BiddingEnv([paper_like(8, 3, 30, 1)], rules=rules)
    env.reset(seed=0)
    env.action_space.seed(0)
    before, total, over = utility(env._game.board, env._state, rules).item(), 0.0, False
    while not over:
        _, reward, ended, cut, _ = env.step(env.action_space.sample(env.action_masks().astype(np.int8)))
        total, over = total + reward, ended or cut
    after = utility(env._game.board, env._state, rules).item()
    assert total == pytest.approx(after - before, abs=1e-3 * (1 + abs(before) + abs(after)))


def test_same_seed_gives_same_games() -> None:
    """The seed determines the sequence of instances; other seeds give other ones."""

    def games(seed: int) -> list[float]:
        env = made()
        return [float(seen.sum()) for seen, _ in [env.reset(seed=seed)] + [env.reset() for _ in range(3)]]

    assert games(1) == games(1)
    assert len({*games(1), *games(2)}) == 8


def test_wrong_use_is_refused() -> None:
    """Simultaneous rules are an error that names the other environment."""
    with pytest.raises(InputError, match="SimultaneousEnv"):
        small(rules=PAPER)
