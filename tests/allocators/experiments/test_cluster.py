"""Comparisons on a Ray cluster: one command writes the store, and no run is lost if a machine fails."""

import os
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import evil_methods
import pytest
from ray_cluster import kill_at_work, ray_cluster

from alloc.allocators.experiments.isolation.cluster import _Remote
from alloc.allocators.experiments.isolation.worker import Limits
from alloc.allocators.parallel.engine import EngineError

ray = pytest.importorskip("ray")

# Ray leaves the processes that it starts, and their logs, to the garbage collector
pytestmark = [
    pytest.mark.filterwarnings("ignore:unclosed file .*/ray/session_:ResourceWarning"),
    pytest.mark.filterwarnings("ignore:subprocess .* is still running:ResourceWarning"),
    pytest.mark.needs("ray"),
    pytest.mark.slow,
    pytest.mark.timeout(300),
]

SEEDS = 8


def test_every_run_is_stored_once_if_a_machine_dies(tmp_path, monkeypatch):
    """One of two machines is killed during a run, which another machine repeats; each run has one row."""
    evil_methods.install(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setenv("NAPS", str(tmp_path / "naps"))
    monkeypatch.setenv("NAP_S", "1.0")
    with ray_cluster(machines=2) as cluster:
        command = [sys.executable, "-m", "alloc.cli", "compare", "random[agents=3,tasks=2]:0", "--iterations", "1"]
        command += ["--methods", "nap,leave", "--seeds", str(SEEDS), "--store", str(tmp_path / "runs.db")]
        command += ["--engine", "ray", "--address", cluster.address]
        with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
            assert process.stderr is not None
            while process.poll() is None and ended(tmp_path / "runs.db") < SEEDS:
                time.sleep(0.1)
            killed = kill_at_work(cluster, lambda: process.poll() is None, "make_run")
            told = process.stderr.read()
        again = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (process.returncode, killed is None) == (0, False), told
    assert f"{2 * SEEDS} runs made; {tmp_path / 'runs.db'} has {2 * SEEDS} of {2 * SEEDS}" in told
    assert "0 runs made" in again.stderr
    store = sqlite3.connect(tmp_path / "runs.db")
    outcomes = Counter(store.execute("SELECT method, outcome FROM runs").fetchall())
    assert outcomes == {("nap", "solved"): SEEDS, ("leave", "exited"): SEEDS}
    assert store.execute("SELECT count(*) FROM leases").fetchone() == (0,)
    assert "" not in {host for (host,) in store.execute("SELECT host FROM runs")}
    begun = [line.split()[2] for line in Path(tmp_path / "naps").read_text().splitlines() if line.startswith("begin")]
    assert SEEDS <= len(begun) <= SEEDS + 1


def ended(path):
    """Count the rows of a store that another process writes."""
    try:
        with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as store:
            return store.execute("SELECT count(*) FROM runs").fetchone()[0]
    except sqlite3.OperationalError:  # not there yet
        return 0


@pytest.mark.parametrize(("error", "outcome"), [("WorkerCrashedError", "killed"), ("LocalRayletDiedError", None)])
def test_only_failures_of_the_run_itself_are_outcomes(error, outcome):
    """A crashed worker is an outcome; loss of the cluster, or an internal error there, ends the command."""

    def get(task):
        raise getattr(ray.exceptions, error)

    fake = SimpleNamespace(
        exceptions=ray.exceptions,
        wait=lambda tasks, timeout: (tasks, []),
        get=get,
        remote=lambda **options: lambda function: SimpleNamespace(remote=lambda *order, **more: object()),
    )
    handle = _Remote(fake, 1, is_timed=False)
    handle.send(None, Limits(1.0, 1.0))
    if outcome is None:
        with pytest.raises(EngineError, match="Ray gave up a run"):
            handle.figures()
    else:
        assert handle.figures()["outcome"] == outcome
