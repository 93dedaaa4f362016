import io
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from alloc.cli.main import main
from alloc.problems import Instance
from alloc.problems.formats import write_instance


@dataclass(frozen=True)
class Ran:
    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        return json.loads(self.out)


Run = Callable[..., Ran]


@pytest.fixture
def alloc(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    """Runs the command line in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str, stdin: str = "") -> Ran:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin.encode())))
        capsys.readouterr()
        code = main(arguments)
        captured = capsys.readouterr()
        return Ran(code, captured.out, captured.err)

    return run


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
    """Nobody can take t2; in unservable.json."""
    instance = Instance(name="unservable", ability=[2, 3], workload=[4, 6], allowed_tasks=[[0], [0]])
    write_instance(instance, tmp_path / "unservable.json")
    return instance
