"""Solve a small problem from Python, and print scores and proven bounds.

Run ``python examples/solve_from_python.py``.
"""

from alloc.allocators import Result, solve
from alloc.problems import Instance


def main() -> None:
    """Solve an instance with three crews, two robots and two sites."""
    instance = Instance(
        name="two sites",
        agent_ids=["crew 1", "crew 2", "crew 3", "robot 1", "robot 2"],
        ability=[4, 3, 3, 2, 2],  # work per hour
        agent_position=[(0, 0), (1, 0), (4, 3), (0, 2), (4, 0)],  # km
        battery=[float("inf"), float("inf"), float("inf"), 8, 8],  # the robots fly 4 km at most
        energy_per_distance=2.0,
        task_ids=["harbour", "station"],
        workload=[18, 9],
        task_position=[(0, 0), (4, 3)],
    )
    for objective in ("makespan", "makespan-energy"):
        report(solve(instance, "cpsat", objective=objective, time_limit_s=5))


def report(result: Result) -> None:
    """Print the assignment and its scores."""
    assert result.allocation is not None
    print(f"{result.objective}: {result.status}, {result.makespan:.3g} h, energy {result.energy:.3g}")
    for agent, task in result.allocation.to_ids(result.instance).items():
        print(f"  {agent} -> {task or 'idle'}")


if __name__ == "__main__":
    main()
