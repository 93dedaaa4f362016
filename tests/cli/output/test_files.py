"""Outputs of a command must not replace its inputs or each other."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from alloc.allocators.learned.files.policy_file import save_policy
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize


@pytest.mark.parametrize(
    "arguments",
    [
        ("solve", "small.json", "--output", "small.json"),
        ("solve", "small.json", "--output", "./nowhere/../small.json"),
        ("solve", "small.json", "--output", "link.json"),
        ("solve", "tables", "--output", "tables/tasks.csv"),
        ("solve", "small.json", "--method", "ppo", "--policy", "p.safetensors", "--output", "p.safetensors"),
        ("solve", "small.json", "--output", "same.png", "--plot", "same.png"),
        ("pareto", "small.json", "--output", "small.json"),
        ("pareto", "small.json", "--output", "same.png", "--plot", "same.png"),
        ("compare", "other.json", "small.json", "--methods", "greedy", "--csv", "small.json"),
        ("compare", "tables", "--methods", "greedy", "--csv", "tables/bases.csv"),
    ],
)
def test_clashing_outputs_are_refused(alloc, small, arguments):
    """One line says which two names are the same file, and no file is changed."""
    Path("nowhere").mkdir()
    Path("link.json").symlink_to("small.json")
    shutil.copy("small.json", "other.json")
    assert alloc("convert", "small.json", "tables").code == 0
    save_policy("p.safetensors", [ActorCritic(NetworkSize(4, 4, 1))], "ppo")
    before = {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    ran = alloc(*arguments)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert " at once; name another file" in ran.err
    assert {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()} == before


def test_result_may_replace_its_start(alloc, small):
    """A result may replace the one that it started from, and devices may be written repeatedly."""
    assert alloc("solve", "small.json", "--method", "greedy", "--output", "best.json").code == 0
    again = ("solve", "small.json", "--method", "greedy", "--start", "best.json", "--output", "best.json")
    assert alloc(*again).code == 0
    assert alloc("evaluate", "small.json", "best.json").code == 0


def test_standard_output_holds_one_document(alloc, small):
    """A table as CSV and as JSON cannot both go to standard output."""
    ran = alloc("compare", "small.json", "--methods", "greedy", "--csv", "-", "--json")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert "--csv: cannot be standard output together with --json" in ran.err


RUNS = [
    ("solve", "small.json", "--method", "greedy", "-q", "--output", "found.html"),
    ("solve", "small.json", "--method", "greedy", "-q", "--output", "found.json"),
    ("solve", "small.json", "--method", "greedy", "-q", "--plot", "found.png"),
    ("pareto", "small.json", "--points", "1", "--iterations", "1", "-q", "--output", "found.json"),
    ("pareto", "small.json", "--points", "1", "--iterations", "1", "-q", "--plot", "found.png"),
    ("compare", "small.json", "--methods", "greedy", "--csv", "found.csv"),
]


@pytest.fixture
def full_disk(monkeypatch):
    """A disk on which files can be created but not written."""

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fail)


@pytest.mark.parametrize("arguments", RUNS)
def test_unwritable_result_is_printed(alloc, small, full_disk, arguments):
    """If the disk is full at the end of a run, the result is on standard output, with exit code 2."""
    ran = alloc(*arguments)
    assert ran.code == 2
    assert ran.err.splitlines()[-1] == f"alloc: {arguments[-1]}: cannot be written: no space left on device"
    if arguments[0] == "compare":
        assert ran.out.startswith("instance,method,")
        assert ran.out.count("\n") == 2
    else:
        assert json.loads(ran.out)["format"] in ("alloc-result/1", "alloc-pareto/1")


@pytest.mark.parametrize("arguments", RUNS)
def test_json_is_printed_once(alloc, small, full_disk, arguments):
    """With --json standard output has exactly one document, even if other outputs fail."""
    ran = alloc(*arguments, "--json")
    assert (ran.code, ran.json["format"].split("-")[0]) == (2, "alloc")


def test_failing_output_does_not_prevent_others(alloc, small, monkeypatch):
    """One failing output does not prevent the others."""
    replace = os.replace

    def fail(begin, end):
        if str(end).endswith(".json"):
            raise OSError(28, "No space left on device")
        replace(begin, end)

    monkeypatch.setattr("os.replace", fail)
    ran = alloc("solve", "small.json", "--method", "greedy", "-q", "--output", "x.json", "--plot", "x.png")
    assert (ran.code, ran.json["instance"]) == (2, "small")
    assert Path("x.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is always full")
def test_full_standard_output_falls_back_to_standard_error(small, tmp_path):
    """If standard output is closed or full, the result is on standard error."""
    command = [sys.executable, "-m", "alloc.cli", "solve", "small.json", "--method", "greedy", "-q"]
    with open("/dev/full", "w") as full:
        ran = subprocess.run([*command, "--json"], stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    found, end = json.JSONDecoder().raw_decode(ran.stderr)
    assert (ran.returncode, found["format"]) == (2, "alloc-result/1")
    assert ran.stderr[end:].strip() == "alloc: standard output: cannot be written: no space left on device"
    with open("/dev/full", "w") as full:
        ran = subprocess.run([*command, "--help"], stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    assert (ran.returncode, ran.stderr) == (2, "alloc: standard output: No space left on device\n")
    ran = subprocess.run([*command, "--output", "/dev/full"], capture_output=True, text=True, cwd=tmp_path)
    assert (ran.returncode, json.loads(ran.stdout)["format"], ran.stderr.count("\n")) == (2, "alloc-result/1", 1)


@pytest.mark.skipif(shutil.which("bash") is None, reason="process substitution is of bash")
@pytest.mark.parametrize(
    ("line", "kept"),
    [
        ("{} --output /dev/stdout >> log", "earlier\n"),
        pytest.param("{} --output /dev/stdout --json >> log", "earlier\n", marks=pytest.mark.slow),
        pytest.param("{} --output /proc/self/fd/1 >> log", "earlier\n", marks=pytest.mark.slow),
        pytest.param("{} --output /dev/fd/7 7>> log", "earlier\n", marks=pytest.mark.slow),
        ("{} --output >(cat >> log); wait $!", "earlier\n"),
        pytest.param("{} --output /dev/stdout | cat >> log", "earlier\n", marks=pytest.mark.slow),
        ("mkfifo p; cat p >> log & {} --output p; wait", "earlier\n"),
    ],
)
def test_results_can_be_written_to_descriptors_and_pipes(small, tmp_path, line, kept):
    """A result appended to a file follows the old content, and is written once."""
    (tmp_path / "log").write_text(kept)
    command = f"'{sys.executable}' -m alloc.cli solve small.json --method greedy -q"
    ran = subprocess.run(["bash", "-c", line.format(command)], capture_output=True, text=True, cwd=tmp_path)
    assert ran.stderr == ""
    text = (tmp_path / "log").read_text()
    assert text.startswith(kept)
    assert json.loads(text.removeprefix(kept))["instance"] == "small"


@pytest.mark.slow
def test_non_utf_8_file_names(small, tmp_path):
    """Names that are not UTF-8 work for instances, results, pictures, tables and policies, in every command."""
    old = os.fsdecode(b"caf\xe9")
    shutil.copy(tmp_path / "small.json", tmp_path / "plain.json")
    document = json.loads((tmp_path / "small.json").read_text())
    del document["name"]
    (tmp_path / f"{old}.json").write_text(json.dumps(document))
    save_policy(tmp_path / f"{old}.safetensors", [ActorCritic(NetworkSize(4, 4, 1))], "ppo")
    solve = ("solve", f"{old}.json", "--seed", "1", "--iterations", "1")
    commands = (
        (*solve, "--method", "greedy", "--output", f"{old}-result.json", "--plot", f"{old}.png"),
        (*solve, "--method", "ppo", "--policy", f"{old}.safetensors"),
        ("evaluate", f"{old}.json", f"{old}-result.json"),
        ("convert", f"{old}.json", old),
        ("convert", old, f"{old}.npz"),
        ("validate", f"{old}.json", f"{old}.npz", old),
        ("compare", f"{old}.json", "--methods", "greedy", "--csv", f"{old}.csv"),
    )
    program = "import sys; from alloc.cli.main import main; sys.exit(any(main(one.split('|')) for one in sys.argv[1:]))"
    command = [sys.executable, "-c", program, *map("|".join, commands)]
    ran = subprocess.run(command, capture_output=True, cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert json.loads((tmp_path / f"{old}-result.json").read_text())["instance"] == "caf\N{REPLACEMENT CHARACTER}"
