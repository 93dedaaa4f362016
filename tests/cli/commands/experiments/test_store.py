"""``alloc compare --store``: runs are stored, and made only once."""

import csv
import os
import resource
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import evil_methods
import pytest
from campaign_kills import kill_often
from in_process import InProcess

from alloc.cli.commands.experiments import stored
from alloc.problems import paper
from alloc.problems.formats import write_instance

TINY = "random[agents=3,tasks=2]"
QUICK = ("--iterations", "5", "--store", "runs.db", "--workers", "1")


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """Installs the misbehaving methods for commands in this and other processes, and returns a folder for records."""
    folder = tmp_path / "plugin"
    folder.mkdir()
    evil_methods.install(folder)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", f"{folder}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    monkeypatch.setenv("NAPS", str(tmp_path / "naps"))
    monkeypatch.setenv("FORKED", str(tmp_path / "forked"))
    return tmp_path


@pytest.fixture
def in_process(monkeypatch):
    """Executes runs in this process."""
    monkeypatch.setattr(stored, "_place", lambda storage: InProcess())


def begun():
    file = Path("naps")
    return [line.split()[1:3] for line in file.read_text().splitlines() if line.startswith("begin")]


@pytest.mark.usefixtures("in_process")
def test_only_missing_runs_are_made(alloc, plugin):
    """With an additional seed, instance or method, only missing runs are made; the table has the requested ones."""
    first = alloc("compare", f"{TINY}:1", "--methods", "nap", *QUICK, "--json")
    assert (first.code, len(begun())) == (0, 1)
    more = alloc("compare", f"{TINY}:0-1", "--methods", "greedy,nap", "--seeds", "2", *QUICK, "--json")
    assert more.code == 0
    assert sorted(begun()) == [[f"{TINY}:{instance}", seed] for instance in "01" for seed in "01"]
    assert [(row["instance"][-1], row["method"], row["runs"]) for row in more.json["rows"]] == [
        ("0", "greedy", 2),
        ("0", "nap", 2),
        ("1", "greedy", 2),
        ("1", "nap", 2),
    ]
    again = alloc("compare", f"{TINY}:1", "--methods", "nap", *QUICK, "--json")
    assert again.json == first.json
    assert "0 runs made; runs.db has 1 of 1" in again.err


@pytest.mark.usefixtures("in_process")
def test_rows_match_a_comparison_without_a_store(alloc):
    """Rows are the same as without a store, except for times."""
    words = ("compare", f"{TINY}:0-1", "--methods", "greedy,ga[population=4]", "--seeds", "2", "--iterations", "5")
    kept = alloc(*words, "--store", "runs.db", "--json").json["rows"]
    alloc("generate", "random", "--agents", "3", "--tasks", "2", "--count", "2", "--output", "made")
    plain = alloc("compare", *map(str, sorted(Path("made").iterdir())), *words[2:], "--json").json["rows"]
    for row in [*kept, *plain]:
        for name in ("runtime_mean_s", "runtime_worst_s", "instance"):
            row.pop(name)
    assert kept == plain


@pytest.mark.usefixtures("in_process")
def test_runs_with_other_budgets_are_ignored(alloc):
    """Runs with another budget are ignored, with a note."""
    alloc("compare", f"{TINY}:0", "--methods", "greedy", *QUICK)
    other = alloc("compare", f"{TINY}:0", "--methods", "greedy", "--iterations", "6", "--store", "runs.db")
    assert "1 run made" in other.err
    assert "runs.db also contains 1 run with iterations 5, which are ignored here" in other.err


@pytest.mark.usefixtures("in_process")
def test_differences_are_printed_and_reported(alloc):
    """Differences from the first method are printed below the table; a report contains these, or all runs."""
    words = ("compare", f"{TINY}:0-2", "--methods", "greedy,local-search", *QUICK)
    ran = alloc(*words, "--report", "table.md", "--report", "runs.csv")
    assert ran.code == 0
    assert "Against greedy: T\n" in ran.err
    assert "Small sample: 3 instances" in ran.err
    assert "## Against greedy: T" in Path("table.md").read_text()
    assert Path("runs.csv").read_text().count("\n") == 7
    assert "Against" not in alloc(*words, "--json").err


@pytest.mark.slow
def test_failures_have_rows_and_are_retried_on_request(alloc, plugin):
    """A failure has a row with the reason; it is repeated only with --retry, which keeps good runs."""
    words = ("compare", f"{TINY}:0", "--methods", "leave,nap", *QUICK)
    ran = alloc(*words)
    assert ran.code == 0
    assert "exited with seed 0: it ended its process with exit code 3" in ran.err
    assert "0 runs made" in alloc(*words).err
    assert "1 run made" in alloc(*words, "--retry").err
    assert len(begun()) == 1


