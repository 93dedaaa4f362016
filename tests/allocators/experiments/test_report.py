"""Reports: the same runs as tables in Markdown and LaTeX, and as rows in CSV and Parquet."""

import csv
import io
import re
from dataclasses import fields, replace

import pytest

from alloc.allocators import Budget
from alloc.allocators.experiments.report import runs as runs_module
from alloc.allocators.experiments.report.files import check_report, latex, write_report
from alloc.allocators.experiments.report.table import Table
from alloc.allocators.experiments.report.tables import report_tables
from alloc.allocators.experiments.standings import best_known, standings
from alloc.allocators.experiments.store.key import Run
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.store import Store
from alloc.allocators.experiments.stored import doubts, planned, rows_of
from alloc.problems import InputError, Instance, MissingPackageError

TRACE = ((0.25, None, 3.0, None), (0.5, 1.0, 2.0, 1.0))


def ending(makespan, **others):
    figures = {
        "makespan": makespan,
        "served_makespan": makespan,
        "energy": 2.0,
        "gap": 0.1,
        "runtime_s": 0.5,
        "unserved": 0,
        "status": "feasible",
    }
    return Ending(outcome=Outcome.SOLVED, trace=TRACE, **{**figures, **others})


@pytest.fixture
def compared(tmp_path):
    """Four instances, two seeds: ``a_1`` always needs 1, ``b`` 1.5, but fails once."""
    instances = [Instance(name=f"i{number}", ability=[1, number + 1], workload=[3]) for number in range(4)]
    methods = {"a_1": ("greedy", {}), "b": ("ga", {"population": 4})}
    with Store(tmp_path / "runs.db") as store:
        plan = planned(store, instances, methods, [0, 1], objective="makespan-energy", budget=Budget(1.0))
        for (number, label, seed), job in plan.jobs.items():
            assert store.claim([job.run.key]).key == job.run.key
            found = ending(1.0 if label == "a_1" else 1.5)
            if (number, label, seed) == (3, "b", 1):
                found = Ending(outcome=Outcome.FAILED, reason="ValueError: no", details="Traceback")
            store.finish(job.run, found)
        endings = plan.endings(store)
    return plan, endings, rows_of(plan, endings)


def test_tables_show_methods_and_outcomes(compared):
    """Tables show methods, outcomes, differences of both objectives, profiles and targets, and note small samples."""
    tables = {table.title: table for table in report_tables(*compared)}
    assert list(tables) == [
        "Methods",
        "How runs ended",
        "Against a_1: T",
        "Against a_1: energy",
        "Performance profiles",
        "Relative to the best known",
        "Relative to the other methods",
        "Targets over time",
    ]
    assert tables["Methods"].rows == [
        ["a_1", "8", "4", "1", "10 %", "2", "0.5"],
        ["b", "7", "3", "1.5", "10 %", "2", "0.5"],
    ]
    assert "4 instances, 2 seeds; makespan-energy; 1 s, 1 thread" in tables["Methods"].notes[0]
    assert tables["How runs ended"].rows == [["a_1", "8", "0"], ["b", "7", "1"]]
    (cells,) = tables["Against a_1: T"].rows
    assert cells[:7] == ["b", "0", "0", "3", "+50 %", "+50 %", "+50 %"]
    notes = " ".join(tables["Against a_1: T"].notes)
    assert "Small sample: 3 instances" in notes
    assert "Left out: up to 1 instance on which one of the two methods has no value" in notes
    assert tables["Performance profiles"].rows[1][1:] == ["0 %"] * 6 + ["75 %"] * 2
    assert tables["Targets over time"].rows[0][-1] == "100 %"


def test_standings_show_wins_and_excess(compared):
    """Methods with the best result, or a tie, are first, late runs never; excess is of runs that serve all tasks."""
    tables = {table.title: table for table in report_tables(*compared)}
    (best, other), beside = tables["Relative to the best known"].rows, tables["Relative to the other methods"].rows
    assert best[:5] == ["a_1", "1", "1", "8 of 8", "0"]
    assert other[:4] == ["b", "1.5", "1.5", "0 of 8"]
    assert best[7:10] == ["1.000", "1.000", "1.000"]
    assert beside[0][1:3] == ["-33.333%", "-33.333%"]
    assert beside[1][1:3] == ["+50.000%", "+50.000%"]
    assert [row[5] for row in beside] == ["8", "0"]
    assert [row[-1] for row in beside] == ["0", "1"]
    late = {"a": [[ending(1.0, runtime_s=1.3)]], "b": [[ending(2.0)]]}
    assert [one.first for one in standings(late, best_known(late), 1.0, energy=True).values()] == [0, 1]
    assert [one.first for one in standings(late, best_known(late), 2.0, energy=True).values()] == [1, 0]


