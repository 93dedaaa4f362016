"""Results: derived figures, their format, and reading it."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import allocated

from alloc.allocators import MakespanTolerance, Result, Status, StopReason, TracePoint, read_result
from alloc.allocators.contract.tolerance import relative_gap
from alloc.problems import Allocation, InputError, Instance, MissingPackageError, Objective, evaluate


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
def test_status_requires_proof_of_every_stage(arguments: tuple, status: Status) -> None:
    """A result is optimal if every stage of the objective is proven to 1e-6."""
    assert result(*arguments).status is status


def test_gaps_match_the_definition() -> None:
    """(value - bound) / value, 0 if nothing can be gained, none if there is nothing to compare."""
    assert relative_gap(2.0, 1.5) == 0.25
    assert relative_gap(0.0, 0.0) == 0.0
    assert relative_gap(1.0, 1.1) == 0.0
    assert result([0, 1, -1], 1.0).gap == pytest.approx(0.25)
    assert result([0, 0, 0], 1.0).gap is None


def test_document_has_every_field() -> None:
    """Every field of the format is present, every agent is assigned, and it is plain JSON."""
    document = result([0, 1, -1], 1.0).to_dict()
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["assignment"] == {"a1": "t1", "a2": "t2", "a3": None}
    assert (document["format"], document["instance"], document["status"]) == ("alloc-result/1", "three", "feasible")
    assert (document["makespan"], document["distance"]) == (pytest.approx(4 / 3), 1.0)
    fields = """format method objective instance seed status stop_reason makespan served_makespan lower_bound gap energy
    energy_lower_bound energy_gap distance battery_remaining_percent reward unserved_tasks violations runtime_s
    assignment trace"""
    assert set(fields.split()) <= set(document)


def test_unserved_tasks_are_given_by_id() -> None:
    """Unserved tasks are listed by id, and the makespan is null."""
    document = result([0, 0, 0], None).to_dict()
    assert document["unserved_tasks"] == ["t2"]
    assert (document["makespan"], document["gap"]) == (None, None)
    assert document["served_makespan"] == pytest.approx(4 / 6)


@st.composite
def results(draw: st.DrawFn) -> Result:
    """Draw a result of any status, with or without bounds, slack and a trace."""
    instance, allocation = draw(allocated())
    objective = draw(st.sampled_from(Objective))
    found, score = draw(st.sampled_from([(None, None), (allocation, evaluate(instance, allocation))]))
    makespan = None if score is None else score.makespan
    slack = draw(st.sampled_from([0.0, 0.5])) if objective is Objective.MAKESPAN_ENERGY else 0.0
    share = st.sampled_from([0.0, 0.5, 1.0])
    return Result(
        instance=instance,
        method=draw(st.sampled_from(["ga", "milp"])),
        objective=objective,
        seed=draw(st.integers(0, 2**63 - 1)),
        allocation=found,
        evaluation=score,
        lower_bound=None if makespan is None else makespan * draw(share),
        energy_lower_bound=None if makespan is None else score.energy * draw(share),
        stop_reason=draw(st.sampled_from(StopReason)),
        runtime_s=draw(st.floats(0, 1e6)),
        trace=tuple(
            draw(st.lists(st.builds(TracePoint, st.floats(0, 9), st.none() | st.floats(0, 9), st.floats(0, 9))))
        ),
        makespan_limit=None if makespan is None or slack == 0 else (1 + slack) * makespan,
        tolerance=MakespanTolerance(slack),
    )


@given(results())
def test_documents_are_read_back(before: Result) -> None:
    """Writing a result as a document or a JSON text and reading it back gives the same result."""
    for document in (before.to_dict(), json.loads(json.dumps(before.to_dict()))):
        after = Result.from_dict(document, before.instance)
        assert after.to_dict() == before.to_dict()
        assert (after.allocation, after.trace, after.status) == (before.allocation, before.trace, before.status)


def test_files_are_read_back(tmp_path: Path) -> None:
    """A file gives the same result, with a seed too large for a float."""
    path = tmp_path / "result.json"
    before = replace(result([0, 1, -1], 1.0), seed=2**63 - 1)
    path.write_text(json.dumps(before.to_dict()))
    assert read_result(path, before.instance).to_dict() == before.to_dict()


@pytest.mark.parametrize(
    ("field", "value", "place"),
    [
        ("format", "alloc-instance/1", "format"),
        ("status", "optimal", "status"),
        ("status", "good", "status"),
        ("makespan", 1.0, "makespan"),
        ("energy", None, "energy"),
        ("assignment", {"a9": "t1"}, "assignment"),
        ("assignment", None, "assignment"),
        ("lower_bound", "1", "lower_bound"),
        ("lower_bound", float("nan"), "lower_bound"),
        ("seed", 1.5, "seed"),
        ("seed", None, "seed"),
        ("trace", [{"time_s": -1, "makespan": 1, "energy": 1}], "trace[0].time_s"),
        ("trace", [3], "trace[0]"),
    ],
)
def test_wrong_documents_are_refused(tmp_path: Path, field: str, value: object, place: str) -> None:
    """The error names the wrong field and the file."""
    good = result([0, 1, -1], 1.0)
    document = {**good.to_dict(), field: value}
    with pytest.raises(InputError) as caught:
        Result.from_dict(document, good.instance)
    assert caught.value.place.startswith(place)
    path = tmp_path / "result.json"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"result\.json"):
        read_result(path, good.instance)


def test_result_of_another_instance_is_refused() -> None:
    """A result is refused for an instance on which its allocation has other scores."""
    document = result([0, 1, -1], 1.0).to_dict()
    with pytest.raises(InputError, match=r"makespan: is 1\.33"):
        Result.from_dict(document, Instance(ability=[3, 2, 1], workload=[8, 2]))


def test_str_is_the_summary() -> None:
    """The text has status, makespan and bottleneck, as on the command line."""
    text = str(result([0, 1, -1], 1.0))
    assert text.startswith("three (3 agents, 2 tasks), test: every task is served; optimality is not proven\n")
    assert "makespan  1.33333 (at least 1, gap 25 %)" in text
    assert "Bottleneck: task t1 at 1.33333," in text


def test_table_has_a_row_per_agent() -> None:
    """Task, distance and completion time of each agent; nothing without an allocation."""
    pytest.importorskip("pandas")
    found = result([0, 1, -1], 1.0)
    frame = found.to_frame()
    assert frame["agent"].tolist() == ["a1", "a2", "a3"]
    assert frame["task"].tolist()[:2] == ["t1", "t2"]
    assert frame["distance"].tolist() == [0.0, 1.0, 0.0]
    assert frame["completion_time"].tolist()[:2] == pytest.approx([4 / 3, 1.0])
    unknown = frame.columns[frame.isna().to_numpy()[2]].tolist()
    assert unknown == ["task", "arrival", "completion_time", "returns_to", "battery", "battery_left"]
    assert replace(found, allocation=None, evaluation=None).to_frame().empty


def test_table_needs_pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without pandas the error says what to install."""
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingPackageError, match="pip install pandas"):
        result([0, 1, -1], 1.0).to_frame()
