from pathlib import Path

import pytest

from alloc.allocators import Status, solve
from alloc.problems import read_instance


@pytest.mark.parametrize("method", ["cpsat", "milp"])
def test_solvers_do_not_cut_off_the_optimum(method):
    """With abilities over seven orders of magnitude, CP-SAT's presolve proved a wrong optimum; the right one is 0."""
    instance = read_instance(Path(__file__).with_name("wide_abilities.json"))
    result = solve(instance, method, objective="makespan-energy", makespan_slack=0.5, time_limit_s=10, threads=1)
    assert (result.status, result.energy) == (Status.OPTIMAL, 0.0)
