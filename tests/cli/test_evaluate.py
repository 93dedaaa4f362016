import json
from pathlib import Path

import pytest

from alloc.problems import Allocation, evaluate


def write(assignment, name="small"):
    document = {"format": "alloc-allocation/1", "instance": name, "assignment": assignment}
    Path("answer.json").write_text(json.dumps(document))


def test_scores_are_those_of_the_evaluator(alloc, small):
    """`alloc evaluate --json` prints the evaluator's scores, and the same per task."""
    assignment = {"a1": "t1", "a4": "t2", "a5": "t3", "a2": None}
    write(assignment)
    ran = alloc("evaluate", "small.json", "answer.json", "--json")
    score = evaluate(small, Allocation.from_ids(small, assignment))
    assert ran.code == 0
    assert ran.json["makespan"] == score.makespan
    assert ran.json["energy"] == score.energy
    assert [entry["completion_time"] for entry in ran.json["tasks"]] == score.completion_time.tolist()
    assert [entry["agents"] for entry in ran.json["tasks"]] == [1, 1, 1]


def test_unserved_tasks_give_exit_code_1(alloc, small):
    """A task without an agent is no completion time, and exit code 1."""
    write({"a1": "t1"})
    ran = alloc("evaluate", "small.json", "answer.json", "--json")
    assert ran.code == 1
    assert ran.json["unserved_tasks"] == ["t2", "t3"]
    assert ran.json["tasks"][1]["completion_time"] is None


def test_violations_give_exit_code_1(alloc, unservable):
    """An agent where it cannot go is named, with the reason, and does not count."""
    write({"a1": "t1", "a2": "t2"}, "unservable")
    ran = alloc("evaluate", "unservable.json", "answer.json")
    assert ran.code == 1
    assert "agent a2 cannot take task t2: the agent may not do this task" in ran.err
    assert alloc("evaluate", "unservable.json", "answer.json", "--json").json["tasks"][1]["agents"] == 0


@pytest.mark.parametrize("words", ["task", "t2", "workload", "done at (h)", "Last: task"])
def test_table_names_tasks(alloc, small, words):
    """People get a table with a row per task, and what holds the makespan up."""
    write({"a1": "t1", "a4": "t2", "a5": "t3"})
    ran = alloc("evaluate", "small.json", "answer.json")
    assert ran.out == ""
    assert words in ran.err


def test_result_from_standard_input(alloc, small):
    """A result of `alloc solve` is accepted in place of an allocation, from standard input too."""
    result = alloc("solve", "small.json", "--method", "greedy", "--json")
    ran = alloc("evaluate", "small.json", "-", "--json", stdin=result.out)
    assert ran.json["makespan"] == result.json["makespan"]
