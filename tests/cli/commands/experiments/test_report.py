"""``alloc report``: the page is written atomically, and errors are one line."""

import pytest
from stored_runs import fill

from alloc.allocators.experiments.report.page import libraries, page
from alloc.cli.commands.experiments import report
from alloc.cli.main import main


@pytest.fixture(autouse=True)
def store(tmp_path, monkeypatch):
    """A store in the current folder; libraries, which take seconds to bundle, are replaced."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(page, "libraries", lambda: {})
    fill(tmp_path / "runs.db", instances=1)


def test_page_is_written_and_runs_are_counted(tmp_path, capsys):
    """Stores are read, the title is that of the page, and an older page is replaced."""
    (tmp_path / "report.html").write_text("old")
    assert main(["report", "runs.db", "-o", "report.html", "--title", "One & two"]) == 0
    assert "<h1>One &amp; two</h1>" in (tmp_path / "report.html").read_text()
    assert capsys.readouterr() == ("", "wrote report.html: 6 runs\n")


def test_a_page_without_runs_has_a_note(tmp_path, capsys):
    """A store without runs gives a note, not an error."""
    (tmp_path / "none.db").touch()
    assert main(["report", "none.db", "-o", "report.html"]) == 0
    assert capsys.readouterr() == ("", "note: there are no runs in none.db: report.html is empty\n")


def test_progress_is_shown_on_a_terminal(monkeypatch, capsys):
    """Progress is shown on a terminal, at most once a second."""
    monkeypatch.setattr(report, "is_terminal", lambda stream: True)
    assert main(["report", "runs.db", "-o", "report.html"]) == 0
    assert capsys.readouterr().err == "wrote report.html: 6 runs\n"
    monkeypatch.setattr(report, "EVERY_S", 0.0)
    assert main(["report", "runs.db", "-o", "report.html"]) == 0
    assert "1 of 1 instances" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no.db", "-o", "report.html"], "no.db: there is no such file"),
        (["text", "-o", "report.html"], "text: is not a store of runs"),
        (["runs.db", "-o", "report.pdf"], "report.pdf: must end in .html"),
        (["runs.db", "-o", "no/report.html"], "no/report.html"),
        (["runs.db", "-o", "runs.db"], "runs.db: is STORE and --output at once"),
        (["runs.db", "-o", "report.html", "--against", "ppo"], "--against: 'ppo' is not among the methods greedy, "),
        (["runs.db"], "Missing option '--output'"),
    ],
)
def test_errors_are_one_line(tmp_path, capsys, arguments, message):
    """Exit code 2, one line with the file or option, standard output empty, no page left behind."""
    (tmp_path / "text").write_text("instance,method\n" * 100)
    assert main(["report", *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert message in err
    assert sorted(path.suffix for path in tmp_path.iterdir() if path.suffix in (".html", ".pdf")) == []


def test_missing_packages_are_named(monkeypatch, capsys):
    """The missing package, and how to install it, are one line."""
    monkeypatch.setattr(libraries, "find_spec", lambda name: None if name == "itables" else name)
    assert main(["report", "runs.db", "-o", "report.html"]) == 2
    assert capsys.readouterr().err == (
        "alloc: a report as a page needs itables; install with: pip install 'alloc-mrta[report]'\n"
    )
