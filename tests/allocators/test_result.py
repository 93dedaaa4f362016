"""What is derived from scores and bounds, and the format."""

import json

import pytest

from alloc.allocators import Result, Status, StopReason
from alloc.allocators.contract.tolerance import relative_gap
from alloc.problems import Allocation, Instance, Objective, evaluate


def result(tasks: list[int], bound: float | None, energy_bound: float | None = None, goal: str = "makespan") -> Result:
    instance = Instance(
        ability=[3, 2, 1], workload=[4, 2], task_position=[[0, 0], [1, 0]], start_task=[0, 0, 0], name="three"
    )
    allocation = Allocation(tasks)
    return Result(
        instance=instance,
        method="test",
        objective=Objective(goal),
        seed=4,
        allocation=allocation,
        evaluation=evaluate(instance, allocation),
        lower_bound=bound,
        energy_lower_bound=energy_bound,
        stop_reason=StopReason.FINISHED,
        runtime_s=0.5,
        trace=(),
    )


@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        (([0, 1, 0], 1.0), Status.OPTIMAL),
        (([0, 1, 0], 1 - 5e-7), Status.OPTIMAL),
        (([0, 1, 0], 1 - 5e-6), Status.FEASIBLE),
        (([0, 1, 0], None), Status.FEASIBLE),
        (([0, 0, 0], None), Status.INFEASIBLE),
        (([0, 1, 0], 1.0, None, "makespan-energy"), Status.FEASIBLE),
        (([0, 1, 0], 1.0, 0.5, "makespan-energy"), Status.FEASIBLE),
        (([0, 1, 0], 1.0, 1.0, "makespan-energy"), Status.OPTIMAL),
        (([0, 1, 0], 0.9, 1.0, "makespan-energy"), Status.FEASIBLE),
    ],
)
def test_status(arguments: tuple, status: Status) -> None:
    """Optimal takes a proof of every stage of the objective, to 1e-6."""
    assert result(*arguments).status is status


def test_gaps() -> None:
    """(value - bound) / value, 0 where nothing is left to gain, none where there is nothing to compare."""
    assert relative_gap(2.0, 1.5) == 0.25
    assert relative_gap(0.0, 0.0) == 0.0
    assert relative_gap(1.0, 1.1) == 0.0
    assert result([0, 1, -1], 1.0).gap == pytest.approx(0.25)
    assert result([0, 0, 0], 1.0).gap is None


def test_format() -> None:
    """Every field of the format is there, every agent is assigned, and it is plain JSON."""
    document = result([0, 1, -1], 1.0).to_dict()
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["assignment"] == {"a1": "t1", "a2": "t2", "a3": None}
    assert (document["format"], document["instance"], document["status"]) == ("alloc-result/1", "three", "feasible")
    assert (document["makespan"], document["distance"]) == (pytest.approx(4 / 3), 1.0)
    fields = """format method objective instance seed status stop_reason makespan served_makespan lower_bound gap energy
    energy_lower_bound energy_gap distance battery_remaining_percent reward unserved_tasks violations runtime_s
    assignment trace"""
    assert set(fields.split()) <= set(document)


def test_unserved_tasks_have_names() -> None:
    """Tasks are told by id, and the makespan is null."""
    document = result([0, 0, 0], None).to_dict()
    assert document["unserved_tasks"] == ["t2"]
    assert (document["makespan"], document["gap"]) == (None, None)
    assert document["served_makespan"] == pytest.approx(4 / 6)
