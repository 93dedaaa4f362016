"""Fixtures for all tests: tiny named instances, and settings of hypothesis."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from schema_checks import require_valid

from alloc.problems import Instance
from alloc.problems.formats import json_text, write_instance

# the same examples in every run, and no deadline: a busy machine is no bug
settings.register_profile(
    "alloc", deadline=None, derandomize=True, max_examples=60, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("alloc")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add an option for the number of random comparisons with references."""
    text = "instances or missions that are drawn where answers are compared with a reference, instead of a few"
    parser.addoption("--draws", type=int, metavar="N", help=text)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test that is marked as needing a missing package."""
    for mark in item.iter_markers("needs"):
        pytest.importorskip(*mark.args)


@pytest.fixture(autouse=True, scope="session")
def interruptible() -> None:
    """Restore the handling of Ctrl-C, which shells disable for tests in the background and their child processes."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True, scope="session")
def valid_documents() -> Iterator[None]:
    """Validate every instance and allocation that a test writes as JSON against the schema of its format."""
    with pytest.MonkeyPatch.context() as patch:
        write = json_text.lines

        def lines(document: dict[str, object]) -> str:
            require_valid(document)
            return write(document)

        patch.setattr(json_text, "lines", lines)
        yield


@pytest.fixture
def line() -> Instance:
    """Three tasks at 0, 3 and 4 on a line; agents of ability 2, 1, 4, 3 at 0, 0, at task t2 and nowhere."""
    nowhere = [float("nan")] * 3
    return Instance(
        name="line",
        ability=[2, 1, 4, 3],
        workload=[6, 4, 0],
        task_position=[[0, 0, 0], [3, 0, 0], [4, 0, 0]],
        agent_position=[[0, 0, 0], [0, 0, 0], nowhere, nowhere],
        start_task=[-1, -1, 1, -1],
        battery=[20, 5, float("inf"), 20],
        energy_per_distance=2.0,
    )


@pytest.fixture
def contested() -> Instance:
    """Tasks t1, t2 and t4 have only agents a1 and a2; t3 has a3 and a4 to itself."""
    return Instance(
        name="contested",
        ability=[1, 2, 3, 4],
        workload=[2, 2, 2, 2],
        allowed_tasks=[[0, 1, 3], [0, 1, 3], [2], [2]],
    )


@pytest.fixture
def small(tmp_path: Path) -> Instance:
    """Five agents, three tasks, in small.json; the optimum is 13 / 11 h."""
    instance = Instance(
        name="small",
        ability=[5, 2, 1, 8, 3],
        workload=[3, 13, 4],
        task_position=[[0, 0], [1, 0], [0, 2]],
        start_task=[0, 0, 1, 1, 2],
        battery=[20] * 5,
        energy_per_distance=6,
    )
    write_instance(instance, tmp_path / "small.json")
    return instance


@pytest.fixture
def unservable(tmp_path: Path) -> Instance:
    """No agent can take t2; in unservable.json."""
    instance = Instance(name="unservable", ability=[2, 3], workload=[4, 6], allowed_tasks=[[0], [0]])
    write_instance(instance, tmp_path / "unservable.json")
    return instance
