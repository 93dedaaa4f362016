"""User journeys by the documents alone: a folder for each, with a script and its expected output."""

import io
import os
import shlex
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from alloc.cli.main import main

HERE = Path(__file__).parent
SLOW = ("drones", "notebooks", "own_policy", "tables")
"""Journeys with trainings, many processes, or runs of many seconds; CI makes them."""

JOURNEYS = [
    pytest.param(path.parent.name, marks=[pytest.mark.slow] * (path.parent.name in SLOW), id=path.parent.name)
    for path in sorted(HERE.glob("*/journey.sh"))
]
NOTEBOOKS = HERE.parents[1] / "examples" / "notebooks"
MAX_LINES = 15
SCRIPTS = Path(sys.executable).parent


def run(command: list[str]) -> tuple[int, str, str]:
    """Run a program with this Python; return its exit code, output and errors."""
    environment = {**os.environ, "PATH": f"{SCRIPTS}{os.pathsep}{os.environ['PATH']}"}
    line = [sys.executable, *command[1:]] if command[0] == "python" else [sys.executable, "-m", *command]
    ran = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=100)
    return ran.returncode, ran.stdout, ran.stderr


def run_here(command: list[str]) -> tuple[int, str, str]:
    """Do as `run` in this process, which has loaded all packages."""
    output = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with redirect_stdout(output), redirect_stderr(io.StringIO()) as errors:
        code = main(command[1:])
        output.flush()
    return code, output.buffer.getvalue().decode(), errors.getvalue()  # type: ignore[attr-defined]


@pytest.mark.timeout(400)
@pytest.mark.parametrize("name", JOURNEYS)
def test_journey(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every command of the script works, and every file has what it must have."""
    folder = shutil.copytree(HERE / name, tmp_path / name)
    if name == "notebooks":
        shutil.copytree(NOTEBOOKS, folder, dirs_exist_ok=True)
    monkeypatch.chdir(folder)
    printed = ""
    for line in (folder / "journey.sh").read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        code, output, errors = (run_here if line.startswith("alloc ") else run)(shlex.split(line))
        assert code == 0, f"{line}\n{errors}"
        assert "Traceback" not in errors
        printed += output
    for line in (folder / "expected.txt").read_text(encoding="utf-8").splitlines():
        where, _, what = line.partition(": ")
        text = printed if where == "out" else (folder / where).read_text(encoding="utf-8")
        assert " ".join(what.split()) in " ".join(text.split()), f"{what} is not in {where}"


@pytest.mark.parametrize("script", sorted(HERE.glob("*/*.py")), ids=str)
def test_no_journey_needs_much_code(script: Path) -> None:
    """A journey that cannot do without code has at most fifteen lines of it."""
    lines = [line for line in script.read_text(encoding="utf-8").splitlines() if line.strip()]
    assert len(lines) <= MAX_LINES
