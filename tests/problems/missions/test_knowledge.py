"""Agents' knowledge: sensing, radio, losses, delay, silence."""

import numpy as np
import pytest

from alloc.problems import Burst, Event, Instance, Mission, Radio
from alloc.problems.missions.chance import uniform
from alloc.problems.missions.simulation.agenda import Wanted
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import Order, TaskStatus

LINE = Instance(
    ability=[1, 1, 1],
    workload=[50, 50],
    agent_position=[[0, 0], [1, 0], [2, 0]],
    task_position=[[0, 0.1], [9, 9]],
    speed=[1, 1, 1],
)
"""Three agents in a row, a task beside the first, and one that is far from all."""


def told(mission, until, seed=0, speakers=None):
    """Let all agents send all messages up to an hour; return the simulation at its request for orders then."""
    simulation = Simulation(mission, seed=seed)
    while (request := simulation.advance()) is not None:
        if request.wanted is Wanted.ORDERS and request.hour >= until:
            break
        if request.wanted is Wanted.MESSAGES:
            for name in request.agents if speakers is None else speakers:
                simulation.send(name, simulation.view(name, is_glance=True).message())
    return simulation


def mission(radio, **options):
    return Mission(LINE, knowledge="local", sensing=0.5, radio=radio, horizon=20, **options)


def known(simulation, agent):
    """Return the tasks that an agent knows."""
    return set(simulation.view(agent).tasks)


def test_agents_know_only_what_they_sense():
    """Without radio, an agent knows itself and what was within its sensing radius when it sensed."""
    simulation = told(mission(Radio(radius=0.2)), 0.5)
    assert [known(simulation, name) for name in ("a1", "a2", "a3")] == [{"t1"}, set(), set()]
    assert set(simulation.view("a1").agents) == {"a1"}
    with pytest.raises(TypeError):
        simulation.view("a1").tasks["t9"] = None


def test_news_travels_one_hop_per_period():
    """What one agent sees, the second hears at once and the third a period later, with the hour of observation."""
    radio = Radio(radius=1.0, period=0.5)
    first, later = told(mission(radio), 0.0), told(mission(radio), 0.5)
    assert [known(first, name) for name in ("a1", "a2", "a3")] == [{"t1"}, {"t1"}, set()]
    assert [known(later, name) for name in ("a1", "a2", "a3")] == [{"t1"}, {"t1"}, {"t1"}]
    assert later.view("a2").tasks["t1"].hour == 0.5
    assert later.view("a3").tasks["t1"].hour == 0.0


def test_messages_are_delayed():
    """With a delay of 0.7 h, nothing is known by radio before."""
    radio = Radio(radius=1.0, period=0.5, delay=0.7)
    assert known(told(mission(radio), 0.5), "a2") == set()
    assert known(told(mission(radio), 1.0), "a2") == {"t1"}


def test_silent_agents_neither_send_nor_receive():
    """While an agent or its region is silent, it neither receives messages nor is it heard."""
    radio = Radio(radius=1.0, period=0.5)
    for where in ({"agent": "a1"}, {"agent": "a2"}, {"center": (1, 0), "radius": 0.5}):
        events = [Event(0, "radio-silent", until=1.2, **where)]
        silent, after = (told(mission(radio, events=events), hour) for hour in (1.0, 1.5))
        assert known(silent, "a2") == set()
        assert known(after, "a2") == {"t1"}


def test_the_loss_rate_is_as_specified():
    """Of many messages, 30 % are lost, and losses do not depend on which other agents send."""
    radio = Radio(period=0.01, loss=0.3)
    all_speak = told(Mission(LINE, knowledge="local", sensing=0, radio=radio, horizon=9), 8.0)
    heard = [record for record in all_speak.log.records if record["record"] == "message"]
    assert np.mean([len(record["heard"]) for record in heard]) == pytest.approx(2 * 0.7, abs=0.05)
    one_speaks = told(Mission(LINE, knowledge="local", sensing=0, radio=radio, horizon=9), 8.0, speakers=["a2"])
    alone = [record["heard"] for record in one_speaks.log.records if record["record"] == "message"]
    assert alone == [record["heard"] for record in heard if record["agent"] == "a2"]


def test_bursts_have_their_lengths_and_losses():
    """Losses are correlated: after a lost message, the next is lost far more often than on average."""
    radio = Radio(period=0.05, burst=Burst(good=2.0, bad=1.0, loss_good=0.0, loss_bad=1.0))
    simulation = told(Mission(LINE, knowledge="local", sensing=0, radio=radio, horizon=120), 110.0, speakers=["a1"])
    lost = np.array(["a2" not in record["heard"] for record in simulation.log.records if record["record"] == "message"])
    assert lost.mean() == pytest.approx(1 / 3, abs=0.1)
    assert lost[1:][lost[:-1]].mean() > 0.9


def test_full_knowledge_excludes_the_future():
    """With full knowledge, agents know all tasks that have appeared and agents that have joined, but not the future."""
    simulation = Simulation(Mission(LINE, joins=[0, 0, 5], appears=[0, 3]))
    simulation.advance()
    assert set(simulation.view(None).tasks) == {"t1"}
    assert set(simulation.view(None).agents) == {"a1", "a2"}
    simulation.advance()
    assert set(simulation.view(None).tasks) == {"t1", "t2"}


def test_orders_under_local_knowledge_need_known_tasks():
    """An agent refuses unknown tasks; it flies to a closed one if it cannot know that it is closed."""
    simulation = told(mission(Radio(radius=1.0, period=0.5), events=[Event(0.7, "task-cancelled", task="t1")]), 0.5)
    assert simulation.order("a2", Order("t2")) == "the agent does not know the task"
    assert simulation.order("a2", Order("t1")) is None
    while simulation.advance() is not None and simulation.state.hour < 2:
        pass
    report = simulation.view("a2").tasks["t1"]
    assert (report.status, simulation.view("a2").own.task) == (TaskStatus.CANCELLED, None)


def test_keyed_random_numbers_are_uniform():
    """Numbers of consecutive keys are uniform, and depend on each part of the key."""
    drawn = np.array([uniform(1, 2, key) for key in range(2000)])
    assert np.histogram(drawn, bins=10, range=(0, 1))[0].min() > 150
    assert abs(np.corrcoef(drawn[1:], drawn[:-1])[0, 1]) < 0.1
    assert len({uniform(1, 2), uniform(2, 1), uniform(1), uniform(1, 2, 0)}) == 4
