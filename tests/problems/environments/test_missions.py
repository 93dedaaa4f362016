"""Missions as PettingZoo and Gymnasium environments."""

import re
import warnings

import numpy as np
import pytest

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")

import gymnasium
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import api_test, render_test, seed_test
from pettingzoo.test.state_test import test_state as check_state
from pettingzoo.test.state_test import test_state_space as check_state_space

from alloc.allocators import simulate
from alloc.problems import InputError, Instance, Mission, MissionParameters, Radio, random_mission
from alloc.problems.environments import MissionEnv, MissionFleetEnv
from alloc.problems.environments.missions.observation import AGENT_FIGURES, OWN_FIGURES, TASK_FIGURES
from alloc.problems.environments.missions.truth import AGENT_TRUTHS, TASK_TRUTHS

SMALL = MissionParameters(family="failures", agents=3, tasks=4, sensing=0.3)
KINDS = ("steady", "waves", "failures", "recharging", "growth", "deadlines", "silence")


def drawn(rng: np.random.Generator) -> Mission:
    """Return a mission of any family, of 3 agents and 4 tasks."""
    family = KINDS[int(rng.integers(len(KINDS)))]
    return random_mission(MissionParameters(family=family, agents=3, tasks=4), int(rng.integers(2**31)))


def agents(**options) -> MissionEnv:
    return MissionEnv(drawn, **options)


def fleet(**options) -> MissionFleetEnv:
    return MissionFleetEnv(drawn, **options)


@pytest.fixture
def street() -> Mission:
    """Agents at 0 and 9, speed 1, sensing radius 2, no radio; tasks at 1, 5 and 8, the last from hour 1 on."""
    instance = Instance(
        ability=[1, 2],
        workload=[2, 4, 6],
        agent_position=[[0, 0], [9, 0]],
        task_position=[[1, 0], [5, 0], [8, 0]],
        speed=[1, 1],
        battery=[4, 40],
        energy_per_distance=1.0,
        priority=[1, 2, 1],
    )
    return Mission(
        instance, appears=[0, 0, 1], knowledge="local", sensing=2, radio=Radio(radius=0, period=0.5), horizon=20
    )


@pytest.mark.parametrize("options", [{}, {"switching": True, "grid": 0, "max_steps": 40}, {"knowledge": "full"}])
def test_agents_pass_the_pettingzoo_tests(options) -> None:
    """The project's tests of interface and seeds pass; observations with a mask are as in its classic games."""
    with warnings.catch_warnings():  # which it has for all but the names of its own such games
        warnings.filterwarnings("ignore", "Observation is not a NumPy array")
        warnings.filterwarnings("ignore", "Observation space for each agent probably should be")
        api_test(agents(**options), num_cycles=100)
    seed_test(lambda: agents(**options), num_cycles=50)


@pytest.mark.parametrize("options", [{}, {"switching": True, "max_steps": 20}])
def test_fleet_passes_the_gymnasium_check(options) -> None:
    """The project's test of interface and seeds passes, without a warning."""
    gymnasium.register("alloc/fleet-v0", fleet)
    try:
        check_env(gymnasium.make("alloc/fleet-v0", **options).unwrapped)
    finally:
        del gymnasium.registry["alloc/fleet-v0"]


def test_fleet_passes_the_stable_baselines3_check() -> None:
    """So does that of Stable-Baselines3."""
    pytest.importorskip("stable_baselines3.common.env_checker").check_env(fleet(), warn=True)


def test_state_and_rendering_pass_the_pettingzoo_tests(capsys) -> None:
    """The project's tests of the state and of rendering pass, and text is printed for people."""
    env = agents()
    check_state_space(env)
    check_state(env, num_cycles=20)
    render_test(agents)
    assert re.match(r"hour 0: 0 of 4 tasks done\nagent a1: (idle|absent) at ", capsys.readouterr().out)  # drawn anew
    for shown in (agents(render_mode="human"), fleet(render_mode="human")):
        shown.reset(seed=0)
        shown.step(0)
        assert capsys.readouterr().out.count("hour 0: 0 of 4 tasks done\n") == 2
    with pytest.raises(InputError, match="render_mode: must be one of human, ansi, got 'rgb'"):
        fleet(render_mode="rgb")


