"""``alloc reproduce``."""

import shutil
from pathlib import Path

from alloc.allocators.experiments.reproduction import figures

DOCS = Path(__file__).parents[4] / "docs" / "reproduction"


def test_page_is_made_from_stored_rows(alloc, monkeypatch):
    """With --page nothing is run: page and figures are made from the rows in the folder."""
    drawn = []
    monkeypatch.setattr(figures, "draw_all", lambda learned, solved, folder: drawn.append(folder))
    shutil.copytree(DOCS, "here/reproduction", ignore=shutil.ignore_patterns("*.png"))
    ran = alloc("reproduce", "here", "--page")
    assert (ran.code, ran.out) == (0, "")
    assert ran.err.startswith("here/reproduction.md: ")
    assert Path("here/reproduction.md").read_bytes() == DOCS.with_suffix(".md").read_bytes()
    assert drawn == [Path("here/reproduction")]


def test_short_run(alloc):
    """Runs are made in processes and not repeated; parts without runs are mentioned."""
    command = ("reproduce", "out", "--runs", "1", "--methods", "greedy", "--workers", "1")
    ran = alloc(*command)
    assert (ran.code, ran.err) == (2, "alloc: out/reproduction: holds no runs of methods that learn; make some first\n")
    rows = Path("out/reproduction/others.csv").read_text()
    assert rows.count("\n") == 5
    alloc(*command)
    assert Path("out/reproduction/others.csv").read_text() == rows


def test_bad_usage_is_one_line(alloc):
    """Unknown methods and folders without runs are one-line errors."""
    for options in (("out", "--methods", "gapo"), ("nowhere", "--page"), ("out", "--runs", "0")):
        ran = alloc("reproduce", *options)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
