"""--pin and --pin-file: ids with =, contradictions, and files for changed instances."""

import json
from pathlib import Path

import pytest

from alloc.problems import Instance
from alloc.problems.formats import write_instance


def pins_of(alloc, *options, instance="small.json"):
    ran = alloc("solve", instance, "--method", "greedy", "--json", *options)
    return ran.json["pins"] if ran.code == 0 else ran.err


def write(assignment, name="pins.json"):
    Path(name).write_text(json.dumps({"format": "alloc-allocation/1", "assignment": assignment}))


@pytest.fixture
def signs(tmp_path):
    """Agents and tasks whose ids contain =, in signs.json."""
    agents, tasks = ["D", "D=2", "E=", "F"], ["task", "2=task", "a=b", "G"]
    instance = Instance(name="signs", agent_ids=agents, ability=[1, 1, 1, 1], task_ids=tasks, workload=[1, 1, 1, 1])
    write_instance(instance, tmp_path / "signs.json")
    return instance


@pytest.mark.parametrize(
    ("pair", "pins"),
    [
        ("F=task", {"F": "task"}),
        ("F=a=b", {"F": "a=b"}),
        ("D=2=a=b", {"D=2": "a=b"}),
        ("D=2=", {"D=2": None}),
        ("E==G", {"E=": "G"}),
        ("D=", {"D": None}),
    ],
)
def test_ids_may_contain_an_equals_sign(alloc, signs, pair, pins):
    """The text is split such that both sides are ids of the instance."""
    ran = alloc("solve", "signs.json", "--method", "greedy", "--json", "--pin", pair)
    assert ran.json["pins"] == pins


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        ("D=2=task", "'D=2=task' may pin agent 'D' to task '2=task' or agent 'D=2' to task 'task'; pin it in a file"),
        ("D=2=tusk", "no task 'tusk' in instance 'signs' (did you mean 'task'?)"),
        ("X=task", "no agent 'X' in instance 'signs'"),
        ("X", "must be AGENT=TASK, got 'X'"),
        ("=task", "must be AGENT=TASK, got '=task'"),
    ],
)
def test_ambiguous_and_invalid_pins_are_refused(alloc, signs, pair, message):
    """Ambiguous and invalid pins are one line; an unknown task is reported for the longest known agent id."""
    ran = alloc("solve", "signs.json", "--pin", pair)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert ran.err.startswith(f"alloc: --pin: {message}")


def test_pin_file_resolves_ambiguous_pins(alloc, signs):
    """The alternative suggested by the message works."""
    write({"D=2": "task"})
    assert pins_of(alloc, "--pin-file", "pins.json", instance="signs.json") == {"D=2": "task"}


@pytest.mark.parametrize("file", [(), ("--pin-file", "pins.json")])
def test_contradicting_pins_are_refused(alloc, small, file):
    """Contradicting options are refused, with and without a file; repetitions are accepted."""
    write({"a2": "t1"})
    message = pins_of(alloc, *file, "--pin", "a1=t1", "--pin", "a1=t2")
    assert message == "alloc: --pin: 'a1' is pinned to task 't1' and to task 't2'\n"
    message = pins_of(alloc, *file, "--pin", "a1=t1", "--pin", "a1=")
    assert message == "alloc: --pin: 'a1' is pinned to task 't1' and to no task\n"
    assert pins_of(alloc, *file, "--pin", "a1=t1", "--pin", "a1=t1")["a1"] == "t1"


def test_option_overrides_the_pin_file(alloc, small):
    """--pin overrides the file for one agent, and the file applies to the others."""
    write({"a1": "t1", "a2": "t2"})
    assert pins_of(alloc, "--pin-file", "pins.json", "--pin", "a1=t3") == {"a1": "t3", "a2": "t2"}


def test_pins_of_removed_agents_and_tasks_are_dropped(alloc, small):
    """As with --start, agents and tasks that no longer exist are dropped, with a note."""
    write({"a1": "t1", "a2": "t9", "a9": "t2"})
    ran = alloc("solve", "small.json", "--method", "greedy", "--json", "--pin-file", "pins.json")
    assert ran.json["pins"] == {"a1": "t1"}
    assert ran.err == "note: pins.json: 1 agent has gone, 1 task has gone since; these pins are left out\n"


@pytest.mark.parametrize(
    ("assignment", "message"),
    [
        ({"b1": "t1"}, "pins.json: assignment: names no agent of instance 'unservable'"),
        ({"a1": "t2"}, "pins.json: assignment.a1: 'a1' cannot do 't2': the agent may not do this task"),
        ({"a1": 3}, "pins.json: assignment.a1: must be the id of a task, or null, got 3"),
    ],
)
def test_errors_name_the_pin_file(alloc, unservable, assignment, message):
    """Errors in a file of pins name the file and the agent."""
    write(assignment)
    ran = alloc("solve", "unservable.json", "--pin-file", "pins.json")
    assert (ran.code, ran.err) == (2, f"alloc: {message}\n")
