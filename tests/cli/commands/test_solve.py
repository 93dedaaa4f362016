import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from matplotlib.testing.compare import compare_images

from alloc.allocators import solve
from alloc.allocators.plotting import plot
from alloc.cli.main import main
from alloc.problems import Allocation, evaluate
from alloc.problems.formats import read_instance
from alloc.problems.text import number

FIELDS = [
    "format", "method", "objective", "instance", "seed", "status", "stop_reason", "makespan", "served_makespan",
    "lower_bound", "gap", "energy", "energy_lower_bound", "energy_gap", "distance", "battery_remaining_percent",
    "reward", "unserved_tasks", "violations", "runtime_s", "assignment", "trace",
]  # fmt: skip


def test_json_is_alone_on_standard_output(alloc, small):
    """Standard output has the fields of alloc-result/1, which agree with the evaluator."""
    ran = alloc("solve", "small.json", "--method", "greedy", "--seed", "3", "--json")
    result = ran.json
    assert (ran.code, ran.err) == (0, "")
    assert list(result) == FIELDS
    score = evaluate(small, Allocation.from_ids(small, result["assignment"]))
    assert (result["makespan"], result["energy"], result["seed"]) == (score.makespan, score.energy, 3)


def test_summary_goes_to_stderr(alloc, small):
    """Without --json the summary is on standard error: status, scores and the bottleneck."""
    ran = alloc("solve", "small.json", "--method", "greedy")
    assert (ran.code, ran.out) == (0, "")
    for words in (
        "small (5 agents, 3 tasks), greedy",
        "makespan",
        "energy",
        "battery",
        "Bottleneck: ",
        "One more agent",
    ):
        assert words in ran.err


def test_quiet_prints_nothing(alloc, small):
    """With --quiet a successful run prints nothing."""
    ran = alloc("solve", "small.json", "--quiet", "--method", "greedy")
    assert (ran.code, ran.out, ran.err) == (0, "", "")


def test_auto_names_the_method_it_picked(alloc, small):
    """The notes of the result, such as auto's choice, are printed on standard error."""
    ran = alloc("solve", "small.json", "--json")
    assert "note: auto picked" in ran.err
    assert ran.json["status"] == "optimal"


def test_unserved_tasks_give_exit_code_1(alloc, unservable):
    """A task that no agent can take gives exit code 1, the best partial plan, and the reason."""
    ran = alloc("solve", "unservable.json", "--method", "greedy", "--json")
    assert ran.code == 1
    assert ran.json["unserved_tasks"] == ["t2"]
    assert "no agent can take task 't2'" in ran.err
    ran = alloc("solve", "unservable.json", "--method", "greedy")
    assert "Unserved: t2." in ran.err


def test_output_start_and_standard_streams(alloc, small):
    """A result of --output can start another run, which is never worse; `-` reads and writes standard streams."""
    assert alloc("solve", "small.json", "--method", "cpsat", "--output", "best.json", "-q").code == 0
    best = json.loads(Path("best.json").read_text())
    ran = alloc("solve", "small.json", "--method", "greedy", "--start", "best.json", "--output", "-")
    assert ran.json["makespan"] <= best["makespan"]
    ran = alloc("solve", "-", "--method", "greedy", "--json", stdin=Path("small.json").read_text())
    assert ran.json["instance"] == "instance" or ran.json["instance"] == "small"


def test_iteration_limits_are_reproducible(alloc, small):
    """With --iterations alone, the same seed gives the same result."""
    runs = [alloc("solve", "small.json", "--method", "ga", "--iterations", "5", "--json").json for _ in range(2)]
    assert runs[0]["assignment"] == runs[1]["assignment"]
    assert runs[0]["stop_reason"] != "time_limit"


def test_changes_since_the_start_are_noted(alloc, small):
    """A plan for a changed instance is used as far as possible, with a note on the changes."""
    Path("other.json").write_text(
        json.dumps({"format": "alloc-allocation/1", "instance": "other", "assignment": {"a1": "t1"}})
    )
    ran = alloc("solve", "small.json", "--method", "greedy", "--start", "other.json", "--json")
    assert ran.code == 0
    assert "since the plan was made, 4 agents are new" in ran.err


