"""What people come for, by the documents alone: a folder for each, with a script and what must come out."""

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
SLOW = ("notebooks", "own_policy", "tables")
"""Journeys with trainings, or with many processes."""

JOURNEYS = [
    pytest.param(path.parent.name, marks=[pytest.mark.slow] * (path.parent.name in SLOW), id=path.parent.name)
    for path in sorted(HERE.glob("*/journey.sh"))
]
NOTEBOOKS = HERE.parents[1] / "examples" / "notebooks"
MOST_LINES = 15
SCRIPTS = Path(sys.executable).parent


@pytest.mark.timeout(400)
@pytest.mark.parametrize("name", JOURNEYS)
def test_journey(name: str, tmp_path: Path) -> None:
    """Every command of the script works, and every file has what it must have."""
    folder = shutil.copytree(HERE / name, tmp_path / name)
    if name == "notebooks":
        shutil.copytree(NOTEBOOKS, folder, dirs_exist_ok=True)
    environment = {**os.environ, "PATH": f"{SCRIPTS}{os.pathsep}{os.environ['PATH']}"}
    printed = ""
    for line in (folder / "journey.sh").read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        command = shlex.split(line)
        command = [sys.executable, *command[1:]] if command[0] == "python" else [sys.executable, "-m", *command]
        ran = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=100)
        assert ran.returncode == 0, f"{line}\n{ran.stderr}"
        assert "Traceback" not in ran.stderr
        printed += ran.stdout
    for line in (folder / "expected.txt").read_text(encoding="utf-8").splitlines():
        where, _, what = line.partition(": ")
        text = printed if where == "out" else (folder / where).read_text(encoding="utf-8")
        assert " ".join(what.split()) in " ".join(text.split()), f"{what} is not in {where}"


@pytest.mark.parametrize("script", sorted(HERE.glob("*/*.py")), ids=str)
def test_no_journey_needs_much_code(script: Path) -> None:
    """A journey that cannot do without code has at most fifteen lines of it."""
    lines = [line for line in script.read_text(encoding="utf-8").splitlines() if line.strip()]
    assert len(lines) <= MOST_LINES
