"""The page of a report: its data, and that nothing stored becomes HTML or script."""

import base64
import gzip
import json
import os
import re
import sqlite3
import tempfile
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from stored_runs import ANGRY, MACHINE, fill

from alloc.allocators import report_html
from alloc.allocators.experiments.profiles import profiles, targets_reached
from alloc.allocators.experiments.report.page import details as details_module
from alloc.allocators.experiments.report.page import libraries
from alloc.allocators.experiments.report.page import summary as summary_module
from alloc.allocators.experiments.report.page.groups import laid_out
from alloc.allocators.experiments.report.page.page import check_page
from alloc.allocators.experiments.report.page.series import series
from alloc.allocators.experiments.report.page.source import EDGES_S, read_stores, thinned
from alloc.allocators.experiments.statistics import differences
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.plan import packed, unpacked
from alloc.allocators.experiments.store.store import Store
from alloc.problems import Allocation, InputError, MissingPackageError


@pytest.fixture(autouse=True)
def without_libraries(monkeypatch):
    """Replaces the libraries, which take seconds to bundle and are not tested here."""
    monkeypatch.setattr("alloc.allocators.experiments.report.page.page.libraries", lambda: {"library-vega": ""})


@pytest.fixture
def store(tmp_path):
    fill(tmp_path / "runs.db")
    return tmp_path / "runs.db"


def data_of(page):
    """Return all data of a page, by the ids of its elements."""
    found = re.findall(r'id="data-([^"]+)">([^<]+)</script>', page.read_text())
    return {name: json.loads(gzip.decompress(base64.b64decode(text))) for name, text in found if text}


def written(store, tmp_path, **options):
    report_html([store], tmp_path / "report.html", **options)
    return data_of(tmp_path / "report.html")


def test_page_shows_runs_and_outcomes(store, tmp_path):
    """Conditions, methods with their parameters, means, outcomes, and the statistics that `differences` gives."""
    main = written(store, tmp_path)["main"]
    (group,) = main["groups"]
    told = group["conditions"]
    assert (told["objective"], told["time_limit_s"], told["runs"], told["instances"]) == ("makespan-energy", 1.0, 24, 4)
    assert (told["revision"], told["machine"]) == ("abc+", MACHINE)
    assert main["labels"] == ["greedy", "ga[population=4]", "hedonic"]
    rows = {main["labels"][row["method"]]: row for row in group["methods"]}
    assert rows["greedy"]["makespan"] == 1.0
    assert rows["ga[population=4]"]["ratio"] == 1.5
    assert (rows["ga[population=4]"]["served"], rows["ga[population=4]"]["instances"]) == (3, 4)
    assert rows["ga[population=4]"]["outcomes"] == {"solved": 7, "failed": 1}
    assert rows["greedy"]["gap"] == 0.2  # against the best bound of any method
    layout = laid_out(read_stores([store]))
    expected = differences(layout.groups[0].endings)[0]
    (one,) = [row for row in group["paired"] if (row["method"], row["against"], row["score"]) == (1, 0, "makespan")]
    assert (one["mean"], one["better"], one["left_out"]) == (expected.mean, expected.better, expected.left_out)
    assert one["p_holm"] == float(f"{expected.p_holm:.6g}")


def test_means_are_over_instances_that_every_method_served(store, tmp_path):
    """A method does not benefit from failing on hard instances; without a common instance there are no means."""
    of = "WHERE method = 'greedy' AND instance {} (SELECT instance FROM instances WHERE name = 'i3')"
    with sqlite3.connect(store) as edited:
        edited.execute("UPDATE runs SET makespan = 100.0, energy = 100.0, runtime_s = 100.0 " + of.format("IN"))
    (group,) = written(store, tmp_path)["main"]["groups"]
    greedy, ga, hedonic = group["methods"]  # ga fails on i3
    assert (greedy["served"], ga["served"]) == (4, 3)
    figures = ("makespan", "ratio", "gap", "energy", "runtime_s")
    assert [greedy[name] for name in figures] == [1.0, 1.0, 0.2, 2.0, 0.5]
    assert [ga[name] for name in figures] == [1.5, 1.5, pytest.approx(1 - 0.8 / 1.5, rel=1e-5), 3.0, 0.5]
    assert [hedonic[name] for name in figures] == [None] * 5
    assert any(note.startswith("Means are over the 3 of 4 instances") for note in group["notes"])
    with sqlite3.connect(store) as edited:
        edited.execute("UPDATE runs SET makespan = NULL " + of.format("NOT IN"))
    (group,) = written(store, tmp_path)["main"]["groups"]
    assert [row["makespan"] for row in group["methods"]] == [None] * 3
    assert any(note.startswith("No instance was served by every method") for note in group["notes"])


