import json
from pathlib import Path

import pytest
from schema_checks import faults


@pytest.fixture
def mission(alloc):
    """A small mission in mission.json."""
    made = alloc("generate", "mission", "--agents", "3", "--tasks", "4", "--seed", "2", "--output", "mission.json")
    assert made.code == 0
    return "mission.json"


def test_a_mission_is_simulated_and_replayed(alloc, mission):
    """What is printed for a run comes again from its log, byte for byte, and is valid by its schema."""
    ran = alloc("simulate", mission, "--policy", "greedy", "--deadline-ms", "0", "--log", "run.jsonl", "--json")
    assert ran.code == 0
    assert ran.json["status"] == "done"
    again = alloc("replay", "run.jsonl", "--json", "--check")
    assert (again.code, again.out) == (0, ran.out)
    assert "All laws hold" in again.err
    with open("run.jsonl", encoding="utf-8") as file:
        header, *records, result = map(json.loads, file)
    assert faults(header) == faults(result) == faults(header["mission"]) == []
    assert [record["hour"] for record in records] == sorted(record["hour"] for record in records)


def test_summaries_are_for_people(alloc, mission):
    """Without --json nothing goes to standard output; several runs are a table."""
    ran = alloc("simulate", mission, "--policy", "nearest")
    assert ran.out == ""
    assert "Mission time: " in ran.err
    table = alloc("simulate", mission, "--policy", "random", "--runs", "2", "--seed", "5")
    assert [line.split()[0] for line in table.err.splitlines()[2:4]] == ["5", "6"]


def test_several_runs_are_a_list(alloc, mission):
    """With --runs the JSON is a list of results, one for each seed."""
    ran = alloc("simulate", mission, "--policy", "random", "--runs", "3", "--json")
    assert [result["seed"] for result in ran.json] == [0, 1, 2]


def test_exit_codes_are_those_of_solve(alloc, mission):
    """1 if not all is done, 2 with one line for what is wrong."""
    assert alloc("simulate", mission, "--policy", "idle").code == 1
    for arguments, told in (
        (("--policy", "gredy"), "--policy: there is no policy 'gredy' (did you mean 'greedy'?)"),
        (("--policy", "replan", "--set", "method=greedy", "--knowledge", "local"), "needs full knowledge"),
        (("--policy", "greedy", "--set", "stay=-1"), "stay: must be"),
        (("--policy", "greedy", "--set", "sty=1"), "takes no option 'sty' (did you mean 'stay'?)"),
        (("--policy", "idle", "--runs", "2", "--log", "x.jsonl"), "is for a single run"),
        (("--policy", "idle", "--log", mission), "is MISSION and --log at once"),
    ):
        ran = alloc("simulate", mission, *arguments)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert told in ran.err


def test_faults_of_files_are_told(alloc):
    """A mission or a log that is none is one line with file and place."""
    with open("bad.json", "w", encoding="utf-8") as file:
        file.write('{"format": "alloc-mission/1", "agents": [{"id": "a", "ability": 1}], "tasks": []}')
    ran = alloc("simulate", "bad.json", "--policy", "idle")
    assert (ran.code, ran.err) == (2, "alloc: bad.json: tasks: an instance needs at least one agent and one task\n")
    ran = alloc("replay", "bad.json")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "bad.json: is no log of a mission" in ran.err


def test_an_instance_is_simulated(alloc):
    """An instance is a mission: re-planning once for all is as good as its makespan."""
    assert alloc("generate", "random", "--agents", "6", "--tasks", "2", "--output", "i.json").code == 0
    ran = alloc("simulate", "i.json", "--policy", "replan", "--set", "method=greedy", "--json")
    solved = alloc("solve", "i.json", "--method", "greedy", "--json")
    assert ran.json["mission_time"] <= solved.json["makespan"] * (1 + 1e-9)


def test_options_of_missions_are_for_missions(alloc):
    """What is for missions alone is refused elsewhere, and the other way round."""
    for arguments, told in (
        (("random", "--family", "waves"), "is for mission, not for random"),
        (("mission", "--load", "2"), "is for random, not for mission"),
        (("mission", "--loss", "2"), "--loss: must be"),
        (("mission", "--family", "paper-1", "--agents", "3"), "--agents: is fixed by scenario 1"),
    ):
        ran = alloc("generate", *arguments)
        assert (ran.code, ran.out) == (2, "")
        assert told in ran.err


def test_a_mission_is_drawn_and_played_from_a_run_and_from_its_log(alloc, mission):
    """Picture and page are written by the run, and by `alloc plot` from the log; only the run's page has knowledge."""
    assert alloc(
        "simulate", mission, "--policy", "greedy", "--log", "x.jsonl", "--plot", "x.svg", "--animate", "x.html"
    ).code in (0, 1)
    assert alloc("plot", "x.jsonl", "--output", "y.html").code == 0
    assert '"knowledge": {' in Path("x.html").read_text(encoding="utf-8")
    assert '"knowledge": null' in Path("y.html").read_text(encoding="utf-8")
    assert "<svg" in Path("x.svg").read_text(encoding="utf-8")


def test_wrong_names_of_films_are_told_before_the_run(alloc, mission):
    """A suffix that no animation has, and a damaged log, are one line and exit code 2."""
    found = alloc("simulate", mission, "--policy", "greedy", "--animate", "x.avi")
    assert (found.code, found.err.strip()) == (2, "alloc: x.avi: must end in .gif, .mp4 or .html")
    assert alloc("plot", mission, "--output", "x.png").code == 2
