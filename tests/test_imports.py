"""Modules that an import loads."""

import subprocess
import sys

import pytest

HEAVY = ("torch", "cvxpy", "ortools", "deap", "matplotlib", "highspy", "ray", "numba", "gymnasium", "pettingzoo")


@pytest.mark.parametrize("package", ["alloc.problems", "alloc.problems.generate", "alloc.allocators"])
def test_import_loads_no_heavy_packages(package: str) -> None:
    """Neither the problems nor the contract of allocators loads solvers, torch or matplotlib."""
    code = f"import sys, {package}; print(*(name for name in {HEAVY} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_problems_do_not_import_allocators() -> None:
    """`problems` imports nothing from `allocators`."""
    code = "import sys, alloc.problems; print(*(name for name in sys.modules if name.startswith('alloc.allocators')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
