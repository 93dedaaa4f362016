import io
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from schema_checks import require_valid

from alloc.cli.main import main


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
    """Runs the command line in this process, in an empty folder, and validates written documents by the schemas."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str, stdin: str = "") -> Ran:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin.encode())))
        capsys.readouterr()
        before = changes(tmp_path)
        code = main(arguments)
        captured = capsys.readouterr()
        for text in (captured.out, *(path.read_text("utf-8") for path, _ in changes(tmp_path) - before)):
            require_valid(parsed(text))
        return Ran(code, captured.out, captured.err)

    return run


def changes(folder: Path) -> set[tuple[Path, int]]:
    """Return the JSON files in a folder, with their modification times."""
    return {(path, path.stat().st_mtime_ns) for path in folder.glob("*.json") if path.is_file()}


def parsed(text: str) -> object:
    """Return the value of a JSON text, None if it is not JSON."""
    try:
        return json.loads(text)
    except ValueError:
        return None