def test_state_is_the_full_state(street: Mission) -> None:
    """The state includes what no agent sees, but not the future task; the text agrees."""
    for env in (MissionEnv([street], grid=0, render_mode="ansi"), MissionFleetEnv([street], render_mode="ansi")):
        env.reset(seed=0)
        state = env.state()
        ann, ben = state[1 : 1 + 2 * AGENT_TRUTHS].reshape(2, AGENT_TRUTHS)
        tasks = state[1 + 2 * AGENT_TRUTHS :].reshape(3, TASK_TRUTHS)
        assert ann.tolist() == pytest.approx([1, 0, 0, *[0] * 6, np.log(1 + 4 / 9), np.log(2)])
        assert ben[3] == ben[6] == pytest.approx(1)
        assert tasks[1].tolist() == pytest.approx([1, 0, 5 / 9, 0, 0, np.log(5), 0, np.log(3), 10, 0])
        assert not tasks[2].any()
        env.step(0)
        assert env.state()[1 + 6] == pytest.approx(1 / 9)  # where its order leads
        assert env.render() == (
            "hour 0: 0 of 3 tasks done\n"
            "agent a1: flying at 0, 0, 0, order t1, battery 4\nagent a2: idle at 9, 0, 0, battery 40\n"
            "task t1: 2 left\ntask t2: 4 left\n"
        )


def play(env: MissionEnv, choose) -> dict[str, float]:
    """Play a mission to its end by a function of mask and observation; return the sum of each agent's rewards."""
    total = dict.fromkeys(env.possible_agents, 0.0)
    for agent in env.agent_iter():
        seen, reward, ended, cut, _ = env.last()
        total[agent] += reward
        env.step(None if ended or cut else choose(seen["action_mask"], seen["observation"]))
    return total


def test_observations_are_in_their_space_and_rewards_add_up() -> None:
    """Observations are within bounds; an agent's rewards are the common ones from its first turn on."""
    env = agents(energy_weight=0.1)
    rng = np.random.default_rng(0)
    for seed in range(5):
        env.reset(seed=seed)
        space, first = env.observation_space("agent_0"), env.agent_selection

        def choose(mask, figures, space=space):
            assert space.contains({"observation": figures, "action_mask": mask})
            return int(rng.choice(np.flatnonzero(mask)))

        total = play(env, choose)
        assert total[first] == pytest.approx(env._course._value_so_far(), abs=1e-9)


def test_agent_knows_what_it_sees(street: Mission) -> None:
    """It sees the task at distance 1, not those at 5 and 8, nor the other agent; its action mask agrees."""
    env = MissionEnv([street], grid=0)
    env.reset(seed=0)
    assert env.agent_selection == "agent_0"
    seen = env.last()[0]
    tasks = seen["observation"][OWN_FIGURES : OWN_FIGURES + 3 * TASK_FIGURES].reshape(3, TASK_FIGURES)
    others = seen["observation"][-2 * AGENT_FIGURES :].reshape(2, AGENT_FIGURES)
    assert tasks[0, :5].tolist() == pytest.approx([1, 1, 1, 0, 1 / 9])
    assert tasks[0, 7:9].tolist() == pytest.approx([np.log(2), np.log(3)])  # an hour of flight, two of work
    assert not tasks[1:].any()
    assert not others.any()
    assert seen["action_mask"].tolist() == [1, 0, 0, 1]
    assert seen["observation"][3] == pytest.approx(4 / 9)  # of a flight through the whole area


def test_exploration_targets_are_within_battery(street: Mission) -> None:
    """Of the places at 1.5, 4.5 and 7.5 the first agent, with energy for 4, can fly to the first only."""
    env = MissionEnv([street], grid=3)
    env.reset(seed=0)
    assert env.last()[0]["action_mask"][3:6].tolist() == [1, 0, 0]
    env.step(3)
    assert env._course._simulation.state.agents[0].flight.goal.position == (1.5, 0, 0)


