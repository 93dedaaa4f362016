import json
import signal
from pathlib import Path

import pytest
from matplotlib.testing.compare import compare_images

from alloc.allocators.pareto import pareto
from alloc.allocators.plotting import plot_front
from alloc.problems.text import number

FIELDS = [
    "method", "status", "stop_reason", "makespan", "lower_bound", "makespan_limit", "energy", "energy_lower_bound",
    "energy_gap", "unserved_tasks", "runtime_s", "assignment",
]  # fmt: skip


def test_front_as_json(alloc, small):
    """Standard output holds alloc-pareto/1, from the fastest point to the cheapest."""
    front = alloc("pareto", "small.json", "--method", "milp", "--points", "4", "--json").json
    assert (front["format"], front["instance"], front["complete"]) == ("alloc-pareto/1", "small", True)
    assert [list(point) for point in front["points"]] == [FIELDS] * len(front["points"])
    assert front["points"][0]["makespan"] == pytest.approx(13 / 11)
    assert front["points"][-1]["energy"] == 0
    assert set(front["points"][0]["assignment"]) == {"a1", "a2", "a3", "a4", "a5"}


def test_table_and_files(alloc, small):
    """A table is printed, the front is written to a file from which another run can start, and a plot is drawn."""
    ran = alloc("pareto", "small.json", "--method", "milp", "--output", "front.json", "--plot", "front.svg")
    assert (ran.code, ran.out) == (0, "")
    assert "saved" in ran.err.splitlines()[0]
    assert "100 %" in ran.err
    first = json.loads(Path("front.json").read_text())
    drawn = Path("front.svg").read_text("utf-8")
    assert f"energy {number(first['points'][0]['energy'], 4)} to T" in drawn
    assert all(label in drawn for label in ("<!-- best found -->", "<!-- proven infeasible -->"))
    again = alloc("pareto", "small.json", "--method", "milp", "--start", "front.json", "--json").json
    assert [point["energy"] for point in again["points"]] == [point["energy"] for point in first["points"]]


def test_one_point_is_drawn(alloc, unservable):
    """With an unserved task there is one point, which is drawn, and exit code 1."""
    ran = alloc("pareto", "unservable.json", "--method", "milp", "--plot", "front.png")
    assert ran.code == 1
    plot_front(pareto(unservable, "milp", handle_signals=False), "expected.png")
    assert compare_images("expected.png", "front.png", 0) is None


def test_one_point_with_energy_is_drawn(alloc, small):
    """A front with a single point can be drawn without warnings: only the table is printed."""
    ran = alloc("pareto", "small.json", "--method", "milp", "--points", "1", "--plot", "front.png")
    assert ran.code == 0
    assert "Warning" not in ran.err
    plot_front(pareto(small, "milp", points=1, handle_signals=False), "expected.png")
    assert compare_images("expected.png", "front.png", 0) is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"format": "alloc-pareto/1"}', "points: must be a list"),
        ('{"format": "alloc-pareto/1", "points": [3]}', "points[0]"),
        ('{"format": "alloc-pareto/1", "points": [{"assignment": {"x": "t1"}}]}', "points[0].assignment: no agent 'x'"),
    ],
)
def test_invalid_fronts_are_reported(alloc, small, text, words):
    """An invalid front gives one line with the file and the place, and exit code 2."""
    Path("front.json").write_text(text)
    ran = alloc("pareto", "small.json", "--start", "front.json")
    assert (ran.code, ran.out) == (2, "")
    assert words in ran.err
    assert ran.err.startswith("alloc: front.json")
    assert ran.err.count("\n") == 1


def test_ctrl_c_saves_the_front_so_far(alloc, small, monkeypatch):
    """After Ctrl-C the front so far is saved and marked as incomplete."""
    monkeypatch.setattr(
        "alloc.cli.commands.experiments.pareto._show_point", lambda result: signal.raise_signal(signal.SIGINT)
    )
    ran = alloc("pareto", "small.json", "--method", "milp", "--output", "front.json")
    assert ran.code == 0
    front = json.loads(Path("front.json").read_text())
    assert front["complete"] is False
    assert len(front["points"]) == 1
