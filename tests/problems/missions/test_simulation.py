"""The reference simulation: conservation laws on random missions, and small missions with a known course."""

import numpy as np
import pytest
from drawn_missions import missions, random_mission_of_any_kind, run_wildly
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import instances

from alloc.problems import Allocation, DistanceTable, Event, Instance, Mission, Pace, evaluate
from alloc.problems.changes.remove import replaced
from alloc.problems.missions.simulation import conservation
from alloc.problems.missions.simulation.agenda import Wanted
from alloc.problems.missions.simulation.conservation import ConservationError
from alloc.problems.missions.simulation.motion import pace_factor, place_at
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import STAY, Order, TaskStatus

ONE = Instance(
    ability=[2.0], workload=[6.0], agent_position=[[0, 0]], task_position=[[4, 0]], speed=[2.0], battery=[9.0]
)


def run(mission, orders, **options):
    """Simulate a mission; `orders` maps an hour to orders by agent, given at the first request at or after it."""
    simulation, left = Simulation(mission, **options), sorted(orders.items())
    while (request := simulation.advance()) is not None:
        while request.wanted is Wanted.ORDERS and left and left[0][0] <= request.hour:
            for name, order in left.pop(0)[1].items():
                assert simulation.order(name, order) is None
    return simulation


@given(missions(), st.integers(0, 100))
@settings(max_examples=40, deadline=None)
def test_work_and_energy_are_conserved(mission, seed):
    """Under random orders, all work and energy is accounted for at every event and at the end."""
    state = run_wildly(mission, seed).state
    conservation.check(state)
    for task in state.tasks:
        total = task.left + task.done + task.cancelled + task.missed
        assert task.appeared + task.grown == pytest.approx(total, rel=1e-9)
    for agent in state.agents:
        if np.isfinite(agent.capacity):
            assert agent.capacity - agent.battery == pytest.approx(agent.energy, rel=1e-9, abs=1e-9 * agent.capacity)
            assert agent.battery >= -1e-9 * max(1, agent.capacity)


def test_inconsistent_ledgers_are_detected():
    """Inconsistent work, energy, places and deadlines are each an error."""
    breaks = {
        "appeared or grew": lambda state: setattr(state.tasks[0], "done", 99.0),
        "battery of 'a1' lost": lambda state: setattr(state.agents[0], "battery", 1.0),
        "flew": lambda state: setattr(state.agents[0], "distance", 7.0),
        "is idle and has a task": lambda state: setattr(state.agents[0], "task", state.tasks[0]),
        "an agent works at 't1', which is done": lambda state: state.tasks[0].workers.update({0: state.agents[0]}),
    }
    for words, breaks_it in breaks.items():
        simulation = run(Mission(ONE), {0.0: {"a1": Order("t1")}})
        breaks_it(simulation.state)
        with pytest.raises(ConservationError, match=words):
            conservation.check(simulation.state)


@given(instances(speeds=True), st.randoms(use_true_random=False))
@settings(max_examples=40, deadline=None)
def test_mission_without_events_matches_the_evaluator(instance, random):
    """With full knowledge and one task per agent, completion times and energy are those of `evaluate`."""
    allows = instance.reach.mask[instance.reach.origin]
    task = [random.choice([-1, *np.flatnonzero(row).tolist()]) for row in allows]
    score = evaluate(instance, Allocation(task))
    names = zip(instance.agent_ids, task, strict=True)
    orders = {name: Order(instance.task_ids[goal]) for name, goal in names if goal >= 0 and instance.workload[goal] > 0}
    state = run(Mission.from_instance(instance), {0.0: orders}).state
    done = [one.closed if one.status is TaskStatus.DONE else np.inf for one in state.tasks]
    unserved = np.isin(np.arange(instance.m), score.unserved_tasks)
    expected = np.where(unserved, np.inf, score.completion_time)
    np.testing.assert_allclose(done, expected, rtol=1e-9)
    if len(orders) == sum(goal >= 0 for goal in task):  # nobody flies to a task that is done from the start
        assert sum(agent.energy for agent in state.agents) == pytest.approx(score.energy, rel=1e-9)


