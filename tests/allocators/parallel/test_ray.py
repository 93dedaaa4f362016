"""The Ray engine: nothing is lost if a machine of the cluster dies during work, also during a training."""

import contextlib
import csv
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import engine_jobs as jobs
import pytest
import torch
from ray_cluster import add_machine, at_work, kill_at_work, living, ray_cluster
from safetensors.torch import load_file

from alloc.allocators.parallel.engine import Engine, EngineError
from alloc.allocators.parallel.engines import make_engine
from alloc.allocators.parallel.serial import SerialEngine
from alloc.cli.main import main
from alloc.problems import InputError
from alloc.problems.formats import write_instance
from alloc.problems.generate import paper_like

# Ray 2.40 leaves the processes that it starts, and their logs, to the garbage collector
pytestmark = [
    pytest.mark.filterwarnings("ignore:unclosed file .*/ray/session_:ResourceWarning"),
    pytest.mark.filterwarnings("ignore:subprocess .* is still running:ResourceWarning"),
]


def test_missing_ray_names_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line says what to install."""
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(InputError, match=r"engine: Ray is not installed: pip install 'alloc-mrta\[cluster\]'"):
        make_engine("ray")


@pytest.mark.needs("ray")
@pytest.mark.parametrize("address", ["127.0.0.1:1", "nowhere.invalid:6379", "ray://127.0.0.1:1", "1.2.3.4:99999", "x"])
def test_address_without_a_cluster_is_reported_at_once(address: str) -> None:
    """An address without a cluster is reported at once, where Ray itself would try for minutes."""
    began = time.monotonic()
    with pytest.raises(InputError, match=f"address: no Ray cluster at '{address}': "):
        make_engine("ray", address=address)
    assert time.monotonic() - began < 30


@pytest.mark.needs("ray")
def test_errors_of_ray_on_joining_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ray's reason is reported, including the versions in its later lines."""
    import ray

    def refuse(**_: object) -> None:
        raise RuntimeError("Version mismatch: The cluster was started with:\n    Ray: 2.9.0\n    Python: 3.9.1")

    monkeypatch.setattr(ray, "init", refuse)
    with pytest.raises(InputError, match=r"address: no Ray cluster at 'x': Version .* with: Ray: 2\.9\.0 Python: 3"):
        make_engine("ray", address="x")


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with ray_cluster(machines=2) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def engine(cluster: Any) -> Iterator[Engine]:
    before = signal.getsignal(signal.SIGTERM)
    with make_engine("ray", address=cluster.address) as engine:
        assert signal.getsignal(signal.SIGTERM) is before
        yield engine


@pytest.mark.needs("ray")
@pytest.mark.slow
def test_cluster_returns_the_results_of_a_loop_in_order(engine: Engine) -> None:
    """A cluster returns and raises the same as this process, bit for bit."""
    assert engine.map(jobs.square, range(5)) == [0, 1, 4, 9, 16]
    states = [{"seed": torch.tensor(seed), "weight": torch.full((40, 40), 0.1 * seed)} for seed in range(3)]
    got, expected = engine.map(jobs.step, states), SerialEngine().map(jobs.step, states)
    assert got is not None
    assert expected is not None
    for a, b in zip(got, expected, strict=True):
        assert torch.equal(a["weight"], b["weight"])
        a["weight"] += 1  # not a view of memory that belongs to Ray
    with pytest.raises(KeyError, match="item 5"):
        engine.map(jobs.fail, [5])


@pytest.mark.needs("ray")
@pytest.mark.slow
def test_more_threads_than_processors_are_refused(cluster: Any, engine: Engine) -> None:
    """Infeasible requirements are reported at once, where Ray would wait forever; the connection persists."""
    with pytest.raises(InputError, match=r"threads: no machine of the cluster has 2 processors; the largest has 1"):
        make_engine("ray", address=cluster.address, threads=2)
    assert engine.map(jobs.square, [3]) == [9]


@pytest.mark.needs("ray")
@pytest.mark.slow
def test_items_of_killed_workers_are_repeated(engine: Engine, tmp_path: Path) -> None:
    """Items whose process is killed at the first attempt succeed at the next."""
    results = engine.map(jobs.die_first, [(number, str(tmp_path / str(number))) for number in range(4)])
    assert results is not None
    assert [square for square, _ in results] == [0, 1, 4, 9]


@pytest.mark.needs("ray")
@pytest.mark.slow
def test_item_that_always_kills_its_worker_is_an_error(cluster: Any, engine: Engine, tmp_path: Path) -> None:
    """After the last attempt there is one error, and an engine that reuses a connection leaves it open."""
    with make_engine("ray", address=cluster.address) as second:
        second._task = second._task.options(max_retries=1)
        with pytest.raises(EngineError, match="Ray gave an item up"):
            second.map(jobs.die, [str(tmp_path / "tries")])
    assert (tmp_path / "tries").read_text().count("tried") == 2


