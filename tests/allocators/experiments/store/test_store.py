"""The store of runs: rows, leases and errors of its file."""

import contextlib
import os
import re
import resource
import signal
import sqlite3
import subprocess
import sys
import time
from dataclasses import asdict, fields, replace
from inspect import signature

import pytest

from alloc.allocators.experiments.store import store as store_module
from alloc.allocators.experiments.store.key import Run, canonical, fingerprint, versions
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.owner import is_gone, this_process
from alloc.allocators.experiments.store.plan import packed, unpacked
from alloc.allocators.experiments.store.revision import revision
from alloc.allocators.experiments.store.schema import APPLICATION, MIGRATIONS
from alloc.allocators.experiments.store.store import ENDING, RUN, Store
from alloc.problems import Allocation, InputError, Instance, Mission, MissionParameters, random_mission
from alloc.problems.formats.npz import from_npz, to_npz

RUNS = [
    Run(
        instance="i",
        method="greedy",
        parameters="{}",
        seed=seed,
        objective="makespan",
        time_limit_s=1.0,
        iterations=None,
        target_gap=None,
        threads=1,
        version="alloc 0",
        machine="m",
    )
    for seed in range(4)
]
KEYS = [run.key for run in RUNS]
OLD_KEY = "fd1753bf557b9f078a379b63a2567abaffa8357409529c06426d019410b7978b"
"""That of the first run by the first version."""
SOLVED = Ending(outcome=Outcome.SOLVED, makespan=1.5, trace=((0.1, None, 2.0, None), (0.2, 1.5, 3.0, 1.0)))


def finish(store, run, ending=SOLVED):
    assert store.claim([run.key]).key == run.key
    return store.finish(run, replace(ending, finished_at=time.time()))


def test_run_is_read_back_unchanged(tmp_path):
    """Run, ending and trace are the same after the file is reopened."""
    with Store(tmp_path / "runs.db") as store:
        assert store.claim([KEYS[0]]).key == KEYS[0]
        store.finish(RUNS[0], SOLVED)
    with Store(tmp_path / "runs.db") as store:
        (record,) = store.records(KEYS).values()
        assert (record.run, record.ending) == (RUNS[0], SOLVED)
        assert store.records().keys() == {KEYS[0]}


def test_tables_have_all_fields_of_runs_and_outcomes(tmp_path):
    """Every field has its column, and every column its field."""
    Store(tmp_path / "runs.db").close()
    rows = sqlite3.connect(tmp_path / "runs.db").execute("PRAGMA table_info(runs)").fetchall()
    assert sorted(row[1] for row in rows) == sorted(["key", *RUN, *ENDING])


def test_runs_are_claimed_once(tmp_path):
    """Two commands on one file never claim the same run, nor one that has ended."""
    with Store(tmp_path / "runs.db") as one, Store(tmp_path / "runs.db") as other:
        assert one.claim(KEYS).key == KEYS[0]
        assert other.claim(KEYS).key == KEYS[1]
        one.finish(RUNS[0], SOLVED)
        claim = one.claim(KEYS)
        assert (claim.key, claim.done) == (KEYS[2], {KEYS[0]})
        other.release(KEYS[1])
        assert one.claim(KEYS).key == KEYS[1]


def test_runs_leased_by_others_cannot_be_claimed(tmp_path):
    """If all remaining runs are leased by others, there is no run to claim, and none has ended."""
    with Store(tmp_path / "runs.db") as one, Store(tmp_path / "runs.db") as other:
        one.claim(KEYS[:1])
        claim = other.claim(KEYS[:1])
        assert (claim.key, claim.done) == (None, frozenset())


def test_lease_ends_with_its_process(tmp_path):
    """The run of a killed command can be claimed by others at once."""
    code = "import sys, time; from alloc.allocators.experiments.store.store import Store; s = Store(sys.argv[1]);"
    code += " print(s.claim([sys.argv[2]]).key, flush=True); time.sleep(60)"
    child = subprocess.Popen([sys.executable, "-c", code, tmp_path / "runs.db", KEYS[0]], stdout=subprocess.PIPE)
    try:
        assert child.stdout.readline().decode().strip() == KEYS[0]
        with Store(tmp_path / "runs.db") as store:
            assert store.claim(KEYS[:1]).key is None
            child.send_signal(signal.SIGKILL)
            child.wait()
            assert store.claim(KEYS[:1]).key == KEYS[0]
    finally:
        child.kill()
        child.wait()
        child.stdout.close()


