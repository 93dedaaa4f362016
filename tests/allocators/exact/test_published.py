"""The published results on machine covering are consistent: values of plans, and bounds."""

import csv
from pathlib import Path

import numpy as np
import pytest

from alloc.cli.commands.experiments.sources import gather
from alloc.problems import Allocation, evaluate, machine_covering, makespan_lower_bound

TABLE = Path(__file__).parents[3] / "docs" / "benchmarks" / "machine-covering.csv"

pytestmark = pytest.mark.skipif(not TABLE.exists(), reason="the tests run without the documentation")


def rows() -> list[dict[str, str]]:
    with TABLE.open(newline="") as text:
        found = list(csv.DictReader(text))
    assert {row["workloads"] for row in found} == {"equal", "unequal"}
    return found


def test_plans_reach_published_makespans_and_bounds_do_not_exceed_them() -> None:
    """Evaluated again, every plan serves all tasks in the published time, not below the published and simple bounds."""
    for row in rows():
        shape = (int(row[name]) for name in ("agents", "tasks", "low", "high", "seed"))
        instance = machine_covering(*shape, equal=row["workloads"] == "equal")
        (named,) = gather([row["instance"]])
        assert (named.ability.tolist(), named.workload.tolist()) == (
            instance.ability.tolist(),
            instance.workload.tolist(),
        )
        plan = Allocation(np.array([-1 if task == "-" else int(task) for task in row["plan"].split()]))
        score, bound = evaluate(instance, plan), float(row["lower_bound"])
        assert len(score.unserved_tasks) == 0
        assert score.makespan == pytest.approx(float(row["makespan"]), rel=1e-12)
        assert makespan_lower_bound(instance) * (1 - 1e-9) <= bound <= score.makespan * (1 + 1e-12)
        assert (row["status"] == "optimal") == (score.makespan - bound <= 1e-6 * score.makespan)


def test_least_loads_match_the_makespans() -> None:
    """With equal workloads, the optimum's least load is an integer, and so is the bound on it, the same number."""
    for row in rows():
        if row["workloads"] == "equal":
            load = 1000 / float(row["makespan"])
            assert int(row["min_load"]) == pytest.approx(load, rel=1e-9)
            assert int(row["min_load"]) <= int(row["min_load_bound"]) == int(1000 / float(row["lower_bound"]) + 1e-6)
        else:
            assert row["min_load"] == row["min_load_bound"] == ""
