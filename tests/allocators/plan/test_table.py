"""Rows of a plan: their figures are those of the evaluator."""

import numpy as np
import pytest
from tiny_instances import varied_instance

from alloc.allocators import Result
from alloc.allocators.conclusion import scored_result
from alloc.allocators.plan.table import agent_columns, agent_rows, task_columns, task_rows
from alloc.problems import Allocation, Instance, Units


def fleet(**more: object) -> Instance:
    """Two agents, one of which flies 3 to its task and back, and two tasks."""
    fields: dict[str, object] = {
        "ability": [2, 1],
        "workload": [4, 6],
        "agent_position": [[0, 0], [5, 0]],
        "task_position": [[3, 0], [5, 0]],
        "battery": [20, np.inf],
        "speed": [1.5, np.inf],
        "returns": [True, False],
        "energy_per_distance": 2.0,
    }
    return Instance(**{**fields, **more})  # type: ignore[arg-type]


def planned(instance: Instance, plan: list[int]) -> Result:
    return scored_result(instance, Allocation(plan))


def test_row_of_an_agent_includes_its_whole_flight() -> None:
    """It arrives after the outward flight; distance, energy and battery include the return flight."""
    row, other = agent_rows(planned(fleet(), [0, 1]))
    assert (row.agent, row.task, row.arrival, row.completion_time) == ("a1", "t1", 2.0, 4.0)
    assert (row.distance, row.energy, row.battery, row.battery_left) == (6.0, 12.0, 20.0, 8.0)
    assert (other.arrival, other.distance, other.battery, other.battery_left) == (0.0, 0.0, None, None)


def test_idle_and_infeasible_agents_do_not_fly() -> None:
    """Neither flies; the second has the reason, and is in no group."""
    result = planned(fleet(battery=[5, 9]), [0, -1])
    barred, idle = agent_rows(result)
    assert barred.violation.startswith("energy 12 exceeds the battery 5")
    assert (barred.arrival, barred.distance, barred.battery_left) == (None, 0.0, 5.0)
    assert (idle.task, idle.arrival, idle.battery_left, idle.violation) == (None, None, 9.0, "")
    assert [(row.agents, row.completion_time) for row in task_rows(result)] == [((), None), ((), None)]


@pytest.mark.parametrize("seed", range(40))
def test_rows_sum_to_the_scores(seed: int) -> None:
    """On instances of all kinds, distances and energies of agents and times of tasks equal those of `evaluate`."""
    instance = varied_instance(seed)
    result = planned(instance, np.random.default_rng(seed).integers(-1, instance.m, instance.n).tolist())
    rows, score = agent_rows(result), result.evaluation
    assert score is not None
    assert sum(row.distance for row in rows) == pytest.approx(score.distance)
    assert sum(row.energy for row in rows) == pytest.approx(score.energy)
    assert len([row for row in rows if row.violation]) == len(score.violations)
    times = [np.inf if row.completion_time is None else row.completion_time for row in task_rows(result)]
    assert times == score.completion_time.tolist()
    groups = [name for row in task_rows(result) for name in row.agents]
    assert sorted(groups) == sorted(row.agent for row in rows if row.arrival is not None)


def test_columns_have_units_and_are_informative() -> None:
    """Headings have the units of the instance; columns that are constant by definition are omitted."""
    units = Units(time="h", distance="km", energy="kWh", work="m2")
    headings = [column.heading for column in agent_columns(fleet(units=units))]
    assert headings == [
        "agent", "task", "arrival (h)", "finish (h)", "distance (km)", "energy (kWh)", "battery left (kWh)",
    ]  # fmt: skip
    plain = Instance(ability=[1], workload=[1, 2])
    assert [column.heading for column in agent_columns(plain)] == ["agent", "task", "finish"]
    assert [column.heading for column in task_columns(plain)] == ["task", "workload", "finish", "agents", "group"]
    assert "priority" in [column.heading for column in task_columns(fleet(priority=[1, 2]))]


def test_rows_name_the_bases_of_return() -> None:
    """The flight ends at the named base; the column exists only if some agent returns to a base."""
    instance = fleet(bases={"harbour": (3, 4)}, return_base=[0, -1])
    row, other = agent_rows(planned(instance, [0, 1]))
    assert (row.returns_to, row.distance, row.arrival) == ("harbour", 3 + 4, 2.0)
    assert other.returns_to is None
    assert agent_rows(planned(fleet(), [0, 1]))[0].returns_to == "start"
    assert "returns to" in [column.heading for column in agent_columns(instance)]
    assert "returns to" not in [column.heading for column in agent_columns(fleet())]


def test_selected_rows_match_all_rows() -> None:
    """Rows of selected agents and tasks equal those among all."""
    result = planned(fleet(), [0, 1])
    assert agent_rows(result, np.array([1])) == agent_rows(result)[1:]
    assert task_rows(result, np.array([1])) == task_rows(result)[1:]
