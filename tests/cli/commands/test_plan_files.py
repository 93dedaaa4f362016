"""Every command that takes a plan reads every format of plans."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import highspy
import pytest

from alloc.problems import Allocation, Instance, read_allocation, write_allocation, write_model

PLAN: dict[str, str | None] = {"a1": "t1", "a2": "t2", "a3": "t2", "a4": "t2", "a5": "t3"}


def solution(instance: Instance, head: str, line: str) -> str:
    """Return a solution of the plain model as a solver writes it."""
    return head + "".join(line.format(f"x_{agent}__{task}") for agent, task in PLAN.items())


def by_highs(instance: Instance, style: int) -> str:
    """Return the solution file of HiGHS with all variables fixed to the plan."""
    write_model(instance, "plain.lp", model="plain", makespan=1e3)
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.readModel("plain.lp")
    for agent, task in PLAN.items():
        _, column = highs.getColByName(f"x_{agent}__{task}")
        highs.changeColBounds(column, 1, 1)
    highs.run()
    highs.writeSolution("highs.txt", style)
    return Path("highs.txt").read_text()


def as_table(instance: Instance) -> str:
    """Return a table with columns in another order, and an additional one."""
    return "\n".join(["note,task,agent", *(f"-,{task},{agent}" for agent, task in PLAN.items())])


def as_json(instance: Instance) -> str:
    write_allocation(Allocation.from_ids(instance, PLAN), instance, "a.json")
    return Path("a.json").read_text()


FILES: dict[str, Callable[[Instance], str]] = {
    "plan.json": as_json,
    "plan.csv": as_table,
    "highs.sol": lambda instance: by_highs(instance, 0),
    "highs-pretty.sol": lambda instance: by_highs(instance, 1),
    "cbc.sol": lambda instance: solution(instance, "Optimal - objective value 1\n", "   3 {}  1  0\n"),
    "scip.sol": lambda instance: solution(
        instance, "solution status: optimal solution found\nobjective value: 1\n", "{}   1 \t(obj:0)\n"
    ),
    "gurobi.sol": lambda instance: solution(instance, "# Solution for model obj\n# Objective value = 1\n", "{} 1\n"),
}


@pytest.mark.parametrize("name", FILES)
def test_every_command_reads_every_plan(alloc, small, name):
    """evaluate, plot, --start, --pin-file and the start of a front accept tables and solutions like JSON."""
    text = FILES[name](small)
    Path(name).write_text(text)
    assert read_allocation(name, small)[0] == Allocation.from_ids(small, PLAN)
    assert alloc("evaluate", "small.json", name, "--json").json["assignment"] == PLAN
    assert alloc("evaluate", "small.json", "-", "--json", stdin=text).json["assignment"] == PLAN
    assert alloc("plot", "small.json", name, "--output", "plan.svg") == type(alloc("--version"))(0, "", "")
    solve = ("solve", "small.json", "--method", "local-search", "--iterations", "10", "--json")
    moved = alloc(*solve, "--start", name, "--objective", "makespan-moves", "--makespan-slack", "9").json
    assert (moved["moves"]["moved"], moved["assignment"]) == ([], PLAN)
    assert alloc(*solve, "--pin-file", name).json["pins"] == PLAN
    options = ("--method", "local-search", "--iterations", "10", "--points", "1")
    assert alloc("pareto", "small.json", *options, "--start", name).code == 0


def test_table_of_solve_is_read_back(alloc, small):
    """The .csv of --output can be read back, including idle agents."""
    assert alloc("solve", "small.json", "--method", "greedy", "-q", "--output", "p.csv", "--pin", "a3=").code == 0
    with open("p.csv", newline="") as file:
        rows = {row["agent"]: row["task"] or None for row in csv.DictReader(file)}
    assert rows["a3"] is None
    assert alloc("evaluate", "small.json", "p.csv", "--json").json["assignment"] == rows


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("agent,job\na1,t1\n", "p.csv: line 1: the column 'task' is missing"),
        ("agent;task\na1;t1\n", "p.csv: line 1: has one column only; separate columns by commas"),
        ("agent,task\na1,t1\na1,t2\n", "p.csv: line 3, column agent: 'a1' occurs twice"),
        ("agent,task\n,t1\n", "p.csv: line 2, column agent: is missing"),
        ("agent,task\na1,t1,x\n", "p.csv: line 2: has 3 cells, but there are 2 columns"),
        ("agent,task\na1,t7\n", "p.csv: assignment.a1: no task 't7' in instance 'small'"),
        ("", "p.csv: is empty; its first line must name the columns: agent,task"),
    ],
)
def test_invalid_table_is_one_line(alloc, small, text, message):
    """Errors in a table name file, line and column, with exit code 2."""
    Path("p.csv").write_text(text)
    for command in (("evaluate", "small.json", "p.csv"), ("plot", "small.json", "p.csv", "--output", "p.png")):
        ran = alloc(*command)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert ran.err.startswith(f"alloc: {message}")


def test_a_workbook_is_no_plan(alloc, small):
    """A plan in a workbook, as solve writes it, is refused with what to give instead."""
    alloc("solve", "small.json", "--method", "greedy", "--output", "plan.xlsx", "-q")
    ran = alloc("evaluate", "small.json", "plan.xlsx")
    told = "alloc: plan.xlsx: is a workbook; give the plan as .json, or save its sheet of agents as .csv\n"
    assert (ran.code, ran.out, ran.err) == (2, "", told)


def test_result_without_a_plan_is_drawn(alloc, small):
    """A result without an allocation is drawn as a message, and is not a plan for other commands."""
    result = alloc("solve", "small.json", "--method", "greedy", "--json").json
    result |= dict.fromkeys(("makespan", "served_makespan", "energy", "distance", "reward", "lower_bound", "gap"))
    result |= {"status": "no_solution", "assignment": {}, "battery_remaining_percent": None, "trace": []}
    Path("none.txt").write_text(json.dumps(result))
    assert alloc("plot", "small.json", "none.txt", "--output", "none.svg").code == 0
    assert "no allocation found" in Path("none.svg").read_text()
    ran = alloc("solve", "small.json", "--start", "none.txt")
    assert ran.err == "alloc: none.txt: status: this result contains no allocation; give one with another status\n"