@pytest.mark.needs("ray")
@pytest.mark.slow
def test_broken_connection_is_an_engine_error(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is reported as an error of Ray, after which a training can be resumed, not as one of a file."""

    def reset(_: object) -> None:
        raise ConnectionResetError("Connection reset by peer")

    with monkeypatch.context() as patch:
        patch.setattr("ray.get", reset)
        with pytest.raises(EngineError, match="Connection reset by peer"):
            engine.map(jobs.square, [3])
    assert engine.map(jobs.square, [3]) == [9]
    assert engine.map(jobs.square, [3]) == [9]


@pytest.mark.needs("ray")
@pytest.mark.slow
def test_stop_request_drops_items_in_progress(engine: Engine, tmp_path: Path) -> None:
    """`map` returns None, and the processors are free for the next items."""
    markers = [tmp_path / name for name in ("a", "b")]
    stopped = engine.map(jobs.sleep_long, [str(m) for m in markers], lambda: all(m.exists() for m in markers))
    assert stopped is None
    assert engine.map(jobs.square, [3]) == [9]


@pytest.mark.needs("ray")
@pytest.mark.slow
def test_items_of_a_dead_machine_are_repeated(cluster: Any, engine: Engine, tmp_path: Path) -> None:
    """If one of three machines is killed during an item, every result still arrives and is correct."""
    add_machine(cluster)
    items = [(number, str(tmp_path)) for number in range(6)]

    def kill_one() -> None:
        while len(busy := {path.read_text() for path in tmp_path.glob("*.try")}) < 2:
            time.sleep(0.02)
        doomed = next(machine for machine in cluster.worker_nodes if machine.node_id in busy)
        (tmp_path / "doomed").write_text(doomed.node_id)
        cluster.remove_node(doomed, allow_graceful=False)

    thread = threading.Thread(target=kill_one, daemon=True)  # should the map fail, it waits in vain
    thread.start()
    results = engine.map(jobs.square_where_it_is_safe, items)
    thread.join()
    assert results == [0, 1, 4, 9, 16, 25]
    tries = [path.name.partition("-")[0] for path in tmp_path.glob("*.try")]
    assert sorted(set(tries)) == list("012345")
    assert len(tries) > 6


@pytest.fixture(scope="module")
def options(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Arguments of a training of four generations, each long enough to be killed in its midst."""
    mine = tmp_path_factory.mktemp("mine") / "mine.json"
    write_instance(paper_like(10, 3, 44, 0), mine)
    shape = ["--population", "3", "--iterations", "4", "--lesson", "200", "--seed", "1"]
    return ["train", "gappo", "--instances", str(mine), *shape]


@pytest.fixture(scope="module")
def undisturbed(options: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The policy of that training in this process alone."""
    policy = tmp_path_factory.mktemp("undisturbed") / "p"
    assert main([*options, "--output", str(policy), "--engine", "serial"]) == 0
    return policy


@contextlib.contextmanager
def training(cluster: Any, *options: str) -> Iterator[subprocess.Popen[str]]:
    """The command in a process of its own, which does not outlive the block."""
    command = [sys.executable, "-c", "from alloc.cli.main import main; raise SystemExit(main())", *options]
    command += ["--engine", "ray", "--address", cluster.address]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def first_generation(lines: Iterable[str]) -> str:
    """Return the first line of a generation; Ray may speak in between, of machines that it lost before, too."""
    return next((line for line in lines if line.startswith("gen ")), "no generation")


def curve(policy: Path) -> list[list[str]]:
    """All figures of the log but those of time, and what they are called."""
    with policy.with_suffix(".csv").open(newline="") as file:
        return [row[:-2] for row in csv.reader(file)]


def members(policy: Path) -> Any:
    """All that the networks of the population are, with the states of their optimisers."""
    return torch.load(policy.with_suffix(".checkpoint"), weights_only=True)["members"]


def assert_same_end(policy: Path, expected: Path) -> None:
    assert len(curve(expected)) == 5
    assert curve(policy) == curve(expected)
    torch.testing.assert_close(load_file(policy), load_file(expected), rtol=0, atol=0)
    torch.testing.assert_close(members(policy), members(expected), rtol=0, atol=0)


@pytest.mark.needs("ray")
@pytest.mark.slow
@pytest.mark.timeout(300)
def test_training_survives_a_dead_machine(cluster: Any, options: list[str], undisturbed: Path, tmp_path: Path) -> None:
    """The member of a killed machine is trained again on another, without user action."""
    add_machine(cluster)
    before, policy = living(cluster), tmp_path / "p"
    with training(cluster, *options, "--output", str(policy)) as process:
        assert process.stderr is not None
        assert first_generation(process.stderr).startswith("gen 1 ")
        killed = kill_at_work(cluster, goes_on=lambda: process.poll() is None)
        assert killed is not None
        assert process.poll() is None
        assert len(curve(policy)) < 5
        told = process.stderr.read()
        assert process.wait() == 0, told
    while living(cluster) == before:  # the cluster may hear later of the machine than of its item
        time.sleep(0.1)
    assert living(cluster) == before - 1
    cluster.remove_node(killed)
    assert_same_end(policy, undisturbed)


@pytest.mark.needs("ray")
@pytest.mark.slow
@pytest.mark.timeout(300)
def test_killed_training_is_resumed(cluster: Any, options: list[str], undisturbed: Path, tmp_path: Path) -> None:
    """After kill -9 the cluster is free for the next command, which continues from the checkpoint."""
    policy = tmp_path / "p"
    with training(cluster, *options, "--output", str(policy)) as process:
        assert process.stderr is not None
        assert first_generation(process.stderr).startswith("gen 1 ")
        while process.poll() is None and not any(at_work(machine) for machine in cluster.worker_nodes):
            time.sleep(0.01)
    assert process.returncode == -signal.SIGKILL
    behind = len(curve(policy)) - 1
    assert behind < 4
    with training(cluster, *options, "--output", str(policy), "--resume") as process:
        assert process.stderr is not None
        told = process.stderr.read()
        assert process.wait() == 0, told
    begun = first_generation(told.splitlines())
    assert begun.startswith((f"gen {behind + 1} ", f"gen {behind + 2} ")), told  # the checkpoint precedes the log
    assert_same_end(policy, undisturbed)