def test_runs_that_shared_processors_are_reported():
    """Timed runs with little processor time cause a warning; short, untimed and quick ones do not."""
    poor = ending(1.0, cores="0", runtime_s=1.0, cpu_s=0.5)
    fine = ending(1.0, cores="0", runtime_s=1.0, cpu_s=0.99)
    others = [ending(1.0, cores="0", runtime_s=0.01, cpu_s=0.001), ending(1.0, runtime_s=1.0, cpu_s=0.1), None]
    (told,) = doubts({"a": [[poor, fine], others]})
    assert told.startswith("1 of 2 timed runs had less than 90 % of a processor")
    assert doubts({"a": [[fine], others]}) == []


def test_markdown_and_latex_hold_the_same_cells(compared, tmp_path):
    """Every cell of every table is in both, in LaTeX with its special characters escaped."""
    for name in ("r.md", "r.tex"):
        write_report(tmp_path / name, *compared[:2], lambda: report_tables(*compared))
    text, tex = (tmp_path / "r.md").read_text(), (tmp_path / "r.tex").read_text()
    for table in report_tables(*compared):
        for row in table.rows:
            assert "| " + " | ".join(row) + " |" in text
            assert " & ".join(row).replace("%", r"\%").replace("_", r"\_") + r" \\" in tex
    assert tex.count(r"\toprule") == tex.count(r"\bottomrule") == text.count("## ")


def test_latex_escapes_special_characters():
    """Names of methods may contain any character; braces and environments stay balanced."""
    text = latex([Table("50% of a_b", ["m", "x"], [["a{b}&c$#~^\\", "1"]], ["note"])])
    assert r"a\{b\}\&c\$\#\textasciitilde{}\textasciicircum{}\textbackslash{} & 1 \\" in text
    assert r"\caption{50\% of a\_b. note}" in text
    plain = re.sub(r"\\[{}]", "", text)
    assert plain.count("{") == plain.count("}")


def test_csv_has_a_row_for_each_run(compared, tmp_path):
    """The columns are the fields of a run and its ending, except the long ones; None is empty."""
    write_report(tmp_path / "runs.csv", *compared[:2], lambda: report_tables(*compared))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "runs.csv").read_text())))
    names = [field.name for kind in (Run, Ending) for field in fields(kind)]
    assert list(rows[0]) == [
        "instance_name",
        "label",
        *(name for name in names if name not in ("details", "trace", "measures")),
    ]
    assert len(rows) == 16
    assert (rows[1]["label"], rows[1]["method"], rows[1]["parameters"]) == ("b", "ga", '{"population": 4}')
    assert [row["reason"] for row in rows if row["outcome"] == "failed"] == ["ValueError: no"]
    assert rows[0]["iterations"] == ""


@pytest.mark.needs("pyarrow")
def test_parquet_has_the_traces(compared, tmp_path):
    """A trace is a list of points with names; columns have the same types whatever the runs are."""
    import pyarrow.parquet

    write_report(tmp_path / "runs.parquet", *compared[:2], lambda: report_tables(*compared))
    table = pyarrow.parquet.read_table(tmp_path / "runs.parquet")
    points = [dict(zip(("time_s", "makespan", "energy", "lower_bound"), point, strict=True)) for point in TRACE]
    assert table["trace"][0].as_py() == points
    assert str(table.schema.field("iterations").type) == "int64"
    assert table["details"].to_pylist().count("Traceback") == 1


def test_unsupported_files_are_refused(compared, tmp_path, monkeypatch):
    """An unknown suffix, a missing package and a missing folder are reported before any run."""
    with pytest.raises(InputError, match=r"must end in \.md, \.tex, \.csv or \.parquet"):
        check_report(tmp_path / "runs.txt")
    with pytest.raises(InputError, match="there is no folder"):
        check_report(tmp_path / "absent" / "runs.md")
    monkeypatch.setattr(runs_module, "find_spec", lambda name: None)
    with pytest.raises(MissingPackageError, match=r"pip install 'alloc-mrta\[parquet\]'"):
        check_report(tmp_path / "runs.parquet")


def test_unfinished_runs_have_no_row(compared):
    """Runs that have not ended have no rows in the tables or the CSV."""
    plan, endings, _ = compared
    open_ones = {label: [[None, None], *lists[1:]] for label, lists in endings.items()}
    assert [row.instance for row in rows_of(plan, open_ones)] == ["i1", "i1", "i2", "i2", "i3", "i3"]
    assert len(runs_module.run_rows(plan, open_ones)) == 12
    partly = {**endings, "b": [[None, replace(ending(1.5), status="optimal")], *endings["b"][1:]]}
    assert rows_of(plan, partly)[1].runs == 1
