"""Generated missions, snapshots and measures."""

import numpy as np
import pytest

from alloc.problems import (
    Event,
    InputError,
    Instance,
    Mission,
    MissionParameters,
    random_cfstp,
    random_mission,
    snapshot_at,
)
from alloc.problems.missions.files.document import mission_to_document
from alloc.problems.missions.simulation.measures import DecisionTimes, measured
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import Order
from alloc.problems.vocabulary import MissionFamily


@pytest.mark.parametrize("family", MissionFamily)
def test_every_family_is_reproducible(family):
    """The same seed gives the same mission, another seed another one."""
    parameters = MissionParameters(family=family)
    first = mission_to_document(random_mission(parameters, 1))
    assert mission_to_document(random_mission(parameters, 1)) == first
    assert mission_to_document(random_mission(parameters, 2)) | {"name": "", "seed": 1} != first | {"name": ""}


def test_families_have_their_features():
    """Each family has its feature: waves, hot spots, growth, deadlines, failures, recharging or silences."""

    def drawn(family):
        return random_mission(MissionParameters(family=family, agents=20, tasks=60), 3)

    later = drawn("waves").appears
    assert len(set(np.round(later[later > 0], 0))) < 10
    spots = drawn("hot-spots").instance.task_position[30:, :2]
    spread = drawn("steady").instance.task_position[30:, :2]
    assert nearest(spots) < nearest(spread)
    assert (drawn("growth").growth > 0).any()
    assert np.isfinite(drawn("deadlines").deadline).any()
    kinds = {
        family: {str(event.kind) for event in drawn(family).events} for family in ("failures", "recharging", "silence")
    }
    assert kinds["failures"] == {"agent-fails"}
    assert kinds["recharging"] == {"agent-recalled", "agent-returns", "agent-recharges"}
    assert kinds["silence"] == {"radio-silent"}
    assert (drawn("recharging").joins > 0).sum() == 4


def nearest(places):
    """Return the mean distance to the nearest other place."""
    distance = np.linalg.norm(places[:, None] - places, axis=2) + 9 * np.eye(len(places))
    return distance.min(axis=1).mean()


def test_sizes_of_paper_scenarios_are_fixed():
    """Scenarios of the paper have its number of agents, and refuse others."""
    assert random_mission(MissionParameters(family="paper-2"), 0).instance.n == 300
    with pytest.raises(InputError, match="agents: is fixed"):
        random_mission(MissionParameters(family="paper-2", agents=3), 0)


def test_snapshot_has_present_agents_and_open_tasks():
    """A snapshot has the agents that have joined and not failed, and the open tasks with their grown work."""
    instance = Instance(ability=[1, 2, 3], workload=[4, 5, 6], battery=[1, 2, 3])
    mission = Mission(
        instance,
        joins=[0, 5, 0],
        appears=[0, 0, 9],
        growth=[1, 0, 0],
        events=[Event(2, "agent-fails", agent="a3"), Event(1, "agent-recharges", agent="a1", amount=2)],
    )
    early, late = snapshot_at(mission, 1.0), snapshot_at(mission, 3.0)
    assert (early.agent_ids, early.task_ids) == (("a1", "a3"), ("t1", "t2"))
    assert late.agent_ids == ("a1",)
    assert late.workload.tolist() == [7, 5]
    assert late.battery.tolist() == [3]
    assert snapshot_at(Mission(instance, appears=[1, 1, 1]), 0.5) is None


def test_measures_match_hand_calculation():
    """Two tasks of priorities 1 and 3, done after 2 and 4 hours by one agent that flies 2 + 0, have known measures."""
    instance = Instance(
        ability=[1, 1], workload=[1, 2, 5, 9], priority=[1, 3, 2, 2], speed=[1, 1], battery=[8, 4],
        energy_per_distance=2.0, agent_position=[[0, 0], [5, 5]], task_position=[[1, 0], [1, 0], [5, 5], [5, 5]],
    )  # fmt: skip
    mission = Mission(instance, deadline=[np.inf, np.inf, 3, np.inf], horizon=10)
    simulation, orders = Simulation(mission), iter([{"a1": "t1", "a2": "t3"}, {"a1": "t2"}, {"a2": "t4"}])
    while (simulation.advance()) is not None:
        for name, task in next(orders, {}).items():
            simulation.order(name, Order(task))
    result = measured(simulation, "mine", 0, DecisionTimes())
    assert (result.status, result.mission_time) == ("unfinished", None)
    assert (result.tasks_done, result.tasks_missed, result.tasks_left) == (2, 1, 1)
    assert result.priority_done_share == 0.5
    assert result.completion_hours_mean == pytest.approx((2 * 1 + 4 * 3) / 4)
    assert result.completion_hours_p95 == 4
    assert (result.energy, result.distance, result.distance_worst_agent) == (2, 1, 1)
    assert result.battery_remaining_percent == pytest.approx(100 * (0.75 + 1) / 2)
    assert result.work_given_up == pytest.approx(2)  # of t4, which a2 works on from hour 3 to 10
    assert result.mission_time_lower_bound == 8.5


def test_cfstp_has_the_distribution_of_its_benchmark():
    """A 50 x 50 grid, deadlines from 5 to 600, workloads from 10 to 50, identical agents; reproducible by seed."""
    mission = random_cfstp(4, 2000, 7)
    instance = mission.instance
    assert (instance.n, instance.m, instance.metric, mission.horizon) == (4, 2000, "manhattan", np.inf)
    for values, low, high in (
        (instance.task_position[:, :2], 0, 49),
        (mission.deadline, 5, 600),
        (instance.workload, 10, 50),
    ):
        assert (values.min(), values.max()) == (low, high)
        assert (values == values.round()).all()
    assert set(instance.ability) == set(instance.speed) == {1.0}
    assert mission_to_document(random_cfstp(4, 2000, 7)) == mission_to_document(mission)
    assert mission_to_document(random_cfstp(4, 2000, 8)) != mission_to_document(mission)
