"""A Ray cluster whose machines all run on this one, for tests that kill them."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

SMALL = {"object_store_memory": 80 * 2**20, "include_dashboard": False}
SYSTEM = {
    "health_check_initial_delay_ms": 0,
    "health_check_period_ms": 1000,
    "health_check_failure_threshold": 3,
    "worker_niceness": 0,  # beside other work, workers of the least priority would hardly begin
}


@contextlib.contextmanager
def ray_cluster(machines: int) -> Iterator[Any]:
    """A head that does no work, and machines of one processor each."""
    from ray.cluster_utils import Cluster

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        patch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=os.pathsep)  # for `engine_jobs`
        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "_system_config": SYSTEM, **SMALL})
        try:
            for _ in range(machines):
                add_machine(cluster)
            yield cluster
        finally:
            cluster.shutdown()


def add_machine(cluster: Any) -> Any:
    """Add a machine of one processor, and wait until it is there."""
    return cluster.add_node(num_cpus=1, **SMALL)


def living(cluster: Any) -> int:
    """Count the machines that the cluster takes to be alive, the head included."""
    return sum(node["Alive"] for node in cluster.global_state.node_table())


def at_work(machine: Any, task: str = "_run_item") -> bool:
    """Whether an item is under work there."""
    return any(f"ray::{task}" in line for line in _each(machine, lambda process: " ".join(process.cmdline())))


def kill_at_work(cluster: Any, goes_on: Callable[[], bool], task: str = "_run_item") -> Any:
    """Kill a machine with an item under work, and return it; None if all went on to its end without such a moment.

    Its processes are stopped before the look whether they work, so that no item can end between look and kill.
    """
    while goes_on():
        for machine in cluster.worker_nodes:
            _each(machine, lambda process: process.suspend())
            if at_work(machine, task):
                _each(machine, lambda process: process.kill())
                return machine
            _each(machine, lambda process: process.resume())
        time.sleep(0.05)
    return None


def _each(machine: Any, function: Callable[[Any], Any]) -> list[Any]:
    """Apply a function to the process that a machine began with and to all that it started, but for those that end."""
    import psutil  # Ray brings it

    first = psutil.Process(machine.all_processes["raylet"][0].process.pid)
    results = []
    for process in [first, *first.children(recursive=True)]:
        with contextlib.suppress(psutil.NoSuchProcess):
            results.append(function(process))
    return results
