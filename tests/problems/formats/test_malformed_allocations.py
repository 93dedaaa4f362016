"""Each error in an allocation is one line with file, place and correction."""

import json
from pathlib import Path
from typing import Any

import pytest

from alloc.problems import Instance, read_allocation
from alloc.problems.formats import read_allocations

from .conftest import the_error

INSTANCE = Instance(name="demo", ability=[1, 2], workload=[3, 4])
ALLOCATIONS = [
    ("", "", "is empty"),
    ("[1]", "", "must be a JSON object"),
    ({}, "format", "must be 'alloc-allocation/1' or 'alloc-result/1'"),
    ({"format": "alloc-instance/1"}, "format", "got 'alloc-instance/1'"),
    ({"format": "alloc-allocation/1"}, "assignment", "is missing"),
    ({"format": "alloc-allocation/1", "assignment": []}, "assignment", "must be a JSON object, got a list"),
    ({"format": "alloc-allocation/1", "assignment": {}, "instance": 4}, "instance", "must be a string, got 4"),
    ({"format": "alloc-allocation/1", "assignement": {}}, "", "did you mean 'assignment'?"),
    ({"format": "alloc-allocation/1", "assignment": {"a9": "t1"}}, "assignment", "no agent 'a9'"),
    ({"format": "alloc-allocation/1", "assignment": {"a1": "t9"}}, "assignment.a1", "no task 't9'"),
    ({"format": "alloc-allocation/1", "assignment": {"a1": 1}}, "assignment.a1", "the id of a task, or null, got 1"),
    ({"format": "alloc-allocation/1", "assignment": {"a1": ["t1"]}}, "assignment.a1", "got a list"),
    ({"format": "alloc-allocation/1", "assignment": {"a1": False}}, "assignment.a1", "got false"),
    ({"format": "alloc-result/1", "status": "no_solution", "assignment": {}}, "status", "contains no allocation"),
    ({"format": "alloc-result/1", "status": "optimal"}, "assignment", "is missing"),
    ('{"format": "alloc-allocation/1", "assignment": {"a1": "t1", "a1": "t2"}}', "assignment", "'a1' occurs twice"),
    ({"format": "alloc-allocation/1", "assignment": {"x\n" * 999: "t1"}}, "assignment", "no agent"),
    ({"format": "alloc-allocation/1", "assignment": {"x\n" * 999: 1}}, None, "got 1"),
    ({"format": "alloc-allocation/1", "assignment": {"a1": "x\n" * 999}}, "assignment.a1", "no task"),
    ({"format": "alloc-allocation/1", "assignment": {"\ud800": "t1"}}, "assignment", "no agent"),
]


@pytest.mark.parametrize(("document", "place", "words"), ALLOCATIONS)
def test_invalid_allocations_are_located(tmp_path: Path, document: Any, place: str | None, words: str) -> None:
    """Errors in an allocation name their place."""
    text = document if isinstance(document, str) else json.dumps(document)
    (tmp_path / "plan.json").write_text(text)
    error = the_error(tmp_path / "plan.json", lambda path: read_allocation(path, INSTANCE))
    assert place is None or error.place == place, str(error)
    assert words in error.message or document == {}


def test_instance_name_of_an_empty_front_is_checked(tmp_path: Path) -> None:
    """The instance name of a front is checked even without any allocation."""
    (tmp_path / "front.json").write_text('{"format": "alloc-pareto/1", "instance": 4, "points": []}')
    error = the_error(tmp_path / "front.json", lambda path: read_allocations(path, INSTANCE))
    assert (error.place, error.message) == ("instance", "must be a string, got 4")