def test_lease_expires_unless_renewed(tmp_path, monkeypatch):
    """A process that cannot be observed, as on another machine, finally loses its run; its result is rejected."""
    with Store(tmp_path / "runs.db") as one, Store(tmp_path / "runs.db") as other:
        one.claim(KEYS[:2])
        later = time.time() + store_module.LEASE_S + 1
        with monkeypatch.context() as patch:
            patch.setattr(store_module.time, "time", lambda: later - 30)
            one.renew()
            patch.setattr(store_module.time, "time", lambda: later)
            assert other.claim(KEYS[:1]).key is None
            patch.setattr(store_module.time, "time", lambda: later + store_module.LEASE_S)
            assert other.claim(KEYS[:1]).key == KEYS[0]
        assert not one.finish(RUNS[0], replace(SOLVED, makespan=9.0))
        assert other.finish(RUNS[0], SOLVED)
        assert other.records(KEYS)[KEYS[0]].ending.makespan == 1.5


def test_failures_are_retried_once_on_request(tmp_path):
    """Failed runs are retried once on request; runs with a missing package are always retried."""
    with Store(tmp_path / "runs.db") as store:
        finish(store, RUNS[0], Ending(outcome=Outcome.FAILED))
        finish(store, RUNS[1], Ending(outcome=Outcome.MISSING_PACKAGE))
        finish(store, RUNS[2])
        assert store.claim(KEYS[:3]).key is None
    with Store(tmp_path / "runs.db") as store:
        assert store.claim(KEYS[:3]).key == KEYS[1]
    with Store(tmp_path / "runs.db", again=[Outcome.FAILED]) as store:
        finish(store, RUNS[0])
        assert store.claim(KEYS[:1]).done == {KEYS[0]}
        assert store.records(KEYS)[KEYS[0]].ending.outcome is Outcome.SOLVED


@pytest.mark.parametrize("field", [field.name for field in fields(Run)])
def test_every_field_is_part_of_the_key(field):
    """Runs that differ in any field have different keys."""
    old = getattr(RUNS[0], field)
    other = replace(RUNS[0], **{field: 7 if old is None or isinstance(old, int | float) else old + "x"})
    assert other.key != RUNS[0].key
    assert replace(other, **{field: old}).key == RUNS[0].key


def test_instances_are_identified_by_content():
    """The key depends on every number of an instance, but not on its name."""
    one = Instance(name="one", ability=[1, 2], workload=[3])
    assert fingerprint(one) == fingerprint(replace(one, name="other"))
    assert fingerprint(one) != fingerprint(replace(one, workload=[3.0000001]))
    assert fingerprint(one) != fingerprint(replace(one, task_ids=["x"]))


def test_store_of_an_earlier_version_keeps_its_runs(tmp_path):
    """Runs from before missions were supported are found under the same keys."""
    with sqlite3.connect(tmp_path / "runs.db") as old:
        old.executescript(MIGRATIONS[0] + f"; PRAGMA application_id = {APPLICATION}; PRAGMA user_version = 1;")
        values = {**asdict(RUNS[0]), **asdict(SOLVED), "trace": "[]", "key": OLD_KEY}
        columns = [row[1] for row in old.execute("PRAGMA table_info(runs)")]
        marks = ", ".join("?" * len(columns))
        old.execute(f"INSERT INTO runs VALUES ({marks})", [values[column] for column in columns])
    old.close()
    with Store(tmp_path / "runs.db") as store:
        assert store.claim(KEYS[:1]).done == {KEYS[0]}
        assert store.records(KEYS)[KEYS[0]].ending == replace(SOLVED, trace=())


def test_missions_are_identified_by_content():
    """The key depends on the events of a mission, but not on its name."""
    one = random_mission(MissionParameters(agents=3, tasks=4), 1)
    renamed = Mission(replace(one.instance, name="other"), **_rest(one))
    assert fingerprint(renamed) == fingerprint(one)
    assert fingerprint(Mission(one.instance, **_rest(one) | {"horizon": 7.5})) != fingerprint(one)


def _rest(mission):
    return {name: getattr(mission, name) for name in signature(Mission).parameters if name != "instance"}