def test_saturated_reward_is_a_note(alloc):
    """A reward beyond the range of floats gives a note with JSON, not with a summary."""
    document = {
        "format": "alloc-instance/1",
        "agents": [{"id": "a", "ability": 1}],
        "tasks": [{"id": "t", "workload": 1e6}],
    }
    ran = alloc("solve", "-", "--method", "greedy", "--json", "--output", "plan.json", stdin=json.dumps(document))
    assert ran.code == 0
    assert "the reward (3) overflows" in ran.err
    assert ran.json["reward"] < -1e300
    ran = alloc("evaluate", "-", "plan.json", "--json", stdin=json.dumps(document))
    assert "the reward (3) overflows" in ran.err
    for command in (("solve", "-", "--method", "greedy"), ("evaluate", "-", "plan.json")):
        ran = alloc(*command, stdin=json.dumps(document))
        assert ran.code == 0
        assert "reward" not in ran.err


def test_plot_shows_the_plan_of_the_result(alloc, small):
    """--plot draws exactly the plan of the result."""
    assert alloc("solve", "small.json", "--method", "greedy", "--plot", "picture.png", "-q").code == 0
    plot(solve(small, "greedy", handle_signals=False), "expected.png")
    assert compare_images("expected.png", "picture.png", 0) is None


def test_svg_has_all_names(alloc, small):
    """--plot also writes .svg, with a bar and a name for each task, and the scores in the title."""
    assert alloc("solve", "small.json", "--method", "greedy", "--plot", "picture.svg", "-q").code == 0
    content = Path("picture.svg").read_text("utf-8")
    assert ElementTree.fromstring(content).tag == "{http://www.w3.org/2000/svg}svg"
    result = solve(small, "greedy", handle_signals=False)
    written = [words.strip() for words in re.findall("<!--(.*?)-->", content, re.DOTALL)]
    assert [written.count(name) for name in small.task_ids] == [1, 1, 1]  # at their bars
    assert any(f"T = {number(result.makespan, 4)}," in words for words in written)


def test_saved_result_matches_standard_output(alloc, small):
    """--output and --json give the same document, and the instance file is not changed."""
    ran = alloc("solve", "small.json", "--method", "greedy", "--output", "result.json", "--json")
    assert json.loads(Path("result.json").read_text()) == ran.json
    assert read_instance("small.json").name == "small"


@pytest.mark.parametrize("option", ["--output", "--plot"])
def test_empty_file_name_is_refused(alloc, small, option):
    """An empty name, as from an unset shell variable, is not the working folder."""
    ran = alloc("solve", "small.json", option, "")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)


def test_closed_standard_output_is_reported(alloc, small, monkeypatch):
    """A closed standard output is an error with --json; a requested file is still written."""
    monkeypatch.setattr("sys.stdout", None)
    assert main(["solve", "small.json", "--method", "greedy", "-q", "--json", "--output", "best.json"]) == 2
    assert json.loads(Path("best.json").read_text())["instance"] == "small"


def test_slack_saves_energy(alloc, small):
    """With slack the result has a longer makespan, within the limit, and less energy."""
    strict = alloc("solve", "small.json", "--objective", "makespan-energy", "--json").json
    loose = alloc("solve", "small.json", "--objective", "makespan-energy", "--makespan-slack", "1", "--json")
    assert "makespan_limit" not in strict
    assert loose.json["makespan_limit"] == pytest.approx(2 * strict["makespan"])
    assert strict["makespan"] < loose.json["makespan"] <= loose.json["makespan_limit"]
    assert loose.json["energy"] < strict["energy"]
    assert loose.json["status"] == "optimal"
    shown = alloc("solve", "small.json", "--objective", "makespan-energy", "--makespan-limit", "9").err
    assert "optimal; no allocation within 9 has less energy" in shown


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--makespan-slack", "0.1"], "needs the objective makespan-energy"),
        (["--makespan-slack", "inf", "--objective", "makespan-energy"], "must be a finite number"),
        (["--makespan-limit", "0", "--objective", "makespan-energy"], "must be a finite number > 0"),
        (
            ["--makespan-limit", "3", "--objective", "makespan-energy", "--method", "ga"],
            "makes no use of slack for the makespan; use ",
        ),
    ],
)
def test_wrong_slack_is_refused(alloc, small, arguments, words):
    """Slack without energy, invalid slack, and a method without support for it give one line and exit code 2."""
    ran = alloc("solve", "small.json", *arguments)
    assert (ran.code, ran.out) == (2, "")
    assert words in ran.err
    assert ran.err.count("\n") == 1


def test_start_for_another_instance_names_its_file(alloc, small):
    """A plan without any agent of the instance is an error that says which file it is."""
    document = {"format": "alloc-allocation/1", "assignment": {"z9": None}}
    Path("other.json").write_text(json.dumps(document))
    ran = alloc("solve", "small.json", "--start", "other.json")
    assert (ran.code, ran.err) == (2, "alloc: other.json: assignment: names no agent of instance 'small'\n")
