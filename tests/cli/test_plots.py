"""`--plot` writes a drawing, and nothing is printed beside it."""

import os
import subprocess
import sys

import pytest

from alloc.problems import Instance
from alloc.problems.formats import write_instance


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_names_of_every_script_are_drawn_without_output(tmp_path, suffix):
    """Missing glyphs and folders that cannot be written to cause no output, for results and fronts alike."""
    ids = ["日本語のタスク", "한국어", "हिन्दी عربي"]
    instance = Instance(
        name="日本", task_ids=ids, ability=[1, 2, 3, 4], workload=[1, 2, 3], task_position=[[0, 0], [1, 0], [0, 1]],
        start_task=[0, 1, 2, 0],
    )  # fmt: skip
    write_instance(instance, tmp_path / "names.json")
    for arguments in (
        ("solve", "names.json", "--method", "greedy"),
        ("pareto", "names.json", "--points", "1", "--iterations", "1"),
    ):
        command = [sys.executable, "-m", "alloc.cli", *arguments, "-q", "--plot", f"picture.{suffix}"]
        home = {**os.environ, "HOME": "/nowhere", "MPLCONFIGDIR": "/nowhere", "PYTHONWARNINGS": "always::UserWarning"}
        ran = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=home)
        assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
        assert (tmp_path / f"picture.{suffix}").stat().st_size > 5_000