@pytest.mark.parametrize("metric", ["euclidean", "manhattan", "geographic"])
def test_agents_are_diverted_in_flight(metric):
    """An agent diverted halfway to a task has flown half the distance, and flies on from its present place."""
    instance = Instance(
        ability=[1], workload=[5, 5], agent_position=[[0, 0]], task_position=[[1, 1], [0, 1]], speed=[1], metric=metric
    )
    far = instance.reach.distance[0, 0]
    mission = Mission(instance, events=[Event(far / 2, "task-changes", task="t2", workload=1)])
    simulation = Simulation(mission)
    orders = iter(["t1", "t2"])
    while (request := simulation.advance()) is not None:
        if (task := next(orders, None)) is not None:
            simulation.order("a1", Order(task))
            assert simulation.state.agents[0].distance == pytest.approx(request.hour, rel=1e-9)
            middle = place_at(simulation.state, simulation.state.agents[0]).position
    second = simulation.state.distances.by_metric(middle, (0.0, 1.0, 0.0))
    assert simulation.state.agents[0].distance == pytest.approx(far / 2 + second, rel=1e-9)
    assert simulation.state.switches == 1


def test_agents_with_given_distances_are_diverted_at_the_end_of_a_flight():
    """With own distances, an agent in flight first completes that flight, and goes on from there without working."""
    distances = [("a1", "t1", 2), ("t1", "t2", 3), ("a1", "t2", 9)]
    instance = Instance(ability=[1], workload=[5, 4], speed=[1], distances=distances)
    mission = Mission(instance, events=[Event(1, "task-changes", task="t1", workload=5)])
    state = run(mission, {0: {"a1": Order("t1")}, 1: {"a1": Order("t2")}, 9: {"a1": Order("t1")}}).state
    assert [task.closed for task in state.tasks] == [17.0, 9.0]
    assert state.agents[0].distance == 8


def test_infeasible_flights_are_refused():
    """Battery, range, skills, allowed tasks and the flight home are each a reason to refuse, also in flight."""
    cases = {
        "battery 3": {"battery": [3.0]},
        "range 3": {"communication_range": [3.0]},
        "not all skills": {"needs": [["lift"]]},
        "may not do": {"allowed_tasks": [[]]},
        "takes 8 of energy, battery 7": {"battery": [7.0], "returns": [True]},
        "no way": {"distances": DistanceTable.of([], ["a1"], ["t1"], "unreachable")},
    }
    for words, fields in cases.items():
        base = {"ability": [1], "workload": [2], "agent_position": [[0, 0]], "task_position": [[4, 0]], "speed": [1]}
        simulation = Simulation(Mission(Instance(**base | fields)))
        simulation.advance()
        assert words in simulation.order("a1", Order("t1"))
        assert simulation.state.agents[0].flight is None
        assert simulation.log.records[-1]["record"] == "refused"


def test_growth_ends_when_an_agent_works():
    """Work grows from appearance until the first agent arrives, and no longer grows when it leaves."""
    mission = Mission(
        ONE,
        growth=[1.0],
        appears=[1.0],
        events=[Event(5.0, "agent-recalled", agent="a1"), Event(7.0, "agent-returns", agent="a1")],
    )
    state = run(mission, {1: {"a1": Order("t1")}, 7: {"a1": Order("t1")}}).state
    assert state.tasks[0].grown == 2.0  # hours 1 to 3, in which it flies
    assert state.tasks[0].closed == 9.0  # 8 of work at 2 per hour from hour 3, without hours 5 to 7


def test_coalitions_can_change_during_work():
    """An agent that arrives later helps from then on; one that fails no longer does."""
    instance = Instance(
        ability=[1, 2], workload=[10], agent_position=[[0, 0], [2, 0]], task_position=[[0, 0]], speed=[1, 1]
    )
    mission = Mission(instance, events=[Event(4, "agent-fails", agent="a2")])
    state = run(mission, {0: {"a1": Order("t1"), "a2": Order("t1")}}).state
    assert state.tasks[0].closed == pytest.approx(6.0)  # 2 alone, then 2 hours of 3, then 2 alone


def test_completions_come_before_deadlines_and_events_of_the_hour():
    """A task completed exactly at its deadline, or at its cancellation, is done; otherwise it is missed."""
    mission = Mission(ONE, deadline=[5.0])
    assert run(mission, {0: {"a1": Order("t1")}}).state.tasks[0].status is TaskStatus.DONE
    cancelled = Mission(ONE, events=[Event(5.0, "task-cancelled", task="t1")])
    assert run(cancelled, {0: {"a1": Order("t1")}}).state.tasks[0].status is TaskStatus.DONE
    state = run(Mission(ONE, deadline=[4.0]), {0: {"a1": Order("t1")}}).state
    assert (state.tasks[0].status, state.tasks[0].missed, state.tasks[0].done) == (TaskStatus.MISSED, 2.0, 4.0)


