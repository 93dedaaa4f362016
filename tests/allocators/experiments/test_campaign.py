"""Campaigns with runs that crash, hang, exhaust memory or leave processes behind."""

import os
import sqlite3
import threading
from pathlib import Path

import evil_methods
import pytest
from in_process import InProcess

from alloc.allocators.auto import PICKED
from alloc.allocators.experiments.campaign import Campaign, Job, Resources
from alloc.allocators.experiments.isolation import cores, serve
from alloc.allocators.experiments.store.key import Run, fingerprint, versions
from alloc.allocators.experiments.store.outcome import Outcome
from alloc.allocators.experiments.store.plan import unpacked
from alloc.allocators.experiments.store.store import Store
from alloc.problems import Allocation, InputError, Instance

INSTANCE = Instance(name="one", ability=[1, 2], workload=[3])


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """Installs the misbehaving methods, and returns a folder for their records."""
    folder = tmp_path / "plugin"
    folder.mkdir()
    evil_methods.install(folder)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("NAPS", str(tmp_path / "naps"))
    monkeypatch.setenv("FORKED", str(tmp_path / "forked"))
    return tmp_path


def job(method, seed=0, *, time_limit_s=None, instance=INSTANCE):
    run = Run(
        instance=fingerprint(instance),
        method=method,
        parameters="{}",
        seed=seed,
        objective="makespan",
        time_limit_s=time_limit_s,
        iterations=10,
        target_gap=None,
        threads=1,
        version=versions(method),
        machine="m",
    )
    return Job(run, {}, instance)


def run(folder, jobs, place=None, **resources):
    """Make runs, and return how each ended, by method."""
    with Store(folder / "runs.db") as store:
        assert Campaign(store, jobs, Resources(**resources), place=place).run(threading.Event())
        assert store.leases() == {}
        return {record.run.method: record.ending for record in store.records().values()}