def test_methods_are_compared_with_a_reference(store, tmp_path, monkeypatch):
    """The first method is the reference, or the one that is asked for; an unknown one is an error that names all."""
    found = written(store, tmp_path)["main"]["groups"][0]["paired"]
    assert {row["against"] for row in found} == {0, 1}  # the third one solved nothing
    monkeypatch.setattr(summary_module, "MAX_PAIRED", 0)
    assert {row["against"] for row in written(store, tmp_path)["main"]["groups"][0]["paired"]} == {0}
    asked = written(store, tmp_path, against="ga[population=4]")["main"]["groups"][0]["paired"]
    assert {row["against"] for row in asked} == {1}
    with pytest.raises(InputError, match=r"against: 'x' is not among the methods greedy, ga\[population=4\]"):
        report_html([store], tmp_path / "report.html", against="x")


def test_stored_data_are_never_markup(store, tmp_path):
    """Names and tracebacks with tags are only in the compressed data; the title is escaped."""
    data = written(store, tmp_path, title=f"All {ANGRY}")
    text = (tmp_path / "report.html").read_text()
    assert ANGRY in data["main"]["instances"]["name"]
    assert ANGRY in data["main"]["failures"][1]["details"]
    assert ANGRY not in text
    assert text.count("</script>") == text.count("<script")
    assert "<title>All &lt;/script&gt;" in text


def test_runs_are_stored_as_columns_with_their_failures(store, tmp_path):
    """Each run has its values at the same index of all columns; repeated failures are stored once."""
    data = written(store, tmp_path)
    runs, failures = data["runs"], data["main"]["failures"]
    assert {len(column) for column in runs.values()} == {24}
    (failed,) = [place for place, outcome in enumerate(runs["outcome"]) if outcome == "failed"]
    assert (runs["makespan"][failed], failures[runs["failure"][failed]]["reason"]) == (None, "ValueError: no")
    refused = [place for place, outcome in enumerate(runs["outcome"]) if outcome == "refused"]
    assert len({runs["failure"][place] for place in refused}) == 1
    assert [one["runs"] for one in failures] == [8, 1]


def test_maps_contain_places_groups_and_plans(store, tmp_path):
    """Places are exact to three digits; each method has its best plan, with groups and times."""
    data = written(store, tmp_path)
    main, detail = data["main"], data["detail-0"]
    number = main["instances"]["name"].index("i1")
    shown = detail[str(number)]["map"]
    places = np.array(shown["origin"]) + shown["unit"] * np.array(shown["task"]["place"])
    np.testing.assert_allclose(places, [[0, 0], [3, 1]], atol=1e-3)
    assert shown["agent"]["id"] == ["a1", "a2", "a3"]
    plan = next(one for one in shown["plans"] if one["method"] == 0)
    assert (plan["of"], plan["count"], plan["ability"], plan["done"]) == ([0, 0, 1], [2, 1], [3.0, 3.0], [1.0, 1.0])
    assert (detail[str(number)]["groups"], main["most_traces"]) == ([0], details_module.MAX_TRACES)
    assert main["edges_s"] == pytest.approx(EDGES_S, rel=1e-5)
    worst = next(one for one in shown["plans"] if one["method"] == 1)
    assert (worst["done"][1], worst["count"]) == (None, [3, 0])
    trace = detail[str(number)]["traces"][0]["steps"]
    assert [EDGES_S[trace[0]] >= 0.5, trace[1], len(trace)] == [True, 1.0, 2]


def test_large_instances_are_sampled_and_maps_limited_in_size(store, tmp_path, monkeypatch):
    """Maps of large instances show a subset of agents and tasks; beyond the size limit, instances have no map."""
    for limit in ("MAX_AGENTS", "MAX_TASKS"):
        monkeypatch.setattr(details_module, limit, 1)
    shown = written(store, tmp_path)["detail-0"]["0"]["map"]
    assert (len(shown["agent"]["id"]), len(shown["task"]["id"]), shown["agents"], shown["tasks"]) == (1, 1, 3, 2)
    assert set(shown["plans"][0]["of"]) <= {-2, -1, 0}
    monkeypatch.setattr(details_module, "CHUNK", 1)
    monkeypatch.setattr("alloc.allocators.experiments.report.page.page.DETAIL_BYTES", 0)
    monkeypatch.setattr("alloc.allocators.experiments.report.page.page.DETAIL_BYTES_A_RUN", 0)
    assert sorted(written(store, tmp_path)["main"]["instances"]["chunk"]) == [-1, -1, -1, 0]


