"""The paper's experiments made anew: rows that outlive crashes, and a page that is made from them alone."""

import math
import shutil
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from alloc.allocators.experiments.reproduction import folder as module
from alloc.allocators.experiments.reproduction import learning, others
from alloc.allocators.experiments.reproduction.claims import CLAIMS
from alloc.allocators.experiments.reproduction.findings import HOLDS, NOT, UNKNOWN, Data
from alloc.allocators.experiments.reproduction.folder import Folder
from alloc.allocators.experiments.reproduction.protocol import OTHERS, PAPER_METHODS, TESTS, Job, planned
from alloc.allocators.experiments.reproduction.rows import Learned, Solved, append, begin, read
from alloc.allocators.experiments.reproduction.summary import effect, final, fluctuation, reached, runs_of
from alloc.allocators.parallel.serial import SerialEngine
from alloc.problems import InputError
from alloc.problems.generate.paper_scenarios import paper_like

DOCS = Path(__file__).parents[4] / "docs"

ROW = Learned("gappo", 0, 300, 300, TESTS, 60_000, 90_000, 1.02, 1.0, 0.0, 92.0, 0.4, 0.2, 1.0, 40.0)


def history(method: str, run: int, *makespans: float, scenario: int = TESTS) -> list[Learned]:
    """Rows of a run, judged every 100 iterations."""
    return [
        replace(ROW, method=method, run=run, scenario=scenario, iteration=100 * number, makespan=makespan)
        for number, makespan in enumerate(makespans)
    ]


def test_the_shipped_page_is_made_from_the_shipped_rows() -> None:
    """docs/reproduction.md is, byte for byte, what the rows beside it give."""
    assert Folder(DOCS).text() == (DOCS / "reproduction.md").read_text("utf-8")


def test_rows_come_back_and_torn_lines_do_not(tmp_path: Path) -> None:
    """What is appended is read again, infinite and missing figures too; a line cut short by a crash is left out."""
    path = tmp_path / "rows.csv"
    assert read(path, Learned) == []
    begin(path, Learned)
    begin(path, Learned)
    append(path, [ROW, replace(ROW, makespan=math.inf)])
    with path.open("a") as file:
        file.write("gappo,1,300,3")
    assert read(path, Learned) == [ROW, replace(ROW, makespan=math.inf)]
    with pytest.raises(InputError, match="must have the columns method, run, scenario"):
        read(path, Solved)


def test_only_what_is_missing_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An interrupted reproduction keeps the runs that have ended, and goes on with the others."""
    stop, made = threading.Event(), []

    def make_run(data: Path, job: Job) -> None:
        made.append(job)
        append(data / "learning.csv", [replace(ROW, method=job.method, run=job.run)])
        if len(made) == 3:
            stop.set()

    monkeypatch.setattr(module, "make_run", make_run)
    jobs = planned(2, ("gappo", "ppo"), 300, 1.0)
    place = Folder(tmp_path / "out")
    assert not place.make(jobs, SerialEngine(), stop.is_set)
    assert place.missing(jobs) == [Job(1, "ppo")]
    assert place.make(jobs, SerialEngine())
    assert made == jobs
    assert len(place.environments) == 1


def test_figures_and_page_are_made_from_rows(tmp_path: Path) -> None:
    """Five figures and the page are written, though some methods have no runs; without any run there is an error."""
    place = Folder(tmp_path)
    with pytest.raises(InputError, match="holds no runs"):
        place.publish()
    place.data.mkdir()
    for name in ("learning.csv", "others.csv"):
        shutil.copy(DOCS / "reproduction" / name, place.data / name)
    kept = [row for row in place.learned if row.method in ("gappo", "ppo") and row.run == 0]
    (place.data / "learning.csv").unlink()
    begin(place.data / "learning.csv", Learned)
    append(place.data / "learning.csv", kept)
    place.publish()
    assert all((place.data / f"figure-{number}.png").stat().st_size > 5000 for number in range(2, 7))
    assert "here are as few as 1.**" in place.page.read_text("utf-8")


def test_effects_by_hand() -> None:
    """Differences are paired by run; runs without the figure are left out; rises alone are fluctuation."""
    rows = [*history("gappo", 0, 2.0, 1.1, 1.0), *history("ppo", 0, 2.0, 1.0, 1.1), *history("gappo", 1, 2.0, 1.5, 1.2)]
    one = effect(rows, "gappo", "ppo", final("makespan"))
    assert one is not None
    assert (one.runs, one.mean, one.low, one.p) == (1, pytest.approx(-0.1), None, None)
    assert effect(rows, "gappo", "a2c", final("makespan")) is None
    first, second = runs_of(rows, "gappo")
    assert reached(1.1)(first) == 100
    assert reached(1.1)(second) == math.inf
    assert fluctuation(runs_of(rows, "ppo")[0]) == pytest.approx(0.1)
    assert fluctuation(first) == 0


def verdicts(ours: float, theirs: float, runs: int) -> list[str]:
    """Verdicts where `gappo` ends at one makespan and all rivals at another."""
    rows = []
    for run in range(runs):
        for method in PAPER_METHODS:
            makespan = (ours if method == "gappo" else theirs) + 0.001 * run * (method != "gappo")
            rows += history(method, run, 2.0, makespan, makespan)
    return [claim.find(Data(rows, []))[1] for claim in CLAIMS]


def test_verdicts_follow_the_rows() -> None:
    """The first claim holds where `gappo` is ahead of all in every run, fails where it is behind, else is left open."""
    assert verdicts(1.0, 1.1, runs=12)[0] == HOLDS
    assert verdicts(1.3, 1.1, runs=12)[0].startswith(NOT)
    assert verdicts(1.0, 1.1, runs=5)[0].startswith(UNKNOWN)


@pytest.mark.slow
def test_every_method_makes_its_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A short run of each method, learned and not, is judged at each point; a training is repeated to the same rows."""
    small = learning._board([paper_like(8, 3, 24, 1)])
    monkeypatch.setattr(learning, "DECISIONS", 10)
    monkeypatch.setattr(learning, "_boards", lambda run: {TESTS: small, 4: small})
    monkeypatch.setattr(others, "SCENARIOS", (1,))
    jobs = [Job(0, method, iterations=5, time_limit_s=0.05) for method in (*PAPER_METHODS, *OTHERS)]
    place = Folder(tmp_path)
    place.make(jobs, SerialEngine())
    assert place.missing(jobs) == []
    judged = [(row.scenario, row.iteration) for row in place.learned if row.method == "dqn"]
    assert judged == [(TESTS, 0), (4, 0), (TESTS, 5), (4, 5)]
    assert [math.isfinite(row.drawn) for row in place.learned[:4]] == [False, False, True, False]
    assert {row.makespan >= row.lower_bound == 1 for row in place.solved} == {True}
    again = Folder(tmp_path / "again")
    again.make(jobs[:1], SerialEngine())
    ours = [replace(row, seconds=0.0) for row in place.learned if row.method == "gappo"]
    assert str([replace(row, seconds=0.0) for row in again.learned]) == str(ours)