def is_there(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_hanging_or_exiting_run_does_not_affect_others(plugin):
    """A hanging run is killed at its limit, one that exits is recorded with its exit code; others are solved."""
    endings = run(plugin, [job("hang"), job("leave"), job("answer")], workers=1, kill_after_s=0.3)
    assert endings["hang"].outcome is Outcome.HUNG
    assert (endings["leave"].outcome, endings["leave"].exit_code) == (Outcome.EXITED, 3)
    assert (endings["answer"].outcome, endings["answer"].makespan) == (Outcome.SOLVED, 1.0)
    ((plan,),) = sqlite3.connect(plugin / "runs.db").execute("SELECT plan FROM plans").fetchall()
    assert unpacked(plan) == Allocation([0, 0])


@pytest.mark.slow
def test_every_kind_of_failure_is_recorded_and_does_not_affect_others(plugin):
    """Every kind of failure is recorded as such; runs of a good method before and after it are solved."""
    expected = {
        "answer": Outcome.SOLVED,
        "greedy": Outcome.SOLVED,
        "garbage": Outcome.SOLVED,
        "fork": Outcome.SOLVED,
        "crash": Outcome.KILLED,
        "killed": Outcome.KILLED,
        "fail": Outcome.FAILED,
        "leave-softly": Outcome.FAILED,
        "leave": Outcome.EXITED,
        "fork-and-leave": Outcome.EXITED,
        "shut": Outcome.EXITED,
        "hang": Outcome.HUNG,
        "freeze": Outcome.HUNG,
        "eat": Outcome.OUT_OF_MEMORY,
        "eat-at-once": Outcome.OUT_OF_MEMORY,
        "refuse": Outcome.REFUSED,
        "missing": Outcome.MISSING_PACKAGE,
    }
    jobs = [job("answer", 1), *map(job, expected), job("answer", 2)]
    endings = run(plugin, jobs, workers=2, memory_mb=400, kill_after_s=4.0)
    assert {method: ending.outcome for method, ending in endings.items()} == expected
    assert "ZeroDivisionError: on purpose" in endings["fail"].details
    assert "in fail" in endings["fail"].details
    assert "SIGSEGV" in endings["crash"].reason
    assert (endings["leave"].exit_code, endings["killed"].exit_code) == (3, -9)
    assert endings["refuse"].reason == "not this one"
    assert endings["eat"].memory_mb > 400
    assert endings["hang"].wall_s < 60
    for pid in (plugin / "forked").read_text().split():
        assert not is_there(int(pid))


def test_stored_runs_are_not_repeated(plugin):
    """A second campaign makes only the missing run, of another seed."""
    run(plugin, [job("nap", 0), job("nap", 1)], InProcess())
    run(plugin, [job("nap", seed) for seed in (2, 1, 0)], InProcess())
    ended = [line.split()[2] for line in (plugin / "naps").read_text().splitlines() if line.startswith("end")]
    assert sorted(ended) == ["0", "1", "2"]


def test_process_is_reused_until_a_run_fails(plugin):
    """A process is reused for runs of its method, and replaced after a failure."""
    run(plugin, [job("pid", 0), job("pid", 1)], workers=1)
    assert len(set((plugin / "naps").read_text().splitlines())) == 1


@pytest.mark.skipif(not cores.CAN_PIN, reason="this system does not pin processes")
def test_timed_runs_are_pinned_to_separate_processors(plugin, monkeypatch):
    """A run with a time limit waits until a processor is free, and is pinned to it."""
    monkeypatch.setattr(cores, "LOCK", f"\0alloc-test-{os.getpid()}-")
    every = sorted(os.sched_getaffinity(0))
    held = cores.take(len(every))
    assert held.numbers == tuple(every)
    assert cores.take(1) is None
    waited = []

    def free():
        waited.append(True)
        held.free()

    with Store(plugin / "runs.db") as store:
        Campaign(store, [job("pid", time_limit_s=1.0)], Resources(workers=1), on_wait=free).run(threading.Event())
        (record,) = store.records().values()
    assert waited == [True]
    assert (plugin / "naps").read_text().split(maxsplit=1)[1].strip() == f"[{record.ending.cores}]"
    assert record.ending.at_once == 1
    taken = cores.take(len(every))
    taken.free()
    assert taken.numbers == tuple(every)


def test_more_timed_runs_than_processors_are_refused(plugin):
    """Timed runs that would share a processor are refused before anything runs."""
    many = len(os.sched_getaffinity(0)) + 1
    with Store(plugin / "runs.db") as store, pytest.raises(InputError, match=r"workers: \d+ parallel timed runs"):
        Campaign(store, [job("answer", time_limit_s=1.0)], Resources(workers=many))


def test_stopped_campaign_releases_its_runs(plugin, monkeypatch):
    """After a stop request, no run is in progress or leased; completed runs are kept."""
    monkeypatch.setenv("NAP_S", "0.2")
    stop = threading.Event()
    with Store(plugin / "runs.db") as store:
        jobs = [job("nap", seed) for seed in range(9)]
        assert not Campaign(store, jobs, Resources(workers=1), on_end=lambda run, ending: stop.set()).run(stop)
        assert len(store.records()) == 1
        assert store.leases() == {}
        assert Campaign(store, jobs[:2], Resources(workers=1), place=InProcess()).run(threading.Event())
        assert len(store.records()) == 2


def test_failing_store_leaves_no_process_behind(plugin, monkeypatch):
    """If a row cannot be written, the campaign ends with that error, and all its processes end."""

    def fail(self, run, ending, plan):
        raise InputError("the disk is full", source="runs.db")

    jobs = [job("pid", seed) for seed in range(3)]
    with Store(plugin / "runs.db") as store:
        monkeypatch.setattr(Store, "finish", fail)
        with pytest.raises(InputError, match="the disk is full"):
            Campaign(store, jobs, Resources(workers=1)).run(threading.Event())
        assert store.leases() == {}
    assert not is_there(int((plugin / "naps").read_text().split()[0]))


def test_methods_of_auto_are_loaded_before_the_clock_starts(monkeypatch):
    """First compilation takes longer than the limit of a run, and does not count."""
    loaded = []
    monkeypatch.setattr(serve, "load", lambda name, **_: loaded.append(name))
    serve.maker(serve.Order(job("auto").run, {}, b""))
    assert sorted(loaded) == sorted(PICKED)
