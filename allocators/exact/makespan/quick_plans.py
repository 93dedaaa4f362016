"""Plans without the solver, by descents and repartition search."""

import numpy as np

from alloc.allocators.exact.makespan.descent import descend
from alloc.allocators.exact.makespan.state import TIGHT, MakespanState

MANY_KICKS, FEW_KICKS = 300, 20
"""Number of kicks of a descent: after solvers have failed, and at the start."""

REPEATABLE_TARGETS = 20
"""Number of target makespans of a repartition search in repeatable runs."""

PATIENCE_S = 0.05
"""Seconds without a better plan after which the repartition search may end."""

FAR = 0.01
"""Relative gap above which the first target is halfway to the lower bound instead of the bound itself."""

STEPS_PER_TARGET = 1000
"""Number of repartitions for one target makespan."""

STEPS_PER_PROBE = 20_000
"""Number of repartitions for a probed makespan."""


def descend_in_steps(state: MakespanState) -> None:
    """Descend for the lower bound, then for target makespans closer to the fastest plan."""
    for weight in (1.0, 0.5, 0.25):
        if state.ended:
            return
        target = state.upper + weight * (state.lower - state.upper)
        _descend(state, max(state.lower, target), 0.03, kicks=FEW_KICKS)  # smaller only by rounding


def search_repartitions(state: MakespanState, share: float) -> None:
    """Search by repartition for target makespans closer to the fastest plan, for at most this share of the time.

    Parameters
    ----------
    share : float
        Time share; the search ends earlier if plans no longer improve.
    """
    search, repartition = state.search, state.repartition
    if not repartition.is_tractable or state.partial or state.ended:  # it cannot choose which tasks to serve
        return

    def over() -> bool:
        return state.over or search.elapsed_s > until_s

    repartition.start(state.plan)
    begin_s = last_s = search.elapsed_s
    targets, weight = 0, 1.0 if state.upper <= (1 + FAR) * state.lower else 0.5
    until_s = begin_s + state.share_s(share)
    while not state.ended:
        upper, now_s, targets = state.upper, search.elapsed_s, targets + 1
        patience_s = max(state.share_s(share / 2, PATIENCE_S), last_s - begin_s)
        late = now_s > until_s or now_s - last_s > patience_s
        if targets > REPEATABLE_TARGETS if state.repeatable else late:
            return
        target = max(state.lower, upper + weight * (state.lower - upper) - TIGHT / 2 * upper)
        _, plan = repartition.run(target, over, max_steps=STEPS_PER_TARGET, price=state.price)
        search.submit(plan)
        if state.upper < upper:
            last_s = search.elapsed_s
        else:
            weight = weight / 2 if weight > 0.1 else float(state.rng.choice([0.0, 0.5, 1.0]))


def find_plan(state: MakespanState, time: float) -> bool:
    """Search by repartition, or by descent if there are too many agents; return whether a plan for `time` was found."""
    if not state.repartition.is_tractable:
        return _descend(state, time, 0.05, kicks=MANY_KICKS)
    state.repartition.start(state.plan)
    until_s = np.inf if state.repeatable else state.search.elapsed_s + state.share_s(0.01)
    found, plan = state.repartition.run(
        time,
        lambda: state.over or state.search.elapsed_s >= until_s,
        max_steps=STEPS_PER_PROBE,
        price=state.price,
    )
    return state.submit(plan, time) and found


def _descend(state: MakespanState, time: float, share: float, kicks: int) -> bool:
    """Descend from the fastest plan; return whether one with makespan `time` was found."""
    model = state.model
    table = model.classes.tally(state.plan)[:, model.tasks]
    served = table.any(axis=0)
    until_s = np.inf if state.repeatable else state.search.elapsed_s + state.share_s(share)
    table[:, served], _ = descend(
        model.shares(time)[:, served],
        table[:, served],
        model.classes.count - table.sum(axis=1),
        state.rng,
        kicks=kicks,
        should_stop=lambda: state.over or state.search.elapsed_s >= until_s,
    )
    return state.submit(model.plan(table), time)
