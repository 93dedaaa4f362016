from pathlib import Path

import highspy
import pytest


def test_solution_of_an_exported_model_is_evaluated(alloc, small):
    """An instance is exported, solved by another solver, and its solution evaluated to the optimal scores."""
    assert alloc("export", "small.json", "--output", "small.lp") == type(alloc("--version"))(0, "", "")
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.readModel("small.lp")
    highs.run()
    highs.writeSolution("small.sol", 0)
    assert alloc("evaluate", "small.json", "small.sol", "--json").json["makespan"] == pytest.approx(13 / 11)


def test_export_model_is_an_alias(alloc, small):
    """`export-model` writes what `export` does."""
    for name in ("export", "export-model"):
        assert alloc(name, "small.json", "--output", f"{name}.mps").code == 0
    assert Path("export.mps").read_bytes() == Path("export-model.mps").read_bytes()


def test_standard_output_needs_a_format(alloc, small):
    """A model is written to standard output in the given format; without one, an error names the option."""
    ran = alloc("export", "small.json", "--output", "-", "--format", "mps", "--model", "plain")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.startswith("* ")
    assert ran.out.endswith("ENDATA\n")
    ran = alloc("export", "small.json", "--output", "-")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err == "alloc: --format: must be given, lp or mps, as the name of the file does not say it\n"


def test_energy_needs_a_makespan(alloc, small):
    """Minimising energy requires a makespan; the error names the option, and no file is left."""
    ran = alloc("export", "small.json", "--objective", "makespan-energy", "--output", "m.lp")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("alloc: --makespan: is required")
    assert not Path("m.lp").exists()
    ran = alloc("export", "small.json", "--objective", "makespan-energy", "--makespan", "1.2", "--output", "m.lp")
    assert ran.code == 0
    assert "every task is done within T = 1.2" in Path("m.lp").read_text()