def test_thinned_traces_reach_the_same_targets():
    """A thinned trace agrees with the full one at all times drawn on a page, and is far shorter."""
    rng = np.random.default_rng(1)
    endings = {}
    for label in "ab":
        times = np.sort(10 ** rng.uniform(-4, 1.5, 500))
        makespans = np.sort(rng.uniform(1, 1.1, 500))[::-1]
        trace = tuple((time, makespan, 1.0, None) for time, makespan in zip(times, makespans, strict=True))
        endings[label] = [[Ending(outcome=Outcome.SOLVED, makespan=makespans[-1], trace=trace)]]
    short = {
        label: [[Ending(outcome=Outcome.SOLVED, makespan=one.makespan, trace=thinned(one.trace))]]
        for label, [[one]] in endings.items()
    }
    assert len(short["a"][0][0].trace) < 110
    assert targets_reached(short, EDGES_S) == targets_reached(endings, EDGES_S)


def test_series_match_the_statistics(store):
    """Profiles are those of `profiles`; quantiles of curves, gaps and sizes are of the runs; points are instances."""
    layout = laid_out(read_stores([store]))
    (group,) = layout.groups
    found = series(layout, group)
    shares = profiles(group.endings_in_common, found["profiles"][1]["x"])
    assert found["profiles"][1]["y"] == shares["ga[population=4]"]
    curve = found["time"][1]
    assert curve["middle"][-1] == pytest.approx(0.5)
    assert curve["middle"][0] is None
    assert [one["x"] for one in found["tradeoff"]] == [[1.0] * 4, [1.5] * 3]
    assert [one["middle"] for one in found["gaps"]] == pytest.approx([0.2, 1 - 0.8 / 1.5])
    sizes = {one["measure"]: one for one in found["scaling"] if one["method"] == 0}
    assert sizes["runtime_s"]["agents"] == pytest.approx(3)
    assert sizes["runtime_s"]["middle"] == 0.5


def test_runs_under_other_conditions_are_distinguished(store, tmp_path):
    """Another budget is another group; a plugin's version is part of its method; the same run twice counts once."""
    fill(tmp_path / "more.db", time_limit_s=2.0)
    report_html([store, tmp_path / "more.db", store], tmp_path / "report.html")
    main = data_of(tmp_path / "report.html")["main"]
    assert sorted(one["conditions"]["time_limit_s"] for one in main["groups"]) == [1.0, 2.0]
    assert [one["conditions"]["runs"] for one in main["groups"]] == [24, 24]
    with sqlite3.connect(store) as edited:
        edited.execute("UPDATE runs SET version = version || ' + plug 1' WHERE method = 'hedonic' AND seed = 0")
        edited.execute("UPDATE runs SET version = version || ' + plug 2' WHERE method = 'hedonic' AND seed = 1")
    found = written(store, tmp_path)["main"]
    assert len(found["groups"]) == 1
    assert sorted(found["labels"]) == ["ga[population=4]", "greedy", "hedonic (plug 1)", "hedonic (plug 2)"]


def test_plan_and_record_of_a_run_come_from_the_same_store(tmp_path):
    """If a run is in two stores, the record that ended last counts, with its plan, whatever the order of the stores."""
    stores = [tmp_path / "early.db", tmp_path / "late.db"]
    for store in stores:
        fill(store, instances=1, methods=["greedy"])
    with sqlite3.connect(stores[1]) as edited:
        edited.execute("UPDATE runs SET finished_at = finished_at + 1")
        edited.execute("UPDATE plans SET plan = ?", (packed(Allocation([-1, 1, 0])),))
    for order in (stores, stores[::-1]):
        archive = read_stores(order)
        plans = archive.plans(list(archive.records))
        assert [unpacked(plan).task_of_agent.tolist() for plan in plans.values()] == [[-1, 1, 0]] * 2


def test_mission_time_is_used_as_makespan(store, tmp_path):
    """Runs of policies have measures as JSON; an unfinished mission has no time."""
    with sqlite3.connect(store) as edited:
        if "measures" not in {row[1] for row in edited.execute("PRAGMA table_info(runs)")}:
            edited.execute("ALTER TABLE runs ADD COLUMN measures TEXT")
        edited.execute("""UPDATE runs SET makespan = NULL, measures = '{"mission_time": null}'""")
        done = '{"mission_time": 5.0, "mission_time_lower_bound": 4.0}'
        edited.execute("UPDATE runs SET measures = ? WHERE method = 'greedy'", (done,))
    main = written(store, tmp_path)["main"]
    rows = {main["labels"][row["method"]]: row for row in main["groups"][0]["methods"]}
    assert (rows["greedy"]["makespan"], rows["greedy"]["gap"]) == (5.0, 0.2)
    assert rows["ga[population=4]"]["makespan"] is None


