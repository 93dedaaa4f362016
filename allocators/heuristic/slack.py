"""Savings by a little makespan slack, found by two short searches after a run; their plans are mentioned in a note."""

from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.allocators.heuristic.local_search.improve import improve
from alloc.problems import Evaluation
from alloc.problems.text import labelled, number, percent

SLACK = 0.001
"""Slack as a share of the makespan."""

MIN_SAVING = 0.01
"""Least saving, as a share of the energy, that is reported."""

TIME_SHARE, MAX_TIME_S = 0.02, 0.5
"""Time of each search, as a share of the time limit, and its maximum in seconds."""

ITERATIONS = 20
"""Maximum number of iterations of each search without a time limit; it never exceeds the number of agents."""


def note_saving(search: Search) -> None:
    """Add a note to a run if a slack of a thousandth of the makespan clearly saves energy.

    The saving is relative to the plan that the same search finds without slack, so that it is due to the slack alone.

    Parameters
    ----------
    search : Search
        The run, at its end.
    """
    best = search.best
    if search.interrupted or best is None or best.evaluation.makespan is None or best.evaluation.cost == 0:
        return
    least, slow = (_within(search, factor * best.evaluation.makespan) for factor in (1.0, 1.0 + SLACK))
    saving = 1 - slow.energy / min(least.energy, best.evaluation.energy)
    if saving >= MIN_SAVING:
        units = search.instance.units
        energy, makespan = labelled(number(slow.energy), units.energy), labelled(number(slow.makespan), units.time)
        search.notes.append(
            f"{percent(SLACK)} more time would save {percent(saving)} of the energy: a plan was found that takes "
            f"{energy} and {makespan} (--makespan-slack {SLACK})"
        )


def _within(search: Search, makespan: float) -> Evaluation:
    """Return the scores of a plan with little energy within a makespan in hours."""
    limit, enough = search.budget.time_limit_s, search.instance.n
    budget = Budget(None, min(ITERATIONS, enough))
    if limit is not None:
        budget = Budget(search.elapsed_s + min(MAX_TIME_S, TIME_SHARE * limit), enough)
    part = search.part(search.objective, MakespanTolerance(limit=makespan), budget=budget)
    improve(part)
    assert part.best is not None
    return part.best.evaluation
