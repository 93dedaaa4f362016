import json
from pathlib import Path

import pytest

from alloc.problems import Allocation, Instance, evaluate, makespan_lower_bound
from alloc.problems.formats import write_instance


def write(assignment, name="small"):
    document = {"format": "alloc-allocation/1", "instance": name, "assignment": assignment}
    Path("answer.json").write_text(json.dumps(document))


def test_scores_match_the_evaluator(alloc, small):
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
    """A task without an agent has no completion time, and the exit code is 1."""
    write({"a1": "t1"})
    ran = alloc("evaluate", "small.json", "answer.json", "--json")
    assert ran.code == 1
    assert ran.json["unserved_tasks"] == ["t2", "t3"]
    assert ran.json["tasks"][1]["completion_time"] is None


def test_violations_give_exit_code_1(alloc, unservable):
    """An agent that cannot take its task is named with the reason, and does not count."""
    write({"a1": "t1", "a2": "t2"}, "unservable")
    ran = alloc("evaluate", "unservable.json", "answer.json")
    assert ran.code == 1
    assert "agent a2 cannot take task t2: the agent may not do this task" in ran.err
    assert alloc("evaluate", "unservable.json", "answer.json", "--json").json["tasks"][1]["agents"] == 0


@pytest.mark.parametrize("words", ["task", "t2", "workload", "done at", "Bottleneck: task"])
def test_table_names_tasks(alloc, small, words):
    """A table with a row per task and the bottleneck are printed."""
    write({"a1": "t1", "a4": "t2", "a5": "t3"})
    ran = alloc("evaluate", "small.json", "answer.json")
    assert ran.out == ""
    assert words in ran.err


def test_result_from_standard_input(alloc, small):
    """A result of `alloc solve` is accepted in place of an allocation, from standard input too."""
    result = alloc("solve", "small.json", "--method", "greedy", "--json")
    ran = alloc("evaluate", "small.json", "-", "--json", stdin=result.out)
    assert ran.json["makespan"] == result.json["makespan"]


def test_bounds_of_a_result_are_shown(alloc, small):
    """Bounds proven by `solve` are shown by `evaluate`, as JSON and as text."""
    solved = alloc("solve", "small.json", "--method", "cpsat", "--objective", "makespan-energy", "--output", "r.json")
    result = json.loads(Path("r.json").read_text())
    shown = alloc("evaluate", "small.json", "r.json", "--json").json
    assert result["lower_bound"] > makespan_lower_bound(small) + 1e-3
    for field in ("lower_bound", "gap", "energy_lower_bound", "energy_gap"):
        assert shown[field] == result[field]
    ran = alloc("evaluate", "small.json", "r.json")
    for line in solved.err.splitlines():
        if line.startswith(("  makespan", "  energy")) or "at work until then" in line:
            assert line in ran.err


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"workload": [3, 13, 5]}, "its reward is "),
        ({"ability": [5, 2, 1, 8, 4]}, "its reward is "),
        ({"battery": [30] * 5}, "its battery_remaining_percent is "),
        ({"energy_per_distance": 7}, "its energy is "),
        ({"name": "other"}, "it is for another instance"),
        ({"agent_ids": ["a1", "a2", "a3", "a4", "b"]}, "its energy is "),
        (
            {"ability": [5, 2, 1, 8, 3, 9], "start_task": [0, 0, 1, 1, 2, 0], "battery": [20] * 6},
            "it is for another set of agents",
        ),
    ],
)
def test_bounds_of_another_instance_are_left_out(alloc, small, change, words):
    """A bound holds only for its instance: with other agents or scores there is a note instead."""
    assert alloc("solve", "small.json", "--method", "cpsat", "--output", "r.json").code == 0
    own = {"task_position": small.task_position, "start_task": small.start_task, "battery": small.battery}
    ground = {"name": "small", "ability": small.ability, "workload": small.workload, "energy_per_distance": 6, **own}
    other = Instance(**{**ground, **change})
    write_instance(other, "other.json")
    if "agent_ids" in change:
        document = json.loads(Path("r.json").read_text())
        document["assignment"]["b"] = document["assignment"].pop("a5")
        document["energy"] += 1
        Path("r.json").write_text(json.dumps(document))
    ran = alloc("evaluate", "other.json", "r.json", "--json")
    assert f"note: r.json: {words}" in ran.err
    assert ran.err.endswith("; its bounds are left out\n")
    assert ran.json["lower_bound"] == makespan_lower_bound(other)


@pytest.mark.parametrize("bound", ["high", None, True, 1e9, [], 0])
def test_invalid_bounds_are_left_out(alloc, small, bound):
    """Bounds that are not numbers, exceed the makespan, or are weaker, are ignored."""
    assert alloc("solve", "small.json", "--method", "greedy", "--output", "r.json").code == 0
    document = json.loads(Path("r.json").read_text())
    Path("r.json").write_text(json.dumps({**document, "lower_bound": bound}))
    ran = alloc("evaluate", "small.json", "r.json", "--json")
    assert (ran.code, ran.json["lower_bound"]) == (0, makespan_lower_bound(small))
    is_valid = bound is None or bound == 0
    assert ("is no bound on the makespan" in ran.err) == (not is_valid or bound is True)


def test_wrong_scores_in_a_result_are_reported(alloc, small):
    """If agents of a result were moved by hand, the scores in the file and the true ones are reported."""
    assert alloc("solve", "small.json", "--method", "cpsat", "--output", "r.json").code == 0
    document = json.loads(Path("r.json").read_text())
    document["assignment"] |= {"a4": "t1"}
    Path("r.json").write_text(json.dumps(document))
    ran = alloc("evaluate", "small.json", "r.json", "--json")
    stated, so = f"{document['makespan']:.10g}", f"{ran.json['makespan']:.10g}"
    assert f"r.json: its makespan is {stated}, but on this instance it is {so}; its bounds are left out" in ran.err


def test_wrong_unserved_tasks_in_a_result_are_reported(alloc, unservable):
    """A result that claims to serve every task although one is unserved is contradicted."""
    assert alloc("solve", "unservable.json", "--method", "greedy", "--output", "r.json").code == 1
    assert "note" not in alloc("evaluate", "unservable.json", "r.json").err
    document = json.loads(Path("r.json").read_text())
    Path("r.json").write_text(json.dumps({**document, "makespan": 2.0}))
    ran = alloc("evaluate", "unservable.json", "r.json")
    assert "r.json: its makespan is 2, but on this instance it is null" in ran.err


def test_slack_and_moves_of_a_result_are_shown(alloc, small):
    """The makespan limit of the energy bound, and the moves from a plan in force, are those of `solve`."""
    assert alloc("solve", "small.json", "--method", "greedy", "--output", "old.json").code == 0
    options = ("--objective", "makespan-energy", "--makespan-slack", "0.5", "--start", "old.json", "--move-price", "1")
    solved = alloc("solve", "small.json", "--method", "milp", *options, "--output", "r.json")
    result = json.loads(Path("r.json").read_text())
    ran = alloc("evaluate", "small.json", "r.json")
    for line in solved.err.splitlines():
        if line.startswith(("  makespan", "  energy", "  moves")):
            assert line in ran.err
    assert alloc("evaluate", "small.json", "r.json", "--json").json["makespan_limit"] == result["makespan_limit"]