def test_policies_are_identified_by_content(tmp_path):
    """Policy files are compared by content, not by name; the order of parameters does not matter."""
    file = tmp_path / "p.safetensors"
    file.write_bytes(b"one")
    before = canonical({"b": 1, "policy": str(file)})
    assert canonical({"policy": str(file), "b": 1}) == before
    file.write_bytes(b"two")
    assert canonical({"b": 1, "policy": str(file)}) != before


def test_commit_is_that_of_this_package(tmp_path, monkeypatch):
    """In a checkout of alloc it is 40 digits, with a plus after changes; elsewhere, or without git, it is empty."""
    revision.cache_clear()
    assert re.fullmatch(r"([0-9a-f]{40}\+?)?", revision())
    revision.cache_clear()
    monkeypatch.setenv("PATH", str(tmp_path))
    assert revision() == ""
    revision.cache_clear()


def test_built_in_methods_have_the_package_version():
    """A built-in method has the version of this package."""
    assert versions("greedy").startswith("alloc ")


def test_owners_are_recognised_by_process_and_start_time():
    """This process is alive; one with its id but another start time is gone; on other machines it is unknown."""
    place, pid, started, token = this_process().split(" ")
    assert not is_gone(this_process())
    assert is_gone(" ".join([place, pid, f"{started}0", token]))
    assert not is_gone(" ".join([f"{place}0", pid, f"{started}0", token]))


def test_older_store_is_migrated(tmp_path, monkeypatch):
    """A file of an earlier version keeps its runs and gets the new columns and tables."""
    with Store(tmp_path / "runs.db") as store:
        finish(store, RUNS[0])
    monkeypatch.setattr(store_module, "MIGRATIONS", (*MIGRATIONS, "CREATE TABLE later (x TEXT)"))
    with Store(tmp_path / "runs.db") as store:
        assert store.records().keys() == {KEYS[0]}
    found = sqlite3.connect(tmp_path / "runs.db")
    assert found.execute("SELECT * FROM later").fetchall() == []
    assert found.execute("PRAGMA user_version").fetchone() == (len(MIGRATIONS) + 1,)


def test_two_commands_create_a_store_at_once(tmp_path, monkeypatch):
    """A file that another command initialises at the same time is recognised as a store."""
    monkeypatch.setattr(store_module, "BUSY_S", 0.05)
    connect, others = sqlite3.connect, []

    def watched(*arguments, **settings):
        connection = connect(*arguments, **settings)
        monkeypatch.setattr(store_module.sqlite3, "connect", connect)
        connection.set_trace_callback(begin_another)
        return connection

    def begin_another(statement):
        if "sqlite_master" in statement and not others:
            others.append(statement)
            with contextlib.suppress(InputError):  # it may have to wait until this one has looked
                Store(tmp_path / "runs.db").close()

    monkeypatch.setattr(store_module.sqlite3, "connect", watched)
    with Store(tmp_path / "runs.db") as store:
        assert store.claim(KEYS[:1]).key == KEYS[0]
    assert others


def test_store_from_before_plans_accepts_plans(tmp_path):
    """A file from before plans and instances were kept has its runs, without a commit, and takes plans from now on."""
    with Store(tmp_path / "runs.db") as store:
        finish(store, RUNS[0])
    with sqlite3.connect(tmp_path / "runs.db") as older:
        older.executescript(
            "DROP TABLE plans; DROP TABLE contents; ALTER TABLE runs DROP COLUMN revision; PRAGMA user_version = 2"
        )
    with Store(tmp_path / "runs.db") as store:
        assert store.records()[KEYS[0]].ending.revision == ""
        assert store.claim([KEYS[1]]).key == KEYS[1]
        store.finish(RUNS[1], SOLVED, packed(Allocation([0, -1])))
    rows = sqlite3.connect(tmp_path / "runs.db").execute("SELECT key FROM plans").fetchall()
    assert rows == [(KEYS[1],)]


