"""validate, convert, methods, and refusals of serve."""

from pathlib import Path

import pytest

from alloc.problems import makespan_lower_bound
from alloc.problems.formats import read_instance, to_document


def test_validate_summarises_the_instance(alloc, small, unservable):
    """A valid instance gets a summary: sizes, totals, reach, whether all tasks can be served, lower bound."""
    ran = alloc("validate", "small.json", "unservable.json", "--json")
    assert ran.code == 0
    first, second = ran.json
    assert (first["agents"], first["tasks"], first["total_ability"], first["total_workload"]) == (5, 3, 19, 20)
    assert (first["reach_density"], first["fewest_unserved"]) == (1.0, 0)
    assert first["lower_bound"] == makespan_lower_bound(small)
    assert (second["fewest_unserved"], second["lower_bound"], second["reach_density"]) == (1, None, 0.5)
    ran = alloc("validate", "small.json", "unservable.json")
    assert ran.out == ""
    assert "small.json: ok, 5 agents" in ran.err
    assert "at least 1 of the tasks cannot be served" in ran.err


def test_validate_continues_after_a_bad_file(alloc, small):
    """Each invalid file gets a line, and valid ones their summaries; the exit code is 2."""
    Path("bad.json").write_text("{")
    ran = alloc("validate", "bad.json", "small.json", "missing.json")
    assert ran.code == 2
    lines = ran.err.splitlines()
    assert [line.split(":")[0] for line in lines] == ["alloc", "small.json", "alloc"]


@pytest.mark.parametrize("target", ["copy.json", "copy.npz", "copy"])
def test_convert_keeps_the_instance(alloc, small, target):
    """Conversion to every format keeps the instance."""
    assert alloc("convert", "small.json", target).code == 0
    assert to_document(read_instance(target)) == to_document(small)


def test_convert_needs_a_name(alloc, small):
    """An empty target is an error, not the working folder."""
    ran = alloc("convert", "small.json", "")
    assert (ran.code, ran.err) == (2, "alloc: '': is not a file name\n")
    assert not Path("agents.csv").exists()


def test_convert_to_standard_output(alloc, small):
    """`-` writes JSON to standard output, and nothing else."""
    ran = alloc("convert", "small.json", "-")
    assert (ran.code, ran.err) == (0, "")
    assert ran.json["name"] == "small"


def test_methods_lists_all(alloc):
    """Every method is listed with its capabilities, for people and as JSON."""
    facts = {fact["name"]: fact for fact in alloc("methods", "--json").json}
    assert {"greedy", "milp", "cpsat", "ga", "gappo"} <= set(facts)
    assert facts["cpsat"]["proves"]
    assert not facts["greedy"]["proves"]
    ran = alloc("methods")
    assert (ran.code, ran.out) == (0, "")
    assert all(name in ran.err for name in facts)
    assert "doi:10.1137/0603019" in ran.err
    assert "makespan-moves" in ran.err


def test_methods_lists_the_parameters_of_one(alloc):
    """`alloc methods NAME` lists its parameters with values, default and meaning, for people and as JSON."""
    ran = alloc("methods", "ga")
    assert (ran.code, ran.out) == (0, "")
    assert "population               whole number >= 4 or none  none     Number of individuals" in ran.err
    settings = {one["name"]: one for one in alloc("methods", "lp-round", "--json").json["parameters"]}
    assert settings["time_share"]["values"] == "number > 0, <= 1"
    assert settings["makespan_excess"]["default"] == [0.0, 0.001, 0.003, 0.01, 0.03]
    assert "has no parameters" in alloc("methods", "greedy").err
    assert "did you mean 'ga'" in alloc("methods", "gaa").err


def test_plain_sets_a_parameter(alloc):
    """`--plain` sets the parameter of milp and cpsat, which the result states; other methods say who has it."""
    alloc("generate", "random", "--agents", "6", "--tasks", "3", "--seed", "1", "--output", "six.json")
    ran = alloc("solve", "six.json", "--method", "cpsat", "--plain", "--json", "--quiet")
    assert (ran.code, ran.json["parameters"], ran.json["status"]) == (0, {"plain": True}, "optimal")
    ran = alloc("solve", "six.json", "--plain")
    told = "alloc: --plain: needs a named method that has it, such as milp; auto may pick one without it\n"
    assert (ran.code, ran.err) == (2, told)
    ran = alloc("solve", "six.json", "--method", "ga", "--plain")
    assert (ran.code, ran.err) == (2, "alloc: --plain: method 'ga' takes no option 'plain'; milp, cpsat do\n")


def test_methods_names_missing_packages(alloc, monkeypatch):
    """A method with missing packages shows how to install them."""
    monkeypatch.setattr(
        "alloc.allocators.contract.method.find_spec", lambda name: None if name == "ortools" else object()
    )
    facts = {fact["name"]: fact for fact in alloc("methods", "--json").json}
    assert (facts["cpsat"]["installed"], facts["cpsat"]["missing"]) == (False, ["ortools"])
    assert "pip install ortools" in alloc("methods").err


def test_methods_survives_a_broken_plugin(alloc, monkeypatch):
    """A plugin that cannot be imported has a row with the error."""
    from importlib.metadata import EntryPoint

    broken = EntryPoint("broken", "no_such_module:Thing", "alloc.allocators")
    monkeypatch.setattr("alloc.allocators.contract.plugins.entry_points", lambda group: [broken])
    facts = {fact["name"]: fact for fact in alloc("methods", "--json").json}
    assert "cannot be imported" in facts["broken"]["error"]
    assert alloc("methods").code == 0


def test_prepare_loads_and_compiles_all_methods(alloc, monkeypatch):
    """Every method and policy that is installed is loaded, what loading leaves out is compiled, and nothing is printed.

    A broken plugin is a note. Here everything runs in one process, where what is loaded can be seen.
    """
    from importlib.metadata import EntryPoint

    from alloc.allocators.parallel.serial import SerialEngine

    monkeypatch.setattr("alloc.allocators.parallel.processes.ProcessEngine", SerialEngine)
    broken = EntryPoint("broken", "no_such_module:Thing", "alloc.allocators")
    monkeypatch.setattr("alloc.allocators.contract.plugins.entry_points", lambda group: [broken])
    loaded = []
    monkeypatch.setattr("alloc.allocators.load", loaded.append)
    monkeypatch.setattr("alloc.allocators.online.registry.load_policy", lambda name: loaded.append(f"policy {name}"))
    monkeypatch.setattr(
        "alloc.allocators.heuristic.greedy.tree_search.compile_loops", lambda: loaded.append("the tree of greedy")
    )
    monkeypatch.setattr(
        "alloc.allocators.exact.makespan.task_prices.compile_loops", lambda: loaded.append("prices for bounds")
    )
    ran = alloc("methods", "--prepare")
    assert (ran.code, ran.out) == (0, "")
    assert {
        "greedy",
        "cpsat",
        "local-search",
        "gappo",
        "the tree of greedy",
        "prices for bounds",
        "policy gappo",
    } <= set(loaded)
    assert "plugin 'broken'" in ran.err


def test_serve_loads_each_method_once(alloc):
    """A method with two sets of parameters is refused, since requests that name it could mean either."""
    ran = alloc("serve", "--stdio", "--load", "ga[population=8],ga")
    assert ran.code == 2
    assert "names ga twice" in ran.err