@pytest.mark.usefixtures("in_process")
def test_sources_of_instances(alloc):
    """Instances come from a file, a folder, a pattern, a table and a family; the same content is one instance."""
    Path("folder").mkdir()
    for seed in (0, 1):
        write_instance(paper(1, seed), f"folder/{seed}.json")
    Path("list.csv").write_text("instance,from\nfolder/1.json,here\npaper-1:0-1,there\n")
    ran = alloc("compare", "folder", "folder/*.json", "list.csv", "folder/0.json", "--methods", "greedy", *QUICK)
    assert ran.code == 0
    assert "2 runs made" in ran.err


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("none/*.json", "none/*.json: matches no file"),
        ("paper-1:3-2", "paper-1:3-2: must be an ascending range of"),
        ("random[agent=3]:0", "random[agent=3]:0: agent: is not a parameter of a random family"),
        ("covering[agent=3]:0", "covering[agent=3]:0: agent: is not a parameter of a covering family"),
        ("covering[ability_min=x]:0", "covering[ability_min=x]:0: ability_min: must be a finite number"),
        ("random[agents=0]:0", "random[agents=0]:0: agents: must be"),
        ("paper-1[agents=3]:0", "paper-1[agents=3]:0: paper-1: takes no parameters"),
        ("list.csv", "list.csv: has no column 'instance'"),
        ("absent.json", "absent.json: there is no such file"),
    ],
)
def test_wrong_sources_are_one_line(alloc, source, message):
    """An invalid source is a one-line error before any run."""
    Path("list.csv").write_text("file\nx.json\n")
    ran = alloc("compare", source, "--methods", "greedy", *QUICK)
    assert ran.code == 2
    assert ran.err.startswith(f"alloc: {message}")
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize(
    ("methods", "message"),
    [
        ("ga[populatoin=3]", "populatoin"),
        ("gredy", "there is no method 'gredy' (did you mean 'greedy'?)"),
        ("ga[population=3", "must have the form ga[population=200]"),
    ],
)
def test_wrong_methods_are_one_line(alloc, methods, message):
    """An unknown method or parameter is an error before any run."""
    ran = alloc("compare", f"{TINY}:0", "--methods", methods, *QUICK)
    assert ran.code == 2
    assert message in ran.err
    assert not Path("runs.db").exists()


@pytest.mark.usefixtures("in_process")
def test_method_without_results_is_reported(alloc, plugin):
    """A method that refuses everything, or lacks a package, has dashes and a reason in the report."""
    words = ("compare", f"{TINY}:0", "covering[agents=4,tasks=2]:0", "--methods", "greedy,refuse,missing", *QUICK)
    ran = alloc(*words, "--report", "table.md")
    assert ran.code == 0
    assert "covering-4x2-1-1000-equal-seed-0: not this one" in ran.err
    assert "pip install absent" in ran.err
    assert "| refuse | 0 | 0 | - | - | - | - |" in Path("table.md").read_text()


@pytest.mark.usefixtures("in_process")
def test_full_disk_is_one_line_and_loses_nothing(alloc, plugin):
    """If the disk becomes full, stored runs are kept; with free space the same command resumes from there."""
    words = ("compare", f"{TINY}:0-1", "--methods", "greedy,answer", "--seeds", "10", *QUICK)
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, before[1]))
    try:
        ran = alloc(*words)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "runs.db: cannot be" in ran.err
    assert "full" in ran.err
    kept = sqlite3.connect("runs.db").execute("SELECT count(*) FROM runs").fetchone()[0]
    assert 0 < kept < 40
    assert f"{40 - kept} runs made; runs.db has 40 of 40" in alloc(*words).err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--memory", "4G"), "--memory: can only be used with --store"),
        (("--retry",), "--retry: can only be used with --store"),
        (("--engine", "ray"), "--engine: can only be used with --store"),
        (("--store", "runs.db", "--address", "here:1"), "--address: can only be used with --engine ray"),
        (("--store", "runs.db", "--memory", "4"), "must be an amount such as 800M or 4G, got '4'"),
        (("--store", "runs.db", "--memory", "4M"), "must be at least 100M"),
        (("--store", "runs.db", "--kill-after", "0"), "must be more than 0 seconds"),
        (("--store", "runs.db", "--time-limit", "1", "--workers", "999"), "--workers: 999 parallel timed runs"),
        (("--store", "absent/runs.db"), "absent/runs.db: there is no folder 'absent'"),
        (("--store", "runs.db", "--report", "runs.txt"), "runs.txt: must end in .md, .tex, .csv or .parquet"),
        (("--store", "runs.db", "--csv", "runs.db"), "is --store and --csv at once"),
        (("--store", "text"), "text: is not a store of runs"),
        (("--store", "."), ".: is a folder where a file is expected"),
    ],
)
def test_wrong_options_are_one_line(alloc, words, message):
    """Invalid options are one-line errors before any run."""
    Path("text").write_text("no database\n" * 100)
    ran = alloc("compare", f"{TINY}:0", "--methods", "greedy", *words)
    assert ran.code == 2
    assert message in ran.err
    assert ran.err.count("\n") == 1