def test_instances_and_plans_are_kept(tmp_path):
    """The content of an instance is that of an .npz file; a run that is made again has its new plan, or none."""
    instance = Instance(name="one", ability=[1, 2], workload=[3])
    with Store(tmp_path / "runs.db", again=[Outcome.SOLVED]) as store:
        known = store.add(instance)
        for plan in ([0, -1], [0, 0]):
            assert store.claim([KEYS[0]]).key == KEYS[0]
            store.finish(RUNS[0], replace(SOLVED, finished_at=0.0), packed(Allocation(plan)))
    found = sqlite3.connect(tmp_path / "runs.db")
    assert found.execute("SELECT instance FROM contents").fetchall() == [(known,)]
    ((content,),) = found.execute("SELECT content FROM contents").fetchall()
    assert to_npz(from_npz(content, "")) == to_npz(instance)
    ((kept,),) = found.execute("SELECT plan FROM plans").fetchall()
    assert unpacked(kept) == Allocation([0, 0])
    with Store(tmp_path / "runs.db", again=[Outcome.SOLVED]) as store:
        store.claim([KEYS[0]])
        store.finish(RUNS[0], Ending(outcome=Outcome.FAILED))
    assert found.execute("SELECT plan FROM plans").fetchall() == []
    with pytest.raises(InputError, match="plan: is damaged"):
        unpacked(kept[:-3])


def test_store_of_a_later_version_is_refused(tmp_path):
    """A file of a later version is refused in one line and not changed."""
    Store(tmp_path / "runs.db").close()
    sqlite3.connect(tmp_path / "runs.db").execute("PRAGMA user_version = 99")
    with pytest.raises(InputError, match=r"runs\.db: is a store of version 99.*update alloc"):
        Store(tmp_path / "runs.db")


def test_other_files_are_refused(tmp_path):
    """A text file, and a database of another program, are refused in one line and not changed."""
    (tmp_path / "text").write_text("instance,method\n" * 100)
    with pytest.raises(InputError, match="is not a store of runs"):
        Store(tmp_path / "text")
    with sqlite3.connect(tmp_path / "other.db") as other:
        other.execute("CREATE TABLE birds (name TEXT)")
    before = (tmp_path / "other.db").read_bytes()
    with pytest.raises(InputError, match="is a database of another program"):
        Store(tmp_path / "other.db")
    assert (tmp_path / "other.db").read_bytes() == before
    with pytest.raises(InputError, match=r"there is no folder '.*absent'; create it first"):
        Store(tmp_path / "absent" / "runs.db")
    with pytest.raises(InputError, match="is a folder where a file is expected"):
        Store(tmp_path)


def test_damaged_store_is_reported(tmp_path):
    """A file with overwritten pages is reported as damaged, in one line."""
    with Store(tmp_path / "runs.db") as store:
        finish(store, RUNS[0])
    data = bytearray((tmp_path / "runs.db").read_bytes())
    data[4096:] = b"\xff" * (len(data) - 4096)
    (tmp_path / "runs.db").write_bytes(data)
    with pytest.raises(InputError, match=r"is damaged"), Store(tmp_path / "runs.db") as store:
        store.claim(KEYS)


def test_locked_store_is_reported(tmp_path, monkeypatch):
    """A lock of another program is reported after a while; the contents of the store are kept."""
    monkeypatch.setattr(store_module, "BUSY_S", 0.05)
    with Store(tmp_path / "runs.db") as store:
        finish(store, RUNS[0])
        other = sqlite3.connect(tmp_path / "runs.db", isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(InputError, match="has been locked by another program for 30 s"):
            store.claim(KEYS)
        other.close()
        assert store.claim(KEYS).key == KEYS[1]


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes to anything")
def test_read_only_store_is_reported(tmp_path):
    """A write-protected file is reported in one line."""
    Store(tmp_path / "runs.db").close()
    (tmp_path / "runs.db").chmod(0o444)
    with pytest.raises(InputError, match="read-only"):
        Store(tmp_path / "runs.db")


@pytest.fixture
def small_files():
    """Limits files to 200 kB, as if the disk were full then."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


@pytest.mark.usefixtures("small_files")
def test_full_disk_loses_no_rows(tmp_path):
    """A full disk is reported in one line; earlier rows are kept, and no row is incomplete."""
    with Store(tmp_path / "runs.db") as store:
        finish(store, RUNS[0])
        with pytest.raises(InputError, match=r"disk is full|is full;"):
            finish(store, RUNS[1], replace(SOLVED, details="x" * 400_000))
    with Store(tmp_path / "runs.db") as store:
        assert store.records().keys() == {KEYS[0]}
        assert store.claim(KEYS).key == KEYS[1]
