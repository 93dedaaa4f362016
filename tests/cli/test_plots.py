"""`alloc plot` and `--plot` write a drawing, and print nothing else."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from matplotlib.testing.compare import compare_images

from alloc.problems import Instance
from alloc.problems.formats import write_instance


@pytest.mark.slow
def test_names_in_any_script_cause_no_output(tmp_path):
    """Missing glyphs and folders that cannot be written to cause no output, for results and fronts alike."""
    ids = ["日本語のタスク", "한국어", "हिन्दी عربي"]
    instance = Instance(
        name="日本", task_ids=ids, ability=[1, 2, 3, 4], workload=[1, 2, 3], task_position=[[0, 0], [1, 0], [0, 1]],
        start_task=[0, 1, 2, 0],
    )  # fmt: skip
    write_instance(instance, tmp_path / "names.json")
    solve, pareto = "solve names.json --method greedy", "pareto names.json --points 1 --iterations 1"
    drawn = {f"{count}.{suffix}": run for suffix in ("png", "svg") for count, run in enumerate((solve, pareto))}
    program = "import sys; from alloc.cli.main import main; sys.exit(any(main(one.split()) for one in sys.argv[1:]))"
    command = [sys.executable, "-c", program, *(f"{run} -q --plot {picture}" for picture, run in drawn.items())]
    home = {**os.environ, "HOME": "/nowhere", "MPLCONFIGDIR": "/nowhere", "PYTHONWARNINGS": "always::UserWarning"}
    ran = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=home)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
    assert all((tmp_path / picture).stat().st_size > 5_000 for picture in drawn)


def test_plot_matches_solve(alloc, small):
    """A stored or piped result gives the identical drawing to that of --plot."""
    ran = alloc("solve", "small.json", "--method", "greedy", "--json", "--output", "r.json", "--plot", "one.png", "-q")
    assert ran.code == 0
    assert alloc("plot", "small.json", "r.json", "--output", "two.png") == type(ran)(0, "", "")
    assert alloc("plot", "small.json", "-", "--output", "three.png", stdin=ran.out).code == 0
    assert compare_images("one.png", "two.png", 0) is None
    assert compare_images("one.png", "three.png", 0) is None


def test_allocation_is_drawn(alloc, small):
    """An allocation alone, as another program writes it, is scored and drawn, as .pdf too."""
    document = {"format": "alloc-allocation/1", "instance": "small", "assignment": {"a1": "t1", "a4": "t2"}}
    Path("plan.json").write_text(json.dumps(document))
    assert alloc("plot", "small.json", "plan.json", "--output", "plan.pdf") == type(alloc("--version"))(0, "", "")
    assert Path("plan.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("small.json", "small.json", "--output", "p.png"), "small.json: format: "),
        (("small.json", "r.json", "--output", "p.gif"), "p.gif: must end in .png, .svg or .pdf"),
        (("-", "-", "--output", "p.png"), "standard input: cannot be the instance and the result at once"),
        (("small.json", "r.json", "--output", "small.json"), "small.json: is INSTANCE and --output at once"),
    ],
)
def test_invalid_inputs_of_plot_are_one_line(alloc, small, arguments, message):
    """An instance instead of a result, an unknown suffix and clashing files give one line and exit code 2."""
    ran = alloc("plot", *arguments)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert message in ran.err
