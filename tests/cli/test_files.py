"""Files that a command reads are not replaced by what it writes, nor one output by another."""

import shutil
from pathlib import Path

import pytest

from alloc.allocators.learned.network import ActorCritic, NetworkSize
from alloc.allocators.learned.policy_file import save_policy


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
    ],
)
def test_outputs_that_clash_are_refused(alloc, small, arguments):
    """One line says which two names are one file, and every file stays as it was."""
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


def test_a_start_may_be_replaced_by_what_is_better(alloc, small):
    """An answer may take the place of the one that it began with, and devices take all."""
    assert alloc("solve", "small.json", "--method", "greedy", "--output", "best.json").code == 0
    again = ("solve", "small.json", "--method", "greedy", "--start", "best.json", "--output", "best.json")
    assert alloc(*again).code == 0
    assert alloc("evaluate", "small.json", "best.json").code == 0


def test_standard_output_holds_one_thing(alloc, small):
    """A table as CSV and as JSON cannot both go to standard output."""
    ran = alloc("compare", "small.json", "--methods", "greedy", "--csv", "-", "--json")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert "'--csv': and --json cannot both be standard output" in ran.err
