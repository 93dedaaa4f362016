"""Methods that do not learn, on the same instances."""

from alloc.allocators.experiments.reproduction.protocol import INSTANCE_SEED, Job, scenarios_of
from alloc.allocators.experiments.reproduction.rows import Solved
from alloc.allocators.solve import solve
from alloc.problems import Objective
from alloc.problems.generate import paper


def solve_all(job: Job) -> list[Solved]:
    """Solve the instances of a run, makespan first and energy second, and return a row for each."""
    return [_solved(job, scenario) for scenario in scenarios_of(job.run)]


def _solved(job: Job, scenario: int) -> Solved:
    result = solve(
        paper(scenario, INSTANCE_SEED + job.run),
        job.method,
        objective=Objective.MAKESPAN_ENERGY,
        time_limit_s=job.time_limit_s,
        seed=job.run,
        threads=1,
        handle_signals=False,
    )
    battery = None if result.evaluation is None else result.evaluation.battery_remaining_percent
    return Solved(
        method=job.method,
        run=job.run,
        scenario=scenario,
        time_limit_s=job.time_limit_s,
        status=str(result.status),
        makespan=_number(result.makespan),
        lower_bound=_number(result.lower_bound),
        unserved=len(result.unserved),
        battery=_number(battery),
        seconds=result.runtime_s,
    )


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
