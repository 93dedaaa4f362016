import importlib
import json
import signal
from pathlib import Path

import pytest
from schema_checks import faults


@pytest.fixture
def mission(alloc):
    """A small mission in mission.json."""
    made = alloc("generate", "mission", "--agents", "3", "--tasks", "4", "--seed", "2", "--output", "mission.json")
    assert made.code == 0
    return "mission.json"


def test_mission_is_simulated_and_replayed(alloc, mission):
    """The output of a run is reproduced from its log byte for byte, and is valid by its schema."""
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


def test_summaries_go_to_standard_error(alloc, mission):
    """Without --json nothing goes to standard output; several runs are a table."""
    ran = alloc("simulate", mission, "--policy", "nearest")
    assert ran.out == ""
    assert "Mission time: " in ran.err
    table = alloc("simulate", mission, "--policy", "random", "--runs", "2", "--seed", "5")
    assert [line.split()[0] for line in table.err.splitlines()[2:4]] == ["5", "6"]


def test_several_runs_are_a_list(alloc, mission):
    """With --runs the JSON is a list of results, one per seed."""
    ran = alloc("simulate", mission, "--policy", "random", "--runs", "3", "--json")
    assert [result["seed"] for result in ran.json] == [0, 1, 2]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_keeps_the_runs_that_are_complete(alloc, mission, monkeypatch, number):
    """Completed runs are printed, with exit code 1; in the first run there is nothing to print."""
    module = importlib.import_module("alloc.allocators.online.run")
    inner = module.simulate_until

    def until_third(*arguments, **settings):
        if arguments[4] == last:
            signal.raise_signal(number)
        return inner(*arguments, **settings)

    monkeypatch.setattr(module, "simulate_until", until_third)
    last = 2
    ran = alloc("simulate", mission, "--policy", "greedy", "--runs", "5", "--json")
    assert [result["seed"] for result in ran.json] == [0, 1]
    assert (ran.code, ran.err) == (1, "note: interrupted after 2 of 5 runs\n")
    last = 0
    ran = alloc("simulate", mission, "--policy", "greedy", "--runs", "5", "--json")
    assert (ran.code, ran.out) == (130, "")


def test_unwritable_log_keeps_the_result(alloc, mission, monkeypatch):
    """If the disk is full at the end of a run, the result is on standard output, with exit code 2."""

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    ran = alloc("simulate", mission, "--policy", "greedy", "--json", "--log", "run.jsonl")
    assert (ran.code, ran.json["status"], Path("run.jsonl").exists()) == (2, "done", False)
    assert ran.err == "alloc: run.jsonl: cannot be written: no space left on device\n"


def test_standard_output_that_cannot_be_written_costs_no_log(alloc, mission, monkeypatch):
    """The log and the picture of a run are written although its result cannot be printed, with exit code 2."""

    def fail(_):
        raise OSError(28, "cannot be written: no space left on device", "standard output")

    monkeypatch.setattr("alloc.cli.output.files.write_out", fail)
    ran = alloc("simulate", mission, "--policy", "greedy", "--json", "-q", "--log", "run.jsonl", "--plot", "run.svg")
    assert (ran.code, ran.err) == (2, "alloc: standard output: cannot be written: no space left on device\n")
    assert Path("run.svg").exists()
    assert alloc("replay", "run.jsonl", "-q").code == 0


def test_exit_codes_match_solve(alloc, mission):
    """1 if not all tasks are done, 2 with one line for an error."""
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


def test_invalid_files_are_one_line(alloc):
    """An invalid mission or log is reported in one line with file and place."""
    with open("bad.json", "w", encoding="utf-8") as file:
        file.write('{"format": "alloc-mission/1", "agents": [{"id": "a", "ability": 1}], "tasks": []}')
    ran = alloc("simulate", "bad.json", "--policy", "idle")
    assert (ran.code, ran.err) == (2, "alloc: bad.json: tasks: an instance needs at least one agent and one task\n")
    ran = alloc("replay", "bad.json")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "bad.json: is not a log of a mission, but of the format 'alloc-mission/1'" in ran.err


def test_mission_in_place_of_a_log_is_reported(alloc, mission):
    """A multi-line mission in place of a log is recognised; drawing a plan needs two files."""
    ran = alloc("replay", mission)
    assert (ran.code, ran.out) == (2, "")
    told = "is not a log of a mission, but of the format 'alloc-mission/1'; `alloc simulate --log` writes logs"
    assert ran.err == f"alloc: {mission}: {told}\n"
    ran = alloc("plot", mission, "--output", "x.png")
    assert (ran.code, ran.out, Path("x.png").exists()) == (2, "", False)
    told = "is not a log of a mission; to draw a plan, give the instance and the plan"
    assert ran.err == f"alloc: {mission}: {told}\n"


