import csv
import io
import json
import os
import re
import signal
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from alloc.problems import Units
from alloc.problems.formats import write_instance


def test_table_has_a_row_per_instance_and_method(alloc, small, unservable):
    """Each instance and method has one row over all seeds, with T, gap, energy and time."""
    ran = alloc("compare", "small.json", "unservable.json", "--methods", "greedy,cpsat", "--seeds", "2", "--json")
    assert ran.code == 1  # a task of one instance cannot be served
    rows = ran.json["rows"]
    assert [(row["instance"], row["method"]) for row in rows] == [
        ("small", "greedy"),
        ("small", "cpsat"),
        ("unservable", "greedy"),
        ("unservable", "cpsat"),
    ]
    assert [row["runs"] for row in rows] == [2, 2, 2, 2]
    assert rows[1]["makespan_mean"] == pytest.approx(13 / 11)
    assert rows[2]["makespan_mean"] is None
    assert rows[2]["unserved"] == 1


def test_headings_have_the_units_that_all_instances_share(alloc, small):
    """T and energy have their units, unless instances disagree."""
    write_instance(replace(small, name="timed", units=Units(time="h", energy="kWh")), "timed.json")
    assert re.search(r" T \(h\) .* energy \(kWh\) ", alloc("compare", "timed.json", "--methods", "greedy").err)
    ran = alloc("compare", "small.json", "timed.json", "--methods", "greedy")
    assert re.search(r" T +worst .* energy +time", ran.err)


def test_table_and_csv_have_the_same_rows(alloc, small):
    """People get a table on standard error; --csv writes the same rows, - to standard output."""
    ran = alloc("compare", "small.json", "--methods", "greedy", "--csv", "t.csv")
    assert (ran.code, ran.out) == (0, "")
    assert re.search(r"method +T +worst +gap", ran.err)
    rows = list(csv.DictReader(io.StringIO(Path("t.csv").read_text())))
    assert rows[0]["method"] == "greedy"
    assert float(rows[0]["makespan_mean"]) >= 13 / 11 - 1e-9
    assert alloc("compare", "small.json", "--methods", "greedy", "--csv", "-").out.startswith("instance,method,")


def test_refusal_is_a_row(alloc):
    """A method that refuses an instance has a row with the reason, and the others have their figures."""
    Path("fast.json").write_text(
        json.dumps(
            {
                "format": "alloc-instance/1",
                "agents": [{"id": "a", "ability": 1, "speed": 2, "position": [0, 0]}],
                "tasks": [{"id": "t", "workload": 1, "position": [1, 1]}],
            }
        )
    )
    ran = alloc("compare", "fast.json", "--methods", "ga,greedy", "--json")
    assert ran.code == 0
    refused, figures = ran.json["rows"]
    assert "finite speeds" in refused["reason"]
    assert (refused["runs"], figures["runs"], figures["reason"]) == (0, 1, "")
    assert "refuses" in alloc("compare", "fast.json", "--methods", "ga,greedy").err


@pytest.fixture
def compared(monkeypatch):
    """Records the methods and seeds passed to `compare`, instead of running them."""
    asked = []
    monkeypatch.setattr(
        "alloc.allocators.experiments.compare.compare",
        lambda instances, methods, seeds, **options: asked.append((methods, seeds)) or [],
    )
    return asked


@pytest.mark.parametrize(("text", "seeds"), [("3", [0, 1, 2]), ("7,", [7]), ("4,2,4", [4, 2]), ("0, 5", [0, 5])])
def test_seeds_are_a_count_or_a_list(alloc, small, compared, text, seeds):
    """A number is a count, a list is a list."""
    alloc("compare", "small.json", "--methods", "greedy", "--seeds", text)
    assert compared == [({"greedy": "greedy"}, seeds)]


def test_interrupted_comparison_prints_what_is_finished(alloc, small):
    """Ctrl-C ends the comparison; complete rows are printed."""
    alloc("generate", "random", "--agents", "40", "--tasks", "13", "--real", "--seed", "2", "--output", "hard.json")
    threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
    ran = alloc("compare", "small.json", "hard.json", "--methods", "greedy,ga", "--time-limit", "30", "--json")
    assert "interrupted after" in ran.err
    done = [(row["instance"], row["method"]) for row in ran.json["rows"]]
    assert ran.code == 1  # though every task is served in the rows that there are
    assert all(row["unserved"] == 0 for row in ran.json["rows"])
    assert ("small", "greedy") in done
    assert ("hard", "ga") not in done


def test_methods_with_parameters_in_brackets(alloc, small, compared, monkeypatch):
    """Commas within brackets separate parameters and parts of values; labels in rows are as written."""
    loaded = []
    monkeypatch.setattr("alloc.allocators.load", lambda name, **settings: loaded.append((name, settings)) or name)
    text = "greedy, ga[population=40,rates=0.1,0.2,elite=true],auto,ga[population=400]"
    alloc("compare", "small.json", "--methods", text)
    ((methods, _),) = compared
    assert list(methods) == ["greedy", "ga[population=40,rates=0.1,0.2,elite=true]", "auto", "ga[population=400]"]
    assert loaded == [("ga", {"population": 40, "rates": (0.1, 0.2), "elite": True}), ("ga", {"population": 400})]


@pytest.mark.parametrize("methods", ["ga[population=3", "ga[population=3]x", "ga[population]", "ga[nonsense=3]"])
def test_invalid_brackets_are_bad_usage(alloc, small, methods):
    """Text that is not NAME[PARAMETER=VALUE,...], or an unknown parameter, gives one line and exit code 2."""
    ran = alloc("compare", "small.json", "--methods", methods)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)


def test_instances_have_the_same_names_with_and_without_a_store(alloc):
    """Folders, patterns and families also work without a store, and folders and patterns of missions."""
    alloc("generate", "random", "--agents", "4", "--tasks", "2", "--count", "2", "--seed", "1", "--output", "some")
    for source, names in (
        ("some", ["random-4x2-seed-1", "random-4x2-seed-2"]),
        ("some/*-2.json", ["random-4x2-seed-2"]),
        ("random[agents=4,tasks=2]:7", ["random[agents=4,tasks=2]:7"]),
    ):
        ran = alloc("compare", source, "--methods", "greedy", "--json")
        assert [row["instance"] for row in ran.json["rows"]] == names
    for folder in ("missions", "empty"):
        Path(folder).mkdir()
    for seed in "12":
        sizes = ("--agents", "2", "--tasks", "2", "--seed", seed)
        alloc("generate", "mission", *sizes, "--output", f"missions/{seed}.json")
    for source, count in (("missions", 2), ("missions/[2-9].json", 1)):
        assert len(alloc("compare", source, "--policies", "nearest", "--json").json["rows"]) == count
    for source, wrong in (("empty", "empty: contains no missions"), ("*.npz", "*.npz: matches no file")):
        ran = alloc("compare", source, "--policies", "nearest")
        assert (ran.code, ran.err) == (2, f"alloc: {wrong}\n")
