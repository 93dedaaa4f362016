"""The summary of a result as text: its status, figures and bottleneck."""

import math
from typing import TYPE_CHECKING

from alloc.allocators.contract.budget import StopReason
from alloc.allocators.contract.status import Status
from alloc.allocators.contract.tolerance import PROVEN
from alloc.allocators.explain import Bottleneck, explain
from alloc.problems import Instance, Objective
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.text import counted, labelled, number, one_line, percent
from alloc.problems.units import labels

if TYPE_CHECKING:
    from alloc.allocators.replanning.moves import Moves
    from alloc.allocators.result import Result

STOPS = {
    StopReason.PROVEN: "optimality is proven",
    StopReason.FINISHED: "the method finished",
    StopReason.TIME_LIMIT: "the time limit was reached",
    StopReason.ITERATIONS: "the iteration limit was reached",
    StopReason.TARGET_GAP: "the target gap was reached",
    StopReason.INTERRUPTED: "it was interrupted",
}

MAX_REASONS = 5
"""Maximum number of unserved tasks for which the reason is given."""

MAX_EXAMINED = 1000
"""Maximum number of unserved tasks for which those are counted that no agent can do."""

LESS = {
    Objective.MAKESPAN: "less energy",
    Objective.MAKESPAN_ENERGY: "less energy",
    Objective.MAKESPAN_MOVES: "fewer moves",
}
"""How an allocation would be better at the same makespan."""

MAX_NAMES = 8
"""Maximum number of ids in a list."""

CLOSED_GAP = PROVEN + RELATIVE_TOLERANCE
"""Relative gap up to which no allocation is faster, as for the status `optimal` without slack."""


def summary(result: "Result") -> str:
    """Return the summary that ``alloc solve`` prints.

    Parameters
    ----------
    result : Result

    Returns
    -------
    str
        Several lines: status, makespan, energy, battery, runtime, bottleneck or unserved tasks.
    """
    return "\n".join([_headline(result), *figures(result), _ending(result), *bottleneck_lines(result)])


def _headline(result: "Result") -> str:
    size = f"{counted(result.instance.n, 'agent')}, {counted(result.instance.m, 'task')}"
    pinned = f" with {counted(len(result.pins), 'agent')} pinned" if result.pins else ""
    return f"{one_line(result.instance.name)} ({size}), {result.label}{pinned}: {_status(result)}"


def _status(result: "Result") -> str:
    if result.status is Status.OPTIMAL:
        less = LESS[result.objective]
        if result.makespan_limit is not None:
            return f"optimal; no allocation within {_time(result.instance, result.makespan_limit)} has {less}"
        better = "is faster" if result.objective is Objective.MAKESPAN else f"is faster, or as fast with {less}"
        return f"optimal; no allocation {better}"
    if result.status is Status.FEASIBLE:
        return "every task is served; optimality is not proven"
    if result.status is Status.INFEASIBLE:
        return _shortage(result)
    return "no allocation found"


def _shortage(result: "Result") -> str:
    """Return how many tasks are unserved, and how many of them no agent can do."""
    instance, tasks = result.instance, () if result.evaluation is None else result.evaluation.unserved_tasks
    unserved = f"{len(tasks)} of {counted(instance.m, 'task')}"
    lost = sum(not len(instance.reach.agents_of(task)) for task in tasks) if len(tasks) <= MAX_EXAMINED else 0
    if lost == len(tasks):
        return f"{unserved} cannot be served by any agent"
    nobody = f", {lost} of them by no agent at all" if lost else ""
    return f"{unserved} cannot be served along with the others{nobody}"


def figures(result: "Result") -> list[str]:
    """Return one line each for makespan, energy, moves and battery.

    Parameters
    ----------
    result : Result

    Returns
    -------
    list of str
    """
    score = result.evaluation
    if score is None:
        return []
    lines = []
    if result.makespan is None:
        lines.append(f"  makespan  {_time(result.instance, score.served_makespan)} over the served tasks")
    else:
        bound = f"at least {_time(result.instance, result.lower_bound)}, gap {percent(result.gap)}"
        lines.append(f"  makespan  {_time(result.instance, result.makespan)} ({bound})")
    units = labels(result.instance)
    energy = f"  energy    {labelled(number(score.energy), units.energy)}"
    if result.energy_lower_bound is not None:
        limit = result.makespan_limit
        when = "at this makespan" if limit is None else f"within {_time(result.instance, limit)}"
        least = labelled(number(result.energy_lower_bound), units.energy)
        energy += f" (at least {least} {when}, gap {percent(result.energy_gap)})"
    lines.append(f"{energy}, distance {labelled(number(score.distance), units.distance)}")
    if result.moves is not None:
        lines.append(f"  moves     {moves_line(result.moves, result.instance)}")
    if score.battery_remaining_percent is not None:
        lines.append(f"  battery   {score.battery_remaining_percent:.1f} % left on average")
    return lines