def test_missing_data_are_reported(tmp_path):
    """No runs, one run, one method, only failures and no bounds: the page is written, and notes say what is missing."""
    Store(tmp_path / "runs.db").close()
    assert written(tmp_path / "runs.db", tmp_path)["main"]["groups"] == []
    (tmp_path / "none.db").write_bytes(b"")
    assert written(tmp_path / "none.db", tmp_path)["main"]["groups"] == []
    cases = {
        "Only one method": {"methods": ["greedy"]},
        "Small sample: 1 instance in common": {"instances": 1},
        "No run was solved": {"methods": ["hedonic"]},
        "No run proved a bound": {"methods": ["greedy"], "bound": None},
    }
    for number, (words, options) in enumerate(cases.items()):
        fill(tmp_path / f"{number}.db", **options)
        (group,) = written(tmp_path / f"{number}.db", tmp_path)["main"]["groups"]
        assert any(note.startswith(words) for note in group["notes"]), (words, group["notes"])


def test_store_of_the_first_version_has_no_maps(store, tmp_path):
    """It is read without being changed; missing data are left out."""
    with sqlite3.connect(store) as older:
        older.executescript(
            "DROP TABLE plans; DROP TABLE contents; ALTER TABLE runs DROP COLUMN revision; PRAGMA user_version = 1"
        )
    data = written(store, tmp_path)
    assert "map" not in data["detail-0"]["0"]
    assert data["main"]["groups"][0]["conditions"]["revision"] == ""
    assert sqlite3.connect(store).execute("PRAGMA user_version").fetchone() == (1,)


def test_unreadable_and_unwritable_files_are_errors(store, tmp_path, monkeypatch):
    """A missing store, another suffix, and a missing package are errors of one line; no page is left behind."""
    with pytest.raises(InputError, match=r"no\.db: there is no such file"):
        report_html([tmp_path / "no.db"], tmp_path / "report.html")
    assert not (tmp_path / "no.db").exists()
    with pytest.raises(InputError, match=r"must end in \.html"):
        report_html([store], tmp_path / "report.pdf")
    with pytest.raises(InputError, match="stores: must name at least one store"):
        report_html([], tmp_path / "report.html")
    monkeypatch.setattr(libraries, "find_spec", lambda name: None)
    with pytest.raises(MissingPackageError, match=r"Jinja2 and vl-convert-python and itables.*alloc-mrta\[report\]"):
        check_page(tmp_path / "report.html")
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".html"] == []


def test_progress_is_reported(store, tmp_path):
    """The progress of a long report is reported."""
    said = []
    report_html([store], tmp_path / "report.html", progress=said.append)
    assert said == ["statistics of 1 of 1 conditions", "4 of 4 instances"]


@pytest.fixture
def foreign_folder():
    """A read-only folder of another user; this process acts as a user without write permission meanwhile."""
    with tempfile.TemporaryDirectory() as name:
        folder, own = Path(name), os.geteuid()
        fill(folder / "runs.db", methods=["greedy"])
        writer = sqlite3.connect(folder / "runs.db")
        with closing(writer):
            yield folder, writer, lambda: (folder.chmod(0o555), os.seteuid(own or NOBODY))
            os.seteuid(own)
            folder.chmod(0o755)


NOBODY = 65534


@pytest.mark.skipif(not hasattr(os, "seteuid"), reason="users and their rights are those of POSIX")
def test_store_in_a_read_only_folder_is_read_unless_in_use(foreign_folder):
    """Runs in the write-ahead log are seen if SQLite can read it; a leftover log is a one-line error."""
    folder, writer, become_another = foreign_folder
    writer.execute("UPDATE runs SET makespan = 7.0")
    writer.commit()
    become_another()
    assert {record.ending.makespan for record in read_stores([folder / "runs.db"]).records.values()} == {7.0}
    os.seteuid(os.getuid())
    folder.chmod(0o755)
    for part in ("", "-wal"):
        (folder / f"copy.db{part}").write_bytes((folder / f"runs.db{part}").read_bytes())
    writer.close()
    become_another()
    assert {record.ending.makespan for record in read_stores([folder / "runs.db"]).records.values()} == {7.0}
    with pytest.raises(InputError, match=r"copy\.db: is being written, .*copy\.db-wal shows, .* read-only here"):
        read_stores([folder / "copy.db"])