def test_knowledge_is_checked_before_loops_are_compiled(alloc, mission, monkeypatch):
    """A policy that needs full knowledge is refused at once, not after a minute of compilation."""

    def compiled():
        raise AssertionError

    monkeypatch.setattr("alloc.allocators.online.policies.routes.warm_up", compiled)
    ran = alloc("simulate", mission, "--policy", "routes", "--knowledge", "local")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "needs full knowledge (--knowledge full)" in ran.err


def test_instance_is_simulated_as_a_mission(alloc):
    """Re-planning once for an instance reaches its makespan."""
    assert alloc("generate", "random", "--agents", "6", "--tasks", "2", "--output", "i.json").code == 0
    ran = alloc("simulate", "i.json", "--policy", "replan", "--set", "method=greedy", "--json")
    solved = alloc("solve", "i.json", "--method", "greedy", "--json")
    assert ran.json["mission_time"] <= solved.json["makespan"] * (1 + 1e-9)


def test_mission_options_are_refused_for_instances(alloc):
    """Mission options are refused for instances, and vice versa."""
    for arguments, told in (
        (("random", "--family", "waves"), "is for mission, not for random"),
        (("mission", "--load", "2"), "is for random, not for mission"),
        (("mission", "--loss", "2"), "--loss: must be"),
        (("mission", "--family", "paper-1", "--agents", "3"), "--agents: is fixed by scenario 1"),
    ):
        ran = alloc("generate", *arguments)
        assert (ran.code, ran.out) == (2, "")
        assert told in ran.err


def test_mission_is_drawn_and_animated_from_a_run_and_from_its_log(alloc, mission):
    """The run and `alloc plot` of its log write picture and page; only the run's page has knowledge."""
    assert alloc(
        "simulate", mission, "--policy", "greedy", "--log", "x.jsonl", "--plot", "x.svg", "--animate", "x.html"
    ).code in (0, 1)
    assert alloc("plot", "x.jsonl", "--output", "y.html").code == 0
    assert '"knowledge": {' in Path("x.html").read_text(encoding="utf-8")
    assert '"knowledge": null' in Path("y.html").read_text(encoding="utf-8")
    assert "<svg" in Path("x.svg").read_text(encoding="utf-8")


def test_invalid_animation_files_are_refused_before_the_run(alloc, mission):
    """An unsupported suffix, and a damaged log, give one line and exit code 2."""
    found = alloc("simulate", mission, "--policy", "greedy", "--animate", "x.avi")
    assert (found.code, found.err.strip()) == (2, "alloc: x.avi: must end in .gif, .mp4 or .html")
    assert alloc("plot", mission, "--output", "x.png").code == 2


def test_policies_are_compared(alloc, mission):
    """Each mission and policy has a row, as JSON, CSV and a table, with paired differences from the first policy."""
    arguments = ("compare", mission, mission, "--policies", "nearest,greedy[stay=2],replan", "--seeds", "2")
    ran = alloc(*arguments, "--json")
    rows = ran.json["rows"]
    assert [(row["policy"], row["runs"], row["number"]) for row in rows[2:4]] == [("replan", 0, 1), ("nearest", 2, 2)]
    assert "needs full knowledge" in rows[2]["reason"]
    assert [(one["policy"], one["against"]) for one in ran.json["differences"]] == [
        ("greedy[stay=2]", "nearest"),
        ("replan", "nearest"),
    ]
    table = alloc(*arguments, "--csv", "table.csv")
    assert "Differences from nearest on the same missions" in table.err
    assert "note: Small sample: intervals from fewer than 10 missions are unreliable." in table.err
    alone = alloc("compare", mission, "--policies", "nearest,greedy")
    assert "note: A single mission: pairs are its seeds, and do not generalise to other missions." in alone.err
    header, first, *_ = Path("table.csv").read_text().splitlines()
    assert dict(zip(header.split(","), first.split(","), strict=True))["mission_time_mean"] == str(
        rows[0]["mission_time_mean"]
    )
    assert (table.code, table.out) == (0, "")


def test_policies_and_methods_cannot_be_mixed(alloc, mission, small):
    """One line says which options or files belong together."""
    for arguments, told in (
        ((mission, "--methods", "greedy"), "`alloc compare --policies` take missions"),
        ((mission,), "give either --methods, for instances, or --policies, for missions"),
        ((mission, "--methods", "greedy", "--policies", "greedy"), "give either --methods"),
        ((mission, "--policies", "greedy", "--iterations", "3"), "--iterations: can only be used with --methods"),
        (("small.json", "--methods", "greedy", "--knowledge", "full"), "--knowledge: can only be used with --policies"),
        ((mission, "--policies", "gredy"), "--policies: there is no policy 'gredy'"),
    ):
        ran = alloc("compare", *arguments)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert told in ran.err