def test_mission_matches_hand_calculation(street: Mission) -> None:
    """The first agent does its task from hour 1 to 3, the second flies 1 and works 3 hours: rewards are these."""
    env = MissionEnv([street], grid=0, waiting_weight=0.0, energy_weight=1.0)
    env.reset(seed=0)
    env.step(0)
    assert env.agent_selection == "agent_1"
    assert env.last()[0]["action_mask"].tolist() == [0, 0, 0, 1]  # the task at 8 is to come
    env.step(3)
    hours = [env.infos["agent_1"]["hour"]]
    while env.last()[0]["action_mask"][2] == 0:
        env.step(3)
        hours.append(env.infos["agent_1"]["hour"])
    assert hours == [0.5, 1.0]
    env.step(2)
    assert (env.infos["agent_0"]["hour"], env.agent_selection) == (3.0, "agent_0")
    _, reward, _, _, info = env.last()
    assert (info["tasks_done"], info["illegal"]) == (1, False)
    # a quarter of the priority, and two flights of 1 out of one of 9 for each
    assert reward == pytest.approx(1 / 4 - 2 / 18)


def test_no_information_leaks(street: Mission) -> None:
    """Observations do not depend on anything outside the sensing radius that was not reported."""
    seen = []
    for work in (4, 400):
        changed = Mission(
            Instance(
                **{
                    name: getattr(street.instance, name)
                    for name in ("ability", "agent_position", "task_position", "speed", "battery", "priority")
                },
                energy_per_distance=1.0,
                workload=[2, work, 6],
            ),
            appears=street.appears,
            knowledge="local",
            sensing=2,
            radio=street.radio,
            horizon=20,
        )
        env = MissionEnv([changed], grid=0)
        env.reset(seed=0)
        seen.append(env.last()[0]["observation"])
    np.testing.assert_equal(*seen)


def test_fleet_actions_match_a_policy() -> None:
    """Sending each free agent to the nearest feasible task gives the result of `nearest` with full knowledge."""
    mission = random_mission(SMALL, 5)
    env = MissionFleetEnv([mission])
    env.reset(seed=0)
    instance, over, info = mission.instance, False, {}
    while not over:
        agent, can = env._agent, np.flatnonzero(env.action_masks()[:-1])
        view = env._course.view(agent)
        away = [view.distance(view.own, view.tasks[instance.task_ids[task]]) for task in can]
        action = can[int(np.argmin(away))] if len(can) else instance.m
        _, _, over, _, info = env.step(np.int64(action))
    result = simulate(mission, "nearest", knowledge="full").result
    assert (info["mission_time"], info["energy"]) == (pytest.approx(result.mission_time), pytest.approx(result.energy))


def test_illegal_actions_change_nothing(street: Mission) -> None:
    """Masked actions change nothing; the fleet gets the illegal reward, and infos say so."""
    env = MissionFleetEnv([street], illegal_reward=-1.0)
    env.reset(seed=0)
    _, reward, *_, info = env.step(np.int64(1))  # at 5, beyond the first agent's battery
    assert (reward, info["illegal"], info["agent"]) == (-1.0, True, 1)
    local = MissionEnv([street])
    local.reset(seed=0)
    local.step(2)
    assert (local.infos["agent_0"]["illegal"], local.infos["agent_1"]["illegal"]) == (True, False)
    assert local._course._simulation.state.agents[0].order.task is None


def test_wrong_use_is_refused(street: Mission) -> None:
    """Missions of different sizes, or without a decision, are one clear error."""
    with pytest.raises(InputError, match="missions of equal size"):
        MissionEnv([street, random_mission(SMALL, 1)])
    with pytest.raises(InputError, match="missions of equal size, got none"):
        MissionFleetEnv([])
    nothing = Mission(Instance(ability=[1], workload=[0]))
    with pytest.raises(InputError, match="is over before the first decision"):
        MissionFleetEnv([nothing]).reset(seed=0)
