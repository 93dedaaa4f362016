"""``alloc evaluate``."""

from typing import TYPE_CHECKING, Annotated, TypedDict

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import note, say, write_json
from alloc.cli.output.files import read_pair

if TYPE_CHECKING:
    from alloc.allocators import Result

EXAMPLES = examples(
    "alloc evaluate demo.json best.json",
    "alloc evaluate demo.json best.json --json",
    "alloc evaluate demo.json demo.sol",
    "alloc solve demo.json --json | alloc evaluate demo.json -",
    closing="The bounds in a result file are shown if agents and scores match this instance; else, how they differ. "
    "Exit code 1 if a task is unserved or an agent is assigned to a task that it cannot take.",
)

SCORES = (
    "instance",
    "makespan",
    "served_makespan",
    "lower_bound",
    "gap",
    "makespan_limit",
    "energy",
    "energy_lower_bound",
    "energy_gap",
    "distance",
    "battery_remaining_percent",
    "reward",
    "unserved_tasks",
    "unserved_reasons",
    "violations",
    "assignment",
)
"""Fields of a result that concern the allocation and not the run; `makespan_limit` only if one was given."""


class TaskScore(TypedDict):
    """One entry of ``tasks`` in the JSON; `completion_time` is None if the task is unserved."""

    id: str
    workload: float
    agents: int
    ability: float
    coverage: float
    completion_time: float | None


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("evaluate", epilog=EXAMPLES)(evaluate_command)


def evaluate_command(
    instance: options.InstanceArgument,
    allocation: Annotated[
        str,
        typer.Argument(
            metavar="ALLOCATION",
            help=f"{options.PLAN}; - is standard input.",
        ),
    ],
    json: options.JsonOption = False,
) -> None:
    """Score an allocation from any source."""
    from alloc.allocators.conclusion import scored_result, with_claims

    problem, answer, claims = read_pair(instance, allocation)
    result = scored_result(problem, answer, "evaluate")
    if claims:
        result, lines = with_claims(result, claims)
        for line in lines:
            note(f"{allocation}: {line}")
    score = result.evaluation
    assert score is not None
    if json:
        write_json({"format": "alloc-evaluation/1", **_scores(result), "tasks": _tasks(result)})
        if score.reward_saturated:
            note("the reward (3) overflows and is given as the most negative float")
    else:
        _tell(result)
    raise typer.Exit(1 if score.unserved_tasks or score.violations else 0)


def _scores(result: "Result") -> dict[str, object]:
    fields = result.to_dict()
    return {name: fields[name] for name in SCORES if name in fields}


def _tasks(result: "Result") -> list[TaskScore]:
    """Return the scores of each task, in the order of the instance."""
    import numpy as np

    problem, score, allocation = result.instance, result.evaluation, result.allocation
    assert score is not None
    assert allocation is not None
    barred = {violation.agent for violation in score.violations}
    sent = [task for agent, task in enumerate(allocation.task_of_agent.tolist()) if task >= 0 and agent not in barred]
    agents = np.bincount(np.array(sent, dtype=np.intp), minlength=problem.m)
    return [
        {
            "id": problem.task_ids[j],
            "workload": float(problem.workload[j]),
            "agents": int(agents[j]),
            "ability": float(score.group_ability[j]),
            "coverage": float(score.coverage[j]),
            "completion_time": float(score.completion_time[j]) if np.isfinite(score.completion_time[j]) else None,
        }
        for j in range(problem.m)
    ]


def _tell(result: "Result") -> None:
    from alloc.allocators.summary import bottleneck_lines, figures
    from alloc.cli.output.console import table
    from alloc.problems.text import heading, number

    score = result.evaluation
    assert score is not None
    rows = [
        [
            entry["id"],
            number(entry["workload"]),
            str(entry["agents"]),
            number(entry["ability"]),
            number(entry["coverage"]),
            "unserved" if entry["completion_time"] is None else number(entry["completion_time"]),
        ]
        for entry in _tasks(result)
    ]
    units = result.instance.units
    header = ["task", heading("workload", units.work), "agents", "ability", "coverage", heading("done at", units.time)]
    say(table(header, rows))
    say("\n".join(["", f"{result.instance.name}:", *figures(result), *bottleneck_lines(result)]))
    for violation in score.violations:
        agent, task = result.instance.agent_ids[violation.agent], result.instance.task_ids[violation.task]
        say(f"Violation: agent {agent} cannot take task {task}: {violation.reason}.")