def test_missions_and_logs_are_validated(alloc, mission, small):
    """Missions, logs and instances are checked together, each with its summary and likely mistakes."""
    alloc("simulate", mission, "--policy", "greedy", "--log", "run.jsonl")
    document = json.loads(Path(mission).read_text())
    document |= {"knowledge": "full", "horizon": 0.1, "sensing": 1}
    document["tasks"][0] |= {"deadline": 1e-6}
    Path("odd.json").write_text(json.dumps(document))
    ran = alloc("validate", mission, "run.jsonl", "small.json", "odd.json", "--json")
    assert ran.code == 0
    first, log, instance, odd = ran.json
    assert (first["format"], first["agents"], first["tasks"], first["findings"]) == ("alloc-mission/1", 3, 4, [])
    assert (log["format"], log["policy"], log["status"]) == ("alloc-mission-log/1", "greedy", "done")
    assert "format" not in instance
    assert [finding["field"] for finding in odd["findings"]] == ["deadline", "horizon", "sensing"]
    told = alloc("validate", "-", "run.jsonl", stdin=Path(mission).read_text()).err
    assert "-: ok, a mission of 3 agents" in told
    assert "run.jsonl: ok, a log of " in told


def test_each_fault_of_a_mission_is_a_line(alloc, mission):
    """Every fault has a line with file, place and correction, and exit code 2; so has the first wrong line of a log."""
    document = json.loads(Path(mission).read_text())
    document["agents"][0]["ability"] = -1
    document["radio"]["period"] = 0
    Path("bad.json").write_text(json.dumps(document))
    ran = alloc("validate", "bad.json")
    assert (ran.code, ran.out) == (2, "")
    assert sorted(line.split(": ")[:3] for line in ran.err.splitlines()) == [
        ["alloc", "bad.json", "agents[0].ability"],
        ["alloc", "bad.json", "radio.period"],
    ]
    alloc("simulate", mission, "--policy", "greedy", "--log", "run.jsonl")
    lines = Path("run.jsonl").read_text().splitlines(keepends=True)
    Path("run.jsonl").write_text("".join([*lines[:3], *lines[4:]]))
    ran = alloc("validate", "run.jsonl")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "run.jsonl: line 4: does not follow from the orders before it" in ran.err


def test_cfstp_is_generated(alloc):
    """A CFSTP takes numbers of agents and tasks, and no options of other families."""
    ran = alloc("generate", "cfstp", "--agents", "2", "--tasks", "3", "--seed", "1", "--output", "-")
    assert (len(ran.json["agents"]), len(ran.json["tasks"]), ran.json["metric"]) == (2, 3, "manhattan")
    ran = alloc("generate", "cfstp", "--loss", "0.1")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "--loss: is for mission, not for cfstp" in ran.err


def test_files_of_other_projects_are_imported(alloc):
    """The example files give valid missions; record options are refused for other formats, in one line."""
    folder = Path(__file__).parents[3] / "examples" / "records"
    for kind, name in (
        ("london", "calls.csv"),
        ("new-brunswick", "fires.csv"),
        ("space", "space.yaml"),
        ("cfstp", "cfstp.txt"),
    ):
        ran = alloc("import-mission", kind, str(folder / name), "--output", f"{kind}.json")
        assert (ran.code, ran.out) == (0, "")
        assert f"wrote {kind}.json: " in ran.err
    assert alloc("validate", "london.json", "new-brunswick.json", "space.json", "cfstp.json").code == 0
    dated = ("--from", "2021-07-06", "--until", "2021-07-06", "--compress", "24", "--output", "-")
    ran = alloc("import-mission", "london", str(folder / "calls.csv"), *dated)
    assert len(ran.json["tasks"]) == 3
    for arguments, told in (
        (("space", str(folder / "space.yaml"), "--compress", "2"), "--compress: is for records only, not for space"),
        (("london", str(folder / "calls.csv"), "--until", "soon"), "--until"),
        (("london", str(folder / "calls.csv"), "--compress", "0"), "--compress: must be a finite number > 0"),
        (("london", str(folder / "calls.csv"), "--from", "2022-01-01", "--until", "2021-01-01"), "--until: must not"),
        (("london", str(folder / "cfstp.txt")), "has no column 'IncidentNumber'"),
    ):
        ran = alloc("import-mission", *arguments, "--output", "x.json", "--quiet")
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert told in ran.err
