from pathlib import Path

import pytest

from alloc.problems import Family, machine_covering, paper, random_instance
from alloc.problems.formats import read_instance, to_document


def test_paper_scenarios_match_the_generator(alloc):
    """A scenario with a seed is the same instance as from Python."""
    assert alloc("generate", "paper-1", "--seed", "7", "--output", "p.json").code == 0
    assert to_document(read_instance("p.json")) == to_document(paper(1, 7))


def test_every_parameter_of_the_family_is_an_option(alloc):
    """All options together give the instance of that family."""
    ran = alloc(
        "generate", "random", "--agents", "9", "--tasks", "4", "--ability", "lognormal", "--ability-min", "2",
        "--ability-max", "6", "--workload", "pareto", "--load", "1.5", "--real", "--sites", "clustered", "--clusters",
        "2", "--dimensions", "2", "--world-size", "10", "--starts", "depots", "--depots", "2", "--range", "3:8",
        "--battery", "none", "--speed", "1:2", "--priority", "2", "--allowed-fraction", "0.5",
        "--energy-per-distance", "2", "--tau", "0.4", "--seed", "5", "--output", "r.npz",
    )  # fmt: skip
    assert (ran.code, ran.out) == (0, "")
    family = Family(
        agents=9, tasks=4, ability="lognormal", ability_min=2, ability_max=6, workload="pareto", load=1.5,
        integer=False, sites="clustered", clusters=2, dimensions=2, world_size=10, starts="depots", depots=2,
        communication_range=(3, 8), battery=None, speed=(1, 2), priority=2, allowed_fraction=0.5,
        energy_per_distance=2, tau=0.4,
    )  # fmt: skip
    assert to_document(read_instance("r.npz")) == to_document(random_instance(family, 5))


def test_machine_covering_matches_the_generator(alloc):
    """Families of the published table have a name and their own options."""
    assert alloc("generate", "covering", "--seed", "7", "--output", "c.json").code == 0
    assert to_document(read_instance("c.json")) == to_document(machine_covering(100, 25, 1, 1000, 7))
    options = ("--agents", "9", "--tasks", "4", "--ability-min", "20", "--ability-max", "50", "--workload", "uniform")
    assert alloc("generate", "covering", *options, "--seed", "1", "--output", "u.json").code == 0
    assert to_document(read_instance("u.json")) == to_document(machine_covering(9, 4, 20, 50, 1, equal=False))
    assert alloc("generate", "covering", "--choices", "3", "--output", "r.json").code == 0
    assert to_document(read_instance("r.json")) == to_document(machine_covering(100, 25, 1, 1000, 0, choices=3))
    refused = alloc("generate", "random", "--choices", "3")
    assert refused.code == 2
    assert "is for covering, not for random" in refused.err


@pytest.mark.parametrize(
    ("option", "value", "told"),
    [
        ("--workload", "pareto", "alloc: --workload: must be equal or uniform"),
        ("--ability-min", "1.5", "alloc: --ability-min: must be a whole number"),
        ("--ability-max", "0", "alloc: --ability-max: must be a whole number >= "),
        ("--tau", "0.5", "--tau: is for random, not for covering"),
    ],
)
def test_machine_covering_refuses_other_options(alloc, option, value, told):
    """Options that do not apply to these families are errors that name them."""
    ran = alloc("generate", "covering", option, value)
    assert (ran.code, ran.out) == (2, "")
    assert told in ran.err


def test_count_writes_a_file_per_seed(alloc):
    """--count writes one file per seed, starting with the given one."""
    assert alloc("generate", "paper-1", "--seed", "3", "--count", "2", "--output", "new/many").code == 0
    files = sorted(Path("new/many").iterdir())
    assert [read_instance(file).name for file in files] == ["paper-1-seed-3", "paper-1-seed-4"]


def test_standard_output_is_only_json(alloc):
    """Without --output the instance is written to standard output."""
    ran = alloc("generate", "random", "--agents", "3", "--tasks", "2")
    assert ran.err == ""
    assert ran.json["format"] == "alloc-instance/1"


def test_errors_name_the_option(alloc):
    """An error for an invalid value names its option."""
    assert alloc("generate", "random", "--ability-min", "-1").err.startswith("alloc: --ability-min: must be")
    assert alloc("generate", "random", "--range", "5:1").err.startswith("alloc: --range: must be an ascending range")
