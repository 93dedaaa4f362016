import json
import signal
from pathlib import Path

import pytest

from alloc.problems import Instance, Units
from alloc.problems.formats import write_instance


def test_table_answer_and_files(alloc, small):
    """A table with a row per fleet and the answer is printed, and written to a file; a plot is drawn."""
    options = ("--add", "like a4", "--up-to", "2", "--remove", "a3", "--method", "milp")
    ran = alloc("whatif", "small.json", *options, "--output", "fleets.json", "--plot", "fleets.svg")
    assert (ran.code, ran.out) == (0, "")
    rows = ran.err.splitlines()
    assert rows[0].split()[:2] == ["agents", "change"]
    assert [row.split()[0] for row in rows[2:6]] == ["5", "4", "5", "6"]
    assert [words in row for words, row in zip(["as it is", "-a3", "-a3 +1", "-a3 +2"], rows[2:6], strict=True)]
    found = json.loads(Path("fleets.json").read_text())
    assert f"\n{found['answer'][0].upper()}{found['answer'][1:]}.\n" in ran.err
    assert (found["format"], found["like"], found["complete"]) == ("alloc-whatif/1", ["a4"], True)
    assert [fleet["agents"] for fleet in found["fleets"]] == [5, 4, 5, 6]
    assert found["fleets"][0]["makespan"] == pytest.approx(13 / 11)
    assert found["fleets"][3]["added"] == ["a4+1", "a4+2"]
    assert set(found["fleets"][3]["assignment"]) == {"a1", "a2", "a4", "a5", "a4+1", "a4+2"}
    assert "<svg" in Path("fleets.svg").read_text("utf-8")


def test_json_is_alone_on_standard_output(alloc, small):
    """With --json only the document is printed, and no table."""
    ran = alloc("whatif", "small.json", "--remove", "a3", "--method", "milp", "--json", "--quiet")
    assert (ran.code, ran.err) == (0, "")
    assert ran.json["fleets"][1]["removed"] == ["a3"]


def test_unserved_tasks_give_exit_code_1(alloc, unservable):
    """The exit code is 1 if a fleet cannot serve every task."""
    ran = alloc("whatif", "unservable.json", "--add", "like a1", "--method", "greedy")
    assert ran.code == 1
    assert "One more like a1: 1 task unserved as before." in ran.err
    assert "is new" not in ran.err
    rows = [row.split() for row in ran.err.splitlines()]
    column = rows[0].index("unserved")
    assert [row[column + words] for row, words in zip(rows[2:4], (2, 0), strict=True)] == ["1", "1"]  # "as it is", "+1"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--add", "a1"), """--add: must be "like ID\""""),
        (("--add", "like a9"), "--add: no agent 'a9'"),
        (("--remove", "a9"), "--remove: no agent 'a9'"),
        ((), "--add: needs an agent"),
        (("--add", "like a1", "--plot", "p.gif"), "p.gif: must end in"),
    ],
)
def test_wrong_options_are_one_line(alloc, small, arguments, message):
    """Errors name the option, in one line, with exit code 2."""
    ran = alloc("whatif", "small.json", *arguments)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert message in ran.err


def test_ctrl_c_saves_the_fleets_so_far(alloc, small, monkeypatch):
    """After Ctrl-C the fleets so far are saved and marked as incomplete."""
    monkeypatch.setattr(
        "alloc.cli.commands.experiments.whatif._show_fleet", lambda fleet: signal.raise_signal(signal.SIGINT)
    )
    ran = alloc("whatif", "small.json", "--add", "like a1", "--up-to", "4", "--method", "milp", "--output", "f.json")
    assert ran.code == 0
    found = json.loads(Path("f.json").read_text())
    assert (found["complete"], len(found["fleets"])) == (False, 1)
    assert found["answer"] == "interrupted before a fleet was changed"


def test_table_has_units(alloc):
    """The heading has the units of the instance."""
    instance = Instance(ability=[1, 2], workload=[3], units=Units(time="min", energy="Wh"))
    write_instance(instance, "timed.json")
    head = alloc("whatif", "timed.json", "--add", "like a1", "--method", "greedy").err.splitlines()[0]
    assert "makespan (min)" in head
    assert "energy (Wh)" in head
