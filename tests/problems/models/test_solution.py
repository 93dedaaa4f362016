"""Solution files of solvers are read as allocations."""

from pathlib import Path

import pytest

from alloc.problems import Allocation, InputError, Instance, read_allocation

INSTANCE = Instance(ability=[4, 4, 2], workload=[10, 3], task_ids=["north field", "t"])

HIGHS = """Model status
Optimal

# Primal solution values
Feasible
Objective 1
# Columns 5
n_a1__north_field 2
n_a3__north_field {value}
n_a1__t 0
n_a3__t 0
y 1
# Rows 2
task_t 0
# Dual solution values
None
"""
CBC = """Optimal - objective value 1.00000000
      0 n_a1__north_field       2                     0
** 1 n_a3__north_field   {value}   -0
      4 y                       1                     1
"""
GUROBI = """# Solution for model obj
# Objective value = 1
n_a1__north_field 2
n_a3__north_field {value}
n_a1__t 0
y 1
"""
SCIP = """solution status: optimal solution found
objective value:                                    1
n_a1__north_field                                   2 \t(obj:0)
n_a3__north_field                                   {value} \t(obj:0)
y                                                   1 \t(obj:1)
"""
HIGHS_PRETTY = """Columns
    Index Status        Lower        Upper       Primal         Dual  Type        Name
        0                   0            1            1               Continuous  y
        1                   0            2            2               Integer     n_a1__north_field
        2                   0            1 {value:>12}               Integer     n_a3__north_field
        3                   0            2            0               Integer     n_a1__t
Rows
    Index Status        Lower        Upper       Primal         Dual  Name
        0                   0          inf            0               task_t

Model status: Optimal

Objective value: 1
"""
SOLVERS = {"highs": HIGHS, "highs-pretty": HIGHS_PRETTY, "cbc": CBC, "gurobi": GUROBI, "scip": SCIP}


@pytest.mark.parametrize("solver", SOLVERS)
def test_class_counts_of_every_solver_are_assigned(tmp_path: Path, solver: str) -> None:
    """Counts of a class are assigned to its agents, for files of all solvers and any names."""
    path = tmp_path / "answer.txt"
    path.write_text(SOLVERS[solver].format(value="0.9999999"))
    assert read_allocation(path, INSTANCE) == (Allocation([0, 0, 0]), None)


@pytest.mark.parametrize("solver", SOLVERS)
def test_fractional_solutions_are_refused(tmp_path: Path, solver: str) -> None:
    """Fractional values are refused as the solution of a relaxation."""
    path = tmp_path / "answer.sol"
    path.write_text(SOLVERS[solver].format(value="0.5"))
    with pytest.raises(InputError, match=r"answer\.sol: line \d+: 0\.5 is not a number of agents"):
        read_allocation(path, INSTANCE)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Infeasible - objective value 0", "line 1: the solver found no solution"),
        ("Integer infeasible - objective value 0", "the solver found no solution"),
        ("Model status\nInfeasible\n", "the solver found no solution"),
        (HIGHS_PRETTY.replace("Optimal", "Infeasible").format(value=""), "the solver found no solution"),
        (HIGHS_PRETTY.format(value=""), "line 5: the value of n_a3__north_field must be a number, got ''"),
        ("solution status: infeasible\nno solution available\n", "the solver found no solution"),
        ("# Objective value = 1\nx 1\nz 3\n", "has no variable of a model"),
        ("", "has no variable of a model"),
        ("# Objective value = 1\nx_a9__t 1\n", "line 2: no agent of instance 'instance' has the name 'a9'"),
        ("# Objective value = 1\nx_a1__s 1\n", "line 2: no task of instance 'instance' has the name 's'"),
        (
            "# Objective value = 1\nx_a1__t 1\nx_a1__north_field 1\n",
            "line 3: with this, there are more tasks than agents like a1",
        ),
        ("# Objective value = 1\nn_a1__t 3\n", "line 2: with this, there are more tasks than agents like a1"),
        ("# Objective value = 1\nx_a1__t one\n", "line 2: the value of x_a1__t must be a number, got 'one'"),
        ("# Objective value = 1\nx_a1__t nan\n", "line 2: nan is not a number of agents"),
        ("# Objective value = 1\nx_a1__t inf\n", "line 2: inf is not a number of agents"),
        ("# Objective value = 1\nx_a1__t -1\n", "line 2: -1 is not a number of agents"),
        ("# Objective value = 1\nx_a1__t 1\nn_a3__t 1\n", "mixes variables of several models: n, x"),
    ],
)
def test_invalid_solutions_are_one_line(tmp_path: Path, text: str, message: str) -> None:
    """Files that are not a solution of a model of this instance are refused with the line."""
    path = tmp_path / "answer.sol"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_allocation(path, INSTANCE)
    assert message in str(caught.value)
    assert str(caught.value).count("\n") == 0


def test_solution_with_all_agents_idle_is_read(tmp_path: Path) -> None:
    """As SCIP leaves zeros out, a file may contain only y, and all agents are idle."""
    path = tmp_path / "answer.sol"
    path.write_text("solution status: optimal solution found\ny 1e-9 (obj:1)\n")
    assert read_allocation(path, INSTANCE)[0] == Allocation.idle(INSTANCE)
