"""``alloc plan --stdio``: one line out for each line in, tried from a shell as well."""

import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from schema_checks import faults

from alloc.problems import Instance, write_instance
from alloc.problems.formats import to_document
from alloc.problems.formats.schemas import schema

COMMAND = [sys.executable, "-m", "alloc", "plan", "--stdio", "--policy", "nearest"]

REQUESTS = (
    {"request": "plan"},
    {"hour": 1.0, "event": "agent-fails", "agent": "ben"},
    {"event": "agent-reports", "agent": "ann", "position": [0, 0.4], "battery": 7, "plan": False},
    {"event": "task-appears", "task": {"id": "t3", "workload": 2, "position": [0, 2]}},
    {"request": "pin", "agent": "ann", "task": "t3"},
    {"request": "unpin", "agent": "ann"},
    {"request": "plan", "hour": 2.5},
)


@pytest.fixture
def pair(tmp_path: Path) -> Instance:
    """Two agents and two tasks, also in pair.json."""
    instance = Instance(
        agent_ids=["ann", "ben"],
        task_ids=["t1", "t2"],
        ability=[2, 3],
        workload=[4, 6],
        agent_position=[[0, 0], [4, 0]],
        task_position=[[0, 1], [4, 1]],
        speed=[1, 1],
    )
    write_instance(instance, tmp_path / "pair.json")
    return instance


def lines(*values: object) -> str:
    return "".join(f"{value if isinstance(value, str) else json.dumps(value)}\n" for value in values)


def answers(text: str) -> list[dict]:
    """Return the lines of an output, each valid by its schema."""
    found = [json.loads(line) for line in text.splitlines()]
    assert [fault for answer in found for fault in faults(answer)] == []
    assert [answer["line"] for answer in found] == list(range(1, len(found) + 1))
    return found


def orders(answer: dict) -> dict:
    return {order["agent"]: order["task"] for order in answer["orders"]}


def test_each_line_gets_one_answer(alloc, pair):
    """Plans are returned after events and requests, unless not requested; changes have causes."""
    ran = alloc("plan", "pair.json", "--stdio", "--policy", "nearest", stdin=lines(*REQUESTS))
    assert ran.code == 0
    found = answers(ran.out)
    assert orders(found[0]) == {"ann": "t1", "ben": "t2"}
    assert orders(found[1]) == {"ann": "t1"}
    assert found[1]["changes"] == [
        {"agent": "ben", "before": {"task": "t2"}, "after": None, "cause": "agent ben failed at 1"}
    ]
    assert "orders" not in found[2]
    assert [orders(answer)["ann"] for answer in found[3:]] == ["t1", "t3", "t3", "t3"]
    assert found[-1]["hour"] == 2.5
    validator = Draft202012Validator(schema("planner-request"))
    assert [list(validator.iter_errors(request)) for request in REQUESTS] == [[]] * len(REQUESTS)


def test_invalid_lines_get_an_error_and_change_nothing(alloc, pair):
    """An invalid line is answered by an error, and does not change the plan."""
    wrong = (
        ("", "is empty"),
        ("{", "is not JSON"),
        ("[1]", "must be a JSON object"),
        ('{"event": "agent-fails", "agent": "bem"}', "there is no agent 'bem'"),
        ('{"event": "agent-reports", "agent": "ben", "battery": NaN}', "battery: must be a finite number"),
        ('{"event": "agent-fails", "agent": "ben", "hour": -1}', "hour: must be"),
        ({"request": "plans"}, "did you mean 'plan'?"),
        ({"request": "pin", "agent": "ann"}, "task: is missing"),
        ({"request": "save"}, "needs a file: start with --state FILE"),
        ({"request": "plan", "plan": "no"}, "plan: must be True or False"),
        ({"hour": 3}, "event: is missing; give an event, or a request"),
        ({"format": "alloc-mission/1"}, "format: must be alloc-planner-request/1"),
    )
    text = lines({"request": "plan"}, *(line for line, _ in wrong), {"request": "plan"})
    found = answers(alloc("plan", "pair.json", "--stdio", "--policy", "nearest", stdin=text).out)
    for answer, (_, told) in zip(found[1:-1], wrong, strict=True):
        assert told in answer["error"]
    assert found[-1]["orders"] == found[0]["orders"]


def test_first_line_may_be_the_mission(alloc, pair):
    """Without MISSION, the first line that is a mission is used, and answered by the first plan."""
    text = lines("nonsense", to_document(pair), {"event": "agent-fails", "agent": "ann"})
    found = answers(alloc("plan", "--stdio", "--policy", "nearest", stdin=text).out)
    assert "error" in found[0]
    assert [orders(answer) for answer in found[1:]] == [{"ann": "t1", "ben": "t2"}, {"ben": "t2"}]


def test_planning_resumes_from_saved_state(alloc, pair):
    """The next run resumes from the state saved at the end of the input; MISSION is then an error."""
    arguments = ("plan", "--stdio", "--policy", "nearest", "--state", "state.json")
    first = alloc(*arguments, "pair.json", stdin=lines({"event": "agent-fails", "agent": "ann", "hour": 1}))
    again = alloc(*arguments, stdin=lines({"request": "plan"}))
    assert answers(again.out)[0]["orders"] == answers(first.out)[0]["orders"]
    ran = alloc(*arguments, "pair.json")
    assert (ran.code, ran.out) == (2, "")
    assert "planning resumes from state.json" in ran.err


