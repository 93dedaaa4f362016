"""Exported models: their solutions by solvers are optimal."""

import subprocess
from pathlib import Path

import highspy
import pytest
from oracle import brute_force
from tiny_instances import all_can_be_served, varied_instance

from alloc.problems import (
    Evaluation,
    InputError,
    Instance,
    Objective,
    RefusedError,
    evaluate,
    read_allocation,
    write_model,
)
from alloc.problems.vocabulary import OBJECTIVES

SEEDS = [seed for seed in range(60) if all_can_be_served(varied_instance(seed))][:20]


def solved_by_highs(path: Path, instance: Instance) -> Evaluation:
    """Let HiGHS read a model and write its solution, and return the scores of the allocation in it."""
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.setOptionValue("mip_feasibility_tolerance", 1e-9)
    highs.setOptionValue("mip_rel_gap", 0.0)
    assert highs.readModel(str(path)) == highspy.HighsStatus.kOk
    highs.run()
    solution = path.with_suffix(".sol")
    highs.writeSolution(str(solution), 0)
    return evaluate(instance, read_allocation(solution, instance)[0])


@pytest.mark.parametrize("model", ["class", "plain"])
@pytest.mark.parametrize("seed", SEEDS)
def test_optimum_of_the_model_matches_brute_force(tmp_path: Path, seed: int, model: str) -> None:
    """The least makespan, or with speeds one in time, and the least energy at it, whatever fields the instance has."""
    instance = varied_instance(seed)
    best = brute_force(instance)
    file_format = ("lp", "mps")[seed % 2]
    for objective in OBJECTIVES:
        is_free = objective is Objective.MAKESPAN and not instance.has_travel_time
        path = tmp_path / f"{objective}.{file_format}"
        write_model(instance, path, model=model, objective=objective, makespan=None if is_free else best.makespan)
        score = solved_by_highs(path, instance)
        assert score.violations == ()
        assert score.makespan == pytest.approx(best.makespan, rel=1e-6)
        if objective is Objective.MAKESPAN_ENERGY:
            assert score.energy == pytest.approx(best.energy, rel=1e-6, abs=1e-9)


@pytest.mark.needs("cbcbox")
@pytest.mark.parametrize("file_format", ["lp", "mps"])
def test_cbc_reads_the_model(tmp_path: Path, file_format: str) -> None:
    """Another solver also treats variables as integers, and its solution is read."""
    import cbcbox

    (cbc,) = Path(cbcbox.__path__[0]).glob("cbc_dist/bin/cbc")
    for seed in SEEDS[:4]:
        instance = varied_instance(seed)
        best = brute_force(instance)
        path, solution = tmp_path / f"model.{file_format}", tmp_path / "cbc.sol"
        write_model(instance, path, objective="makespan-energy", makespan=best.makespan)
        subprocess.run([cbc, path, "-solve", "-solution", solution], check=True, capture_output=True)
        score = evaluate(instance, read_allocation(solution, instance)[0])
        assert score.energy == pytest.approx(best.energy, rel=1e-6, abs=1e-9)


def test_names_and_comments_identify_agents_and_tasks(tmp_path: Path) -> None:
    """Variables are named after ids, a class after its first agent; comments list classes and renamed ids."""
    instance = Instance(
        ability=[4, 4, 2], workload=[7, 3], agent_ids=["drone 1", "d2", "ü"], task_ids=["north field", "t"]
    )
    write_model(instance, tmp_path / "m.lp")
    text = (tmp_path / "m.lp").read_text()
    assert '\\ class drone_1: "drone 1", "d2"\n' in text
    assert '\\ agent agent: "\\u00fc"\n' in text
    assert '\\ task north_field: "north field"\n' in text
    assert " task_t: +2 n_agent__t +4 n_drone_1__t -3 y >= +0\n" in text
    assert " class_drone_1: +1 n_drone_1__north_field +1 n_drone_1__t <= +2\n" in text
    assert "\nbinaries\n n_agent__north_field\n n_agent__t\ngenerals\n" in text
    write_model(instance, tmp_path / "m.mps", model="plain")
    text = (tmp_path / "m.mps").read_text()
    assert text.startswith("* instance ")
    assert "agent_d2" in text
    assert "x_d2__north_field" in text


def test_units_far_from_one_are_scaled(tmp_path: Path) -> None:
    """Abilities of 1e-30 are not lost in the tolerances of solvers."""
    instance = Instance(ability=[3e-30, 2e-30, 2e-30], workload=[4e-30, 3e-30])
    write_model(instance, tmp_path / "m.lp")
    assert solved_by_highs(tmp_path / "m.lp", instance).makespan == pytest.approx(1.0)


def test_instances_without_a_model_are_refused(tmp_path: Path) -> None:
    """Energy and speeds need a makespan; work that nobody can do, no work, and too many pairs have no model."""
    path = tmp_path / "m.lp"
    plain = Instance(ability=[1, 2], workload=[1])
    with pytest.raises(InputError, match="makespan: is required"):
        write_model(plain, path, objective="makespan-energy")
    with pytest.raises(InputError, match="makespan: is required"):
        write_model(Instance(ability=[1], workload=[1], speed=[1.0]), path)
    with pytest.raises(InputError, match="makespan: must be"):
        write_model(plain, path, makespan=0)
    with pytest.raises(InputError, match="format: must be given"):
        write_model(plain, tmp_path / "m.txt")
    with pytest.raises(RefusedError, match="not every task can be served"):
        write_model(Instance(ability=[1], workload=[1, 1]), path)
    with pytest.raises(RefusedError, match="no work"):
        write_model(Instance(ability=[1], workload=[0]), path)
    many = Instance(ability=range(1, 6001), workload=[1.0] * 1000)
    with pytest.raises(RefusedError, match="6000000 variables"):
        write_model(many, path, model="plain")
    assert not path.exists()
