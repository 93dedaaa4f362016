"""Linear programmes that can be stopped."""

import threading
import time

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.sparse import csr_array

from alloc.allocators.runtime.linear_programme import minimise


def programme(seed: int, rows: int, columns: int) -> tuple[np.ndarray, csr_array, np.ndarray]:
    """Return costs, constraints and limits of a covering programme."""
    rng = np.random.default_rng(seed)
    part = rng.random((rows, columns)) * (rng.random((rows, columns)) < 0.5)
    return rng.random(columns) + 0.1, csr_array(-part), -rng.random(rows)


@pytest.mark.parametrize("seed", range(5))
def test_solutions_match_scipy(seed):
    """Solution, value and duals equal those of scipy's interface to the same solver."""
    cost, matrix, limits = programme(seed, 12, 40)
    upper = np.full(40, 0.5)
    expected = linprog(cost, matrix, limits, bounds=np.column_stack([np.zeros(40), upper]), method="highs")
    found = minimise(cost, matrix, limits, should_stop=lambda: False, upper=upper, seconds=60)
    assert found.value == pytest.approx(expected.fun, rel=1e-9)
    np.testing.assert_allclose(found.x, expected.x, atol=1e-9)
    np.testing.assert_allclose(found.multiplier, -expected.ineqlin.marginals, atol=1e-9)


def test_infeasible_and_timed_out_programmes_have_no_solution():
    """An infeasible programme, and one without time, have no solution."""
    cost, matrix, limits = programme(0, 12, 40)
    assert minimise(cost, matrix, limits, should_stop=lambda: False, upper=np.zeros(40)) is None
    assert minimise(*programme(0, 100, 500), should_stop=lambda: False, seconds=0.0) is None


def test_stop_request_ends_the_solver():
    """A stopped programme has no solution, and leaves no thread behind."""
    before, limit = threading.active_count(), time.monotonic() + 20
    assert minimise(*programme(1, 300, 2000), should_stop=lambda: True) is None
    while threading.active_count() > before and time.monotonic() < limit:
        time.sleep(0.01)
    assert threading.active_count() == before
