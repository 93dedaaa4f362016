"""What a little more time would save: two short searches at the end of a run, whose plans are told and not returned."""

from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.allocators.heuristic.local_search.improve import improve
from alloc.problems import Evaluation
from alloc.problems.text import labelled, number, percent

SLACK = 0.001
"""Share of the makespan that is added."""

LEAST_SAVING = 0.01
"""Share of the energy from which on a saving is told."""

TIME_SHARE, MOST_S = 0.02, 0.5
"""Seconds of each search: a share of the time limit, and at most so many."""

ITERATIONS = 20
"""Most iterations of each where no time is counted; one for each agent is enough in any case."""


def note_saving(search: Search) -> None:
    """Add a note to a run if a thousandth more time clearly saves energy.

    The saving is against what the same search finds without more time, so that it is the slack's and not the search's.

    Parameters
    ----------
    search : Search
        At its end.
    """
    best = search.best
    if search.interrupted or best is None or best.evaluation.makespan is None or best.evaluation.cost == 0:
        return
    least, slow = (_within(search, factor * best.evaluation.makespan) for factor in (1.0, 1.0 + SLACK))
    saving = 1 - slow.energy / min(least.energy, best.evaluation.energy)
    if saving >= LEAST_SAVING:
        units = search.instance.units
        energy, makespan = labelled(number(slow.energy), units.energy), labelled(number(slow.makespan), units.time)
        search.notes.append(
            f"{percent(SLACK)} more time would save {percent(saving)} of the energy: a plan was found that takes "
            f"{energy} and {makespan} (--makespan-slack {SLACK})"
        )


def _within(search: Search, makespan: float) -> Evaluation:
    """Return the scores of a plan with little energy that takes no longer than so many hours."""
    limit, enough = search.budget.time_limit_s, search.instance.n
    budget = Budget(None, min(ITERATIONS, enough))
    if limit is not None:
        budget = Budget(search.elapsed_s + min(MOST_S, TIME_SHARE * limit), enough)
    part = search.part(search.objective, MakespanTolerance(limit=makespan), budget=budget)
    improve(part)
    assert part.best is not None
    return part.best.evaluation