def test_ctrl_c_keeps_completed_runs(plugin):
    """Ctrl-C prints the rows of completed runs, with exit code 1; no run is in progress or leased afterwards."""
    command = [sys.executable, "-m", "alloc.cli", "compare", f"{TINY}:0", "--methods", "nap", "--seeds", "500", *QUICK]
    process = subprocess.Popen(command, cwd=plugin, stderr=subprocess.PIPE, text=True)
    naps, limit = plugin / "naps", time.monotonic() + 60
    while not (naps.exists() and naps.read_text().count("begin") > 1) and time.monotonic() < limit:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "interrupted; the same command resumes from here" in errors
    store = sqlite3.connect(plugin / "runs.db")
    assert store.execute("SELECT count(*) FROM leases").fetchone() == (0,)
    assert 1 <= store.execute("SELECT count(*) FROM runs").fetchone()[0] < 500


def test_runs_end_with_their_killed_command(plugin):
    """If a command is killed, its run and all processes that the run has started end, too."""
    command = [sys.executable, "-m", "alloc.cli", "compare", f"{TINY}:0", "--methods", "fork", "--seeds", "99", *QUICK]
    process = subprocess.Popen(command, cwd=plugin, stderr=subprocess.DEVNULL)
    noted, limit = plugin / "forked", time.monotonic() + 60
    while not (noted.exists() and noted.read_text().count("\n") >= 2) and time.monotonic() < limit:
        time.sleep(0.01)
    process.kill()
    process.wait()
    while any(map(_is_there, noted.read_text().split())) and time.monotonic() < limit:
        time.sleep(0.01)
    assert not any(map(_is_there, noted.read_text().split()))


def _is_there(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
def test_two_killed_commands_store_every_run_once(tmp_path):
    """With two commands on one store, killed repeatedly, every run is stored once, and no lease is left."""
    found = kill_often(tmp_path, seeds=3, kills=3, nap_s=0.4, workers=1, gap_s=(1.0, 2.0))
    assert found.kills >= 1
    assert (found.rows, found.solved, found.lost) == (12, 12, 0)
    assert (found.overlapping, found.again, found.leases) == (0, 0, 0)


@pytest.mark.usefixtures("in_process")
def test_runs_of_policies_are_stored(alloc, plugin):
    """Runs of policies are made once, in separate processes; rows equal those without a store; reports are complete."""
    alloc("generate", "mission", "--agents", "2", "--tasks", "2", "--seed", "1", "--output", "m.json")
    words = ("compare", "m.json", "--policies", "nearest,replan", "--seeds", "2")
    kept = alloc(*words, "--store", "runs.db", "--report", "table.md", "--report", "runs.csv", "--json")
    assert "4 runs made; runs.db has 4 of 4" in kept.err
    plain = alloc(*words, "--json")
    rows, others = kept.json["rows"], plain.json["rows"]
    for row in [*rows, *others]:
        for name in ("decision_ms_mean", "decision_ms_worst"):
            row.pop(name)
    assert (kept.code, rows, kept.json["differences"]) == (plain.code, others, plain.json["differences"])
    assert "0 runs made" in alloc(*words, "--store", "runs.db").err
    more = alloc(*words, "--knowledge", "full", "--store", "runs.db")
    assert "4 runs made; runs.db has 4 of 4" in more.err
    assert "runs.db also contains 4 runs with knowledge local" in more.err
    assert "## Differences from nearest on the same missions" in Path("table.md").read_text()
    (mean,) = (
        sqlite3.connect("runs.db")
        .execute("SELECT avg(measures ->> 'mission_time') FROM runs WHERE method = 'nearest' AND knowledge = 'local'")
        .fetchone()
    )
    assert mean == pytest.approx(rows[0]["mission_time_mean"])
    rows = list(csv.DictReader(Path("runs.csv").read_text().splitlines()))
    assert [row["tasks_done"] for row in rows] == ["2", "", "2", ""]


def test_interrupt_before_the_first_run_prints_no_differences(alloc, monkeypatch):
    """If interrupted at once, a note says how to resume, and there is no table of differences."""
    monkeypatch.setattr("alloc.allocators.experiments.campaign.Campaign.run", lambda self, stop: False)
    ran = alloc("compare", f"{TINY}:1", "--methods", "greedy,auction", *QUICK)
    assert (ran.code, ran.out) == (1, "")
    assert "note: interrupted; the same command resumes from here" in ran.err
    assert "Against" not in ran.err