def test_the_state_is_saved_if_an_answer_cannot_be_written(alloc, pair, monkeypatch):
    """With standard output on a full disk the run ends with exit code 2, and the state has the line before it."""

    def fail(_):
        raise OSError(28, "cannot be written: no space left on device", "standard output")

    arguments = ("plan", "--stdio", "--policy", "nearest", "--state", "state.json")
    with monkeypatch.context() as patch:
        patch.setattr("alloc.cli.commands.missions.plan.write_out", fail)
        ran = alloc(*arguments, "pair.json", stdin=lines({"event": "agent-fails", "agent": "ann", "hour": 1}))
    assert (ran.code, ran.err) == (2, "alloc: standard output: cannot be written: no space left on device\n")
    again = alloc(*arguments, stdin=lines({"request": "plan"}))
    assert orders(answers(again.out)[0]) == {"ben": "t2"}


def test_wrong_arguments_are_refused_before_any_line(alloc, pair):
    """An unknown policy or file gives one line and exit code 2."""
    for arguments, told in (
        (("pair.json",), "--stdio: is required"),
        (("pair.json", "--stdio", "--state", "absent/state.json"), "there is no folder 'absent'; create it first"),
        (("pair.json", "--stdio", "--state", "pair.json"), "pair.json: is MISSION and --state at once"),
        (("pair.json", "--stdio", "--policy", "gredy"), "did you mean 'greedy'?"),
        (("none.json", "--stdio"), "none.json"),
        (("-", "--stdio"), "leave it out"),
        (("--stdio", "--policy", "gredy"), "did you mean 'greedy'?"),
    ):
        ran = alloc("plan", *arguments)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert told in ran.err


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_sigterm_ends_cleanly(pair, tmp_path):
    """Earlier lines are answered and saved, and the exit code is 0, although the input is still open."""
    command = [*COMMAND, str(tmp_path / "pair.json"), "--state", str(tmp_path / "state.json")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(lines({"event": "agent-fails", "agent": "ann", "hour": 1}))
        process.stdin.flush()
        answer = json.loads(process.stdout.readline())
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=60) == 0
        assert process.stdout.read() == ""
    saved = json.loads((tmp_path / "state.json").read_text())
    assert orders(answer) == {"ben": saved["plan"]["orders"]["ben"]["task"]}


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_saved_state_survives_sigkill(alloc, pair, tmp_path):
    """A state saved by request survives SIGKILL; the next run has the same plan."""
    command = [*COMMAND, str(tmp_path / "pair.json"), "--state", str(tmp_path / "state.json")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(lines({"event": "agent-fails", "agent": "ann", "hour": 1}, {"request": "save"}))
        process.stdin.flush()
        found = [json.loads(process.stdout.readline()) for _ in range(2)]
        process.kill()
    ran = alloc("plan", "--stdio", "--state", "state.json", stdin=lines({"request": "plan"}))
    again = answers(ran.out)[0]
    assert (again["hour"], again["orders"], again["changes"]) == (1, found[1]["orders"], found[1]["changes"])


@pytest.mark.skipif(shutil.which("jq") is None, reason="needs jq")
def test_shell_client_with_jq(pair, tmp_path):
    """A pipe of jq on both sides: events made, orders read."""
    script = (
        'jq -nc \'{request: "plan"}, {hour: 2, event: "agent-fails", agent: "ben"}\' | '
        + " ".join([*COMMAND, "pair.json"])
        + " | jq -r '.orders[] | .agent + \" \" + .task'"
    )
    done = subprocess.run(["sh", "-c", script], capture_output=True, text=True, timeout=60, cwd=tmp_path, check=True)
    assert done.stdout.splitlines() == ["ann t1", "ben t2", "ann t1"]


NODE = """
const {spawn} = require("child_process");
const planner = spawn(process.argv[1], process.argv.slice(2), {stdio: ["pipe", "pipe", "inherit"]});
const send = line => planner.stdin.write(JSON.stringify(line) + "\\n");
const waiting = [{hour: 1, event: "agent-fails", agent: "bem"}, {hour: 1, event: "agent-fails", agent: "ben"}];
require("readline").createInterface({input: planner.stdout}).on("line", line => {
    const answer = JSON.parse(line);
    console.log(answer.error ? "error" : answer.orders.map(order => order.agent + " " + order.task).join(", "));
    if (waiting.length) send(waiting.shift()); else planner.stdin.end();
});
planner.on("close", code => process.exit(code));
send({request: "plan"});
"""


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_node_client(pair, tmp_path):
    """It sends requests and waits for answers, gets an error for a wrong id, and ends `alloc` by closing its input."""
    command = ["node", "-e", NODE, *COMMAND, str(tmp_path / "pair.json")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.splitlines() == ["ann t1, ben t2", "error", "ann t1"]