def test_simultaneous_events_follow_the_order_of_the_file():
    """Of two changes of the work left at the same hour, the later one in the file counts."""
    for amounts, total in (((9, 3), 3.0), ((3, 9), 9.0)):
        events = [Event(1, "task-changes", task="t1", workload=amount) for amount in amounts]
        simulation = Simulation(Mission(ONE, events=events))
        simulation.advance()
        simulation.advance()
        assert simulation.state.tasks[0].left == total


def test_pace_changes_between_periods():
    """A group works by the factor of each hour, which does not depend on earlier events."""
    mission = Mission(ONE, pace=Pace(0.5, 1.5, 1.0), seed=3)
    task = run(mission, {0: {"a1": Order("t1")}}).state.tasks[0]
    hours = np.diff([2.0, *range(3, int(task.closed) + 1), task.closed])
    factors = [pace_factor(3, 0, period, mission.pace) for period in range(2, 2 + len(hours))]
    assert 2 * np.dot(hours, factors) == pytest.approx(6.0, rel=1e-9)


def test_recharged_agent_can_continue():
    """An agent without energy can take the task once it is recharged."""
    instance = Instance(
        ability=[1], workload=[1], agent_position=[[0, 0]], task_position=[[4, 0]], speed=[1], battery=[1]
    )
    mission = Mission(instance, events=[Event(2, "agent-recharges", agent="a1", amount=3)])
    state = run(mission, {2: {"a1": Order("t1")}}).state
    assert (state.tasks[0].closed, state.agents[0].battery) == (7.0, 0.0)


def test_flights_are_completed_at_the_end():
    """Flights in progress at the horizon count in full, and so do flights home of agents that return."""
    instance = Instance(
        ability=[1, 1], workload=[99, 99], agent_position=[[0, 0]] * 2, task_position=[[4, 0], [0, 3]], speed=[1, 1],
        returns=[False, True],
    )  # fmt: skip
    state = run(Mission(instance, horizon=1), {0: {"a1": Order("t1"), "a2": Order("t2")}}).state
    assert [agent.distance for agent in state.agents] == [4, 6]


def test_agents_return_to_their_base_if_they_have_flown():
    """Flights to a base cost energy; agents that never flew stay, and those that cannot afford it do not depart."""
    instance = Instance(
        ability=[1, 1, 1], workload=[1, 1], agent_position=[[0, 0], [0, 0], [0, 0]], task_position=[[4, 0], [0, 3]],
        speed=[1, 1, 1], battery=[9, 9, 9], energy_per_distance=1.0, return_base=[0, 0, 0], bases={"dock": [4, 3]},
    )  # fmt: skip
    state = run(Mission(instance), {0: {"a1": Order("t1"), "a2": Order("t2")}}).state
    assert [agent.distance for agent in state.agents] == [4 + 3, 3 + 4, 0]
    assert [agent.battery for agent in state.agents] == [2, 2, 9]
    assert [agent.place.position for agent in state.agents] == [(4, 3, 0), (4, 3, 0), (0, 0, 0)]
    weak = replaced(instance, battery=[6.9, 7, 9])
    simulation = Simulation(Mission(weak))
    simulation.advance()
    assert simulation.order("a1", Order("t1")) == "the flight takes 7 of energy, battery 6.9"
    assert simulation.order("a2", Order("t2")) is None


def test_same_seed_gives_the_same_course():
    """Two runs of the same mission under the same orders have the same records."""
    mission = random_mission_of_any_kind(np.random.default_rng(5))
    assert run_wildly(mission, 1).log.records == run_wildly(mission, 1).log.records


def test_stopping_counts_as_a_switch_only_where_work_is_left():
    """Calling an agent off its task is a switch; an agent whose task is done does not switch."""
    mission = Mission(ONE, events=[Event(4, "task-changes", task="t1", workload=5)])
    assert run(mission, {0: {"a1": Order("t1")}, 4: {"a1": STAY}}).state.switches == 1
    assert run(Mission(ONE), {0: {"a1": Order("t1")}}).state.switches == 0
