"""The Ray engine: a machine of the cluster dies in mid-work, and nothing is lost."""

import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import engine_jobs as jobs
import pytest
import torch

from alloc.allocators.learned.engine import Engine, EngineError, SerialEngine, make_engine
from alloc.problems import InputError


def test_without_ray_the_mend_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line says what to install."""
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(InputError, match=r"--engine: Ray is not installed: pip install 'alloc-mrta\[cluster\]'"):
        make_engine("ray")


@pytest.mark.parametrize("address", ["127.0.0.1:1", "nowhere.invalid:6379", "ray://127.0.0.1:1", "1.2.3.4:99999", "x"])
def test_nobody_there(address: str) -> None:
    """An address where no cluster is, is told at once, where Ray itself tries for minutes."""
    pytest.importorskip("ray")
    began = time.monotonic()
    with pytest.raises(InputError, match=f"--address: no Ray cluster at '{address}': "):
        make_engine("ray", address=address)
    assert time.monotonic() - began < 30


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A head that does no work, and two machines of one processor each, all on this one."""
    pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    small = {"object_store_memory": 80 * 2**20, "include_dashboard": False}
    health = {"health_check_initial_delay_ms": 0, "health_check_period_ms": 1000, "health_check_failure_threshold": 3}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        patch.setenv("PYTHONPATH", str(Path(jobs.__file__).parent))  # where the workers find the jobs
        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "_system_config": health, **small})
        for _ in range(2):
            cluster.add_node(num_cpus=1, **small)
        yield cluster
        cluster.shutdown()


@pytest.fixture(scope="module")
def engine(cluster: Any) -> Iterator[Engine]:
    before = signal.getsignal(signal.SIGTERM)
    with make_engine("ray", address=cluster.address) as engine:
        assert signal.getsignal(signal.SIGTERM) is before
        yield engine


@pytest.mark.slow
def test_same_results_in_order(engine: Engine) -> None:
    """A cluster returns what this process returns, to the last bit, and raises what it raises."""
    assert engine.map(jobs.square, range(5)) == [0, 1, 4, 9, 16]
    assert engine.map(jobs.threads, [0]) == [1]
    states = [{"seed": torch.tensor(seed), "weight": torch.full((40, 40), 0.1 * seed)} for seed in range(3)]
    got, expected = engine.map(jobs.step, states), SerialEngine().map(jobs.step, states)
    assert got is not None
    assert expected is not None
    for a, b in zip(got, expected, strict=True):
        assert torch.equal(a["weight"], b["weight"])
        a["weight"] += 1  # not a view of memory that belongs to Ray
    with pytest.raises(KeyError, match="item 5"):
        engine.map(jobs.fail, [5])


@pytest.mark.slow
def test_a_killed_worker_loses_nothing(engine: Engine, tmp_path: Path) -> None:
    """Items whose process is killed at the first try are done at the next."""
    results = engine.map(jobs.die_first, [(number, str(tmp_path / str(number))) for number in range(4)])
    assert results is not None
    assert [square for square, _ in results] == [0, 1, 4, 9]


@pytest.mark.slow
def test_an_item_that_always_kills_is_given_up(cluster: Any, engine: Engine, tmp_path: Path) -> None:
    """After the last try there is one error, and an engine that finds a connection leaves it open."""
    with make_engine("ray", address=cluster.address) as second:
        second._task = second._task.options(max_retries=1)
        with pytest.raises(EngineError, match="Ray gave an item up"):
            second.map(jobs.die, [str(tmp_path / "tries")])
    assert (tmp_path / "tries").read_text().count("tried") == 2
    assert engine.map(jobs.square, [3]) == [9]


@pytest.mark.slow
def test_a_stop_drops_what_is_under_work(engine: Engine, tmp_path: Path) -> None:
    """`map` returns None, and the processors are free for the next items."""
    markers = [tmp_path / name for name in ("a", "b")]
    stopped = engine.map(jobs.sleep_long, [str(m) for m in markers], lambda: all(m.exists() for m in markers))
    assert stopped is None
    assert engine.map(jobs.square, [3]) == [9]


@pytest.mark.slow
def test_a_machine_dies_and_nothing_is_lost(cluster: Any, engine: Engine, tmp_path: Path) -> None:
    """One of two machines is killed with an item under work; every result arrives, and is right."""
    items = [(number, str(tmp_path)) for number in range(6)]

    def kill_one() -> None:
        while len({path.read_text() for path in tmp_path.glob("*.try")}) < 2:
            time.sleep(0.02)
        doomed = next(iter(cluster.worker_nodes))
        (tmp_path / "doomed").write_text(doomed.node_id)
        cluster.remove_node(doomed, allow_graceful=False)

    thread = threading.Thread(target=kill_one)
    thread.start()
    results = engine.map(jobs.square_where_it_is_safe, items)
    thread.join()
    assert results == [0, 1, 4, 9, 16, 25]
    tries = [path.name.partition("-")[0] for path in tmp_path.glob("*.try")]
    assert sorted(set(tries)) == list("012345")
    assert len(tries) > 6
