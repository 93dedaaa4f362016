"""Who knows what: sensing, radio, losses, delay, silence."""

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
    """Let everybody tell all up to an hour; return the simulation when orders are due then."""
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


def test_agents_know_what_they_sense():
    """Without radio each agent knows itself and what lies within its sensing radius, as it was when it looked."""
    simulation = told(mission(Radio(radius=0.2)), 0.5)
    assert [known(simulation, name) for name in ("a1", "a2", "a3")] == [{"t1"}, set(), set()]
    assert set(simulation.view("a1").agents) == {"a1"}
    with pytest.raises(TypeError):
        simulation.view("a1").tasks["t9"] = None


def test_news_travels_by_one_radius_a_period():
    """What the first agent sees the second hears at once, the third a period later, with the hour when it was true."""
    radio = Radio(radius=1.0, period=0.5)
    first, later = told(mission(radio), 0.0), told(mission(radio), 0.5)
    assert [known(first, name) for name in ("a1", "a2", "a3")] == [{"t1"}, {"t1"}, set()]
    assert [known(later, name) for name in ("a1", "a2", "a3")] == [{"t1"}, {"t1"}, {"t1"}]
    assert later.view("a2").tasks["t1"].hour == 0.5
    assert later.view("a3").tasks["t1"].hour == 0.0


def test_messages_take_their_delay():
    """With a delay of 0.7 h nothing is known by radio before."""
    radio = Radio(radius=1.0, period=0.5, delay=0.7)
    assert known(told(mission(radio), 0.5), "a2") == set()
    assert known(told(mission(radio), 1.0), "a2") == {"t1"}


def test_the_silent_neither_send_nor_hear():
    """While an agent, or the region where it is, is silent, nobody hears it and it hears nobody."""
    radio = Radio(radius=1.0, period=0.5)
    for where in ({"agent": "a1"}, {"agent": "a2"}, {"center": (1, 0), "radius": 0.5}):
        events = [Event(0, "radio-silent", until=1.2, **where)]
        silent, after = (told(mission(radio, events=events), hour) for hour in (1.0, 1.5))
        assert known(silent, "a2") == set()
        assert known(after, "a2") == {"t1"}


def test_lost_messages_are_as_many_as_said():
    """A share of 0.3 of many messages is lost, and all policies and speakers meet the same losses."""
    radio = Radio(period=0.01, loss=0.3)
    all_speak = told(Mission(LINE, knowledge="local", sensing=0, radio=radio, horizon=9), 8.0)
    heard = [record for record in all_speak.log.records if record["record"] == "message"]
    assert np.mean([len(record["heard"]) for record in heard]) == pytest.approx(2 * 0.7, abs=0.05)
    one_speaks = told(Mission(LINE, knowledge="local", sensing=0, radio=radio, horizon=9), 8.0, speakers=["a2"])
    alone = [record["heard"] for record in one_speaks.log.records if record["record"] == "message"]
    assert alone == [record["heard"] for record in heard if record["agent"] == "a2"]


def test_bursts_have_their_lengths_and_losses():
    """Losses come in runs: after a lost message another is lost far more often than on average."""
    radio = Radio(period=0.05, burst=Burst(good=2.0, bad=1.0, loss_good=0.0, loss_bad=1.0))
    simulation = told(Mission(LINE, knowledge="local", sensing=0, radio=radio, horizon=120), 110.0, speakers=["a1"])
    lost = np.array(["a2" not in record["heard"] for record in simulation.log.records if record["record"] == "message"])
    assert lost.mean() == pytest.approx(1 / 3, abs=0.1)
    assert lost[1:][lost[:-1]].mean() > 0.9


def test_full_knowledge_is_of_the_present():
    """With full knowledge all know what has appeared and who has joined, and nothing that is to come."""
    simulation = Simulation(Mission(LINE, joins=[0, 0, 5], appears=[0, 3]))
    simulation.advance()
    assert set(simulation.view(None).tasks) == {"t1"}
    assert set(simulation.view(None).agents) == {"a1", "a2"}
    simulation.advance()
    assert set(simulation.view(None).tasks) == {"t1", "t2"}


def test_orders_under_local_knowledge_are_for_what_is_known():
    """A task that an agent was not told of it cannot be sent to; to one that is over it flies if it cannot know."""
    simulation = told(mission(Radio(radius=1.0, period=0.5), events=[Event(0.7, "task-cancelled", task="t1")]), 0.5)
    assert simulation.order("a2", Order("t2")) == "the agent does not know the task"
    assert simulation.order("a2", Order("t1")) is None
    while simulation.advance() is not None and simulation.state.hour < 2:
        pass
    report = simulation.view("a2").tasks["t1"]
    assert (report.status, simulation.view("a2").own.task) == (TaskStatus.CANCELLED, None)


def test_chances_are_even():
    """Numbers for keys that follow each other are spread evenly, and differ by each part of the key."""
    drawn = np.array([uniform(1, 2, key) for key in range(2000)])
    assert np.histogram(drawn, bins=10, range=(0, 1))[0].min() > 150
    assert abs(np.corrcoef(drawn[1:], drawn[:-1])[0, 1]) < 0.1
    assert len({uniform(1, 2), uniform(2, 1), uniform(1), uniform(1, 2, 0)}) == 4
