"""`alloc solve` prints the plan as tables, and writes it to files by suffix."""

import csv
from pathlib import Path

import pytest

from alloc.allocators.conclusion import scored_result
from alloc.cli.output.plan import plan_tables
from alloc.problems import Allocation, Instance, Units


def test_plan_is_printed_before_the_summary(alloc, small):
    """A table by task with its group, one by agent with distance and battery, then the summary."""
    shown = alloc("solve", "small.json", "--method", "greedy").err
    task, agent = shown.split("\n\n")[:2]
    assert task.splitlines()[0].split() == ["task", "workload", "finish", "agents", "group"]
    assert agent.splitlines()[0].split() == ["agent", "task", "finish", "distance", "energy", "battery", "left"]
    assert [len(table.splitlines()) - 2 for table in (task, agent)] == [3, 5]
    assert shown.split("\n\n")[2].startswith("small (5 agents, 3 tasks), greedy: ")


@pytest.mark.parametrize("option", ["--quiet", "--json"])
def test_quiet_and_json_print_no_plan(alloc, small, option):
    """Neither --quiet nor --json prints tables."""
    assert "battery left" not in alloc("solve", "small.json", "--method", "greedy", option).err


def test_long_tables_are_truncated():
    """At most 50 rows and six agents per group are shown, with the number of further ones."""
    instance = Instance(ability=[1] * 60, workload=[60])
    tasks, agents = plan_tables(scored_result(instance, Allocation([0] * 60)))
    assert "a1, a2, a3, a4, a5, a6 and 54 more" in tasks
    assert len(agents.splitlines()) == 53
    assert agents.splitlines()[-1].startswith("... and 10 more agents")


def test_shortened_names_remain_distinct():
    """Long names with equal beginnings stay different, and headings have units."""
    ids = [f"a building with a very long name, floor {number}" for number in (1, 2)]
    instance = Instance(ability=[1, 1], workload=[1, 1], task_ids=ids, units=Units(time="min", work="m2"))
    tasks, agents = plan_tables(scored_result(instance, Allocation([0, 1])))
    assert "workload (m2)  finish (min)" in tasks
    names = [line.rsplit(None, 1)[0] for line in agents.splitlines()[2:]]
    assert len({name[4:] for name in names}) == 2


def test_task_without_work_is_not_unserved():
    """Without work a task is done at 0; a task with work and no agent is unserved."""
    instance = Instance(ability=[1], workload=[0, 1, 1])
    rows = plan_tables(scored_result(instance, Allocation([1])))[0].splitlines()[2:]
    assert [row.split()[2:] for row in rows] == [["0", "0", "-"], ["1", "1", "a1"], ["unserved", "0", "-"]]


def test_suffix_determines_the_format(alloc, small):
    """A table and a map are written, and nothing is printed to standard output."""
    for name in ("plan.csv", "plan.html", "plan.xlsx"):
        ran = alloc("solve", "small.json", "--method", "greedy", "-q", "--output", name)
        assert (ran.code, ran.out, ran.err) == (0, "", "")
    with open("plan.csv", newline="") as file:
        assert [row["agent"] for row in csv.DictReader(file)] == list(small.agent_ids)
    assert Path("plan.html").read_text().startswith("<!DOCTYPE html>")


@pytest.mark.parametrize("name", ["plan.txt", "plan", "plan.geojson"])
def test_other_suffixes_are_refused_before_the_run(alloc, small, monkeypatch, name):
    """Unsupported suffixes, and GeoJSON without geographic positions, give one line and exit code 2 before the run."""
    monkeypatch.setattr("alloc.allocators.solve", lambda *_, **__: pytest.fail("it ran"))
    ran = alloc("solve", "small.json", "--output", name)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert ran.err.startswith(f"alloc: {name}: ")
    assert not Path(name).exists()


def test_devices_get_json(alloc, small):
    """A device, which has no suffix, gets JSON."""
    assert alloc("solve", "small.json", "--method", "greedy", "-q", "--output", "/dev/null").code == 0