def moves_line(moves: "Moves", instance: Instance) -> str:
    """Return how many agents change their task, and which.

    Parameters
    ----------
    moves : Moves
    instance : Instance
    """
    count = len(moves.agents)
    total = count + moves.stayed + len(moves.idle)
    line = f"{count} of {total} {'moves' if count == 1 else 'move'}"
    if count:
        line += f": {_list([instance.agent_ids[i] for i in moves.agents])}"
    if moves.idle:
        line += f"; {counted(len(moves.idle), 'agent')} of them {'is' if len(moves.idle) == 1 else 'are'} idle now"
    if moves.cost is not None:
        line += f"; cost {number(moves.cost)}"
    if moves.cost_lower_bound is not None:
        line += f" (at least {number(moves.cost_lower_bound)}, gap {percent(moves.gap)})"
    return line


def _ending(result: "Result") -> str:
    return f"  runtime   {result.runtime_s:.3g} s; it stopped because {STOPS[result.stop_reason]}"


def bottleneck_lines(result: "Result") -> list[str]:
    """Return lines on the last task and what one more agent there would gain, or on the unserved tasks.

    Parameters
    ----------
    result : Result

    Returns
    -------
    list of str
    """
    if result.allocation is None or result.evaluation is None:
        return []
    if result.evaluation.unserved_tasks:
        ids = [result.instance.task_ids[j] for j in result.evaluation.unserved_tasks]
        return [f"Unserved: {_list(ids)}.", *_reasons(result)]
    found = explain(result.instance, result.allocation)
    if found is None:
        return ["There is no work to do."]
    return [_last_tasks(result.instance, found), _gain(result.instance, found), _room(result, found)]


def _reasons(result: "Result") -> list[str]:
    """Return one line each for the most urgent unserved tasks, with the reason."""
    weights = result.instance.priority
    return [
        f"  {one_line(result.instance.task_ids[one.task])}"
        f"{f' (priority {number(one.priority)})' if weights.max() > weights.min() else ''}: {one_line(one.reason)}"
        for one in result.unserved[:MAX_REASONS]
    ]


def _last_tasks(instance: Instance, found: Bottleneck) -> str:
    ids = [instance.task_ids[j] for j in found.last]
    if len(ids) > 1:
        end = _time(instance, found.makespan)
        return f"Bottleneck: {len(ids)} of {instance.m} tasks together, at {end}: {_list(ids)}."
    j = found.last[0]
    group = [instance.agent_ids[i] for i in found.agents]
    ability = float(instance.ability[list(found.agents)].sum())
    work = labelled(number(float(instance.workload[j])), instance.units.work)
    text = (
        f"Bottleneck: task {one_line(ids[0])} at {_time(instance, found.makespan)}, workload {work}"
        f" on {'agent' if len(group) == 1 else f'{len(group)} agents:'} {_list(group)} (ability {number(ability)})"
    )
    if found.next_task is None:
        return f"{text}."
    return f"{text}; next is {one_line(instance.task_ids[found.next_task])} at {_time(instance, found.next_time)}."


def _gain(instance: Instance, found: Bottleneck) -> str:
    if len(found.last) > 1:
        return "One more agent on one of them gains nothing, as the others stay unchanged."
    at_once = " that starts at the task" if instance.has_travel_time else ""
    if found.enough is None or found.next_task is None:
        assert found.typical is not None
        share = 1 - found.typical.makespan / found.makespan
        return (
            f"One more agent there{at_once} of ability {number(found.typical.ability)}, the median, gains"
            f" {percent(share)}: {_time(instance, found.typical.makespan)}."
        )
    share = 1 - found.enough.makespan / found.makespan
    ability = rounded_up(found.enough.ability, whole=bool((instance.ability == instance.ability.round()).all()))
    return (
        f"One more agent there{at_once} gains at most {percent(share)}: with ability {ability} or more,"
        f" {one_line(instance.task_ids[found.next_task])} becomes the last task,"
        f" at {_time(instance, found.enough.makespan)}."
    )


def _room(result: "Result", found: Bottleneck) -> str:
    used = f"{percent(found.use)} of the total ability is in use until then"
    if result.gap is None or result.gap <= CLOSED_GAP:
        return f"{used}; the same agents cannot be faster{_while_pinned(result)}."
    return f"{used}; reallocating the same agents{_while_pinned(result)} gains at most {percent(result.gap)}."


def _while_pinned(result: "Result") -> str:
    return " while some are pinned" if result.pins else ""


def rounded_up(ability: float, *, whole: bool) -> str:
    """Return `ability` rounded up to three significant digits, or to a whole number if `whole` and below 999,999."""
    if whole and ability < 999_999:
        return f"{math.ceil(ability * (1 - 1e-12))}"
    unit = 10.0 ** (math.floor(math.log10(ability)) - 2)
    return f"{math.ceil(ability / unit * (1 - 1e-12)) * unit:.3g}"


def _time(instance: Instance, value: float | None) -> str:
    """Return a time as text, with the unit of the instance if it has one."""
    return labelled(number(value), instance.units.time)


def _list(ids: list[str]) -> str:
    more = f" and {len(ids) - MAX_NAMES} more" if len(ids) > MAX_NAMES else ""
    return ", ".join(map(one_line, ids[:MAX_NAMES])) + more
