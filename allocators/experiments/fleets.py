"""Fleets with their plans, and a one-sentence summary of how they compare."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from alloc.allocators.contract.tolerance import PROVEN
from alloc.allocators.result import Result
from alloc.problems.text import counted, number

MIN_DIGITS = 4
"""Minimum number of significant digits of a makespan; more are used to distinguish two."""

MAX_NAMES = 3
"""Maximum number of ids of agents that are listed; more are given as a number."""


@dataclass(frozen=True, eq=False)
class Fleet:
    """A fleet and its plan.

    Attributes
    ----------
    added, removed : tuple of str
        Ids of the agents that it has in addition to, and lacks compared with, the instance.
    result : Result
        Result on the instance with this fleet.
    """

    added: tuple[str, ...]
    removed: tuple[str, ...]
    result: Result


def answer(fleets: Sequence[Fleet], like: Sequence[str]) -> str:
    """Return the effect of the first and last change on the current fleet, and which additions offset a loss.

    Parameters
    ----------
    fleets : sequence of Fleet
        The first is the current fleet.
    like : sequence of str
        Agents that are copied, one of each per step.

    Returns
    -------
    str
        Such as ``one more like d2: 4.1 instead of 4.6 (-11 %)``.
    """
    now = fleets[0].result
    changed = [fleet for fleet in fleets[1:] if fleet.added]
    dropped = next((fleet for fleet in fleets[1:] if not fleet.added), None)
    parts = []
    if dropped is not None:
        parts.append(f"without {_listed(dropped.removed)}: {_change(dropped.result, now)}")
    for fleet in [*changed[:1], *changed[1:][-1:]]:
        steps = len(fleet.added) // len(like)
        parts.append(f"{_more(steps, like)}: {_change(fleet.result, now, short=bool(parts))}")
    if dropped is not None and _is_worse(dropped.result, now):
        enough = next((fleet for fleet in changed if not _is_worse(fleet.result, now)), None)
        if enough is not None:
            steps = len(enough.added) // len(like)
            parts.append(f"{_more(steps, like)} {'makes' if steps == 1 else 'make'} up for it")
    return "; ".join(parts) if parts else "interrupted before a fleet was changed"


def _more(steps: int, like: Sequence[str]) -> str:
    return f"{'one' if steps == 1 else steps} more like {'' if len(like) == 1 else 'each of '}{_listed(like)}"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= MAX_NAMES else f"{len(names)} agents"


def _is_worse(result: Result, now: Result) -> bool:
    """Return whether a plan serves fewer tasks than that of the current fleet, or has a longer makespan."""
    unserved, before = result.unserved_count, now.unserved_count
    if unserved != before or result.makespan is None or now.makespan is None:
        return unserved > before
    return result.makespan > now.makespan * (1 + PROVEN)


def _change(result: Result, now: Result, *, short: bool = False) -> str:
    """Return the makespan of a fleet compared with the current fleet's, or the number of unserved tasks."""
    unserved, before = result.unserved_count, now.unserved_count
    if result.evaluation is None:
        return "no plan was found"
    if result.makespan is None:
        return f"{counted(unserved, 'task')} unserved {f'instead of {before}' if before != unserved else 'as before'}"
    then = _time(result)
    if now.makespan is None:
        return f"every task is served, in {then}"
    share = result.makespan / now.makespan - 1 if now.makespan else 0.0
    if abs(share) <= PROVEN:
        is_proven = (result.lower_bound or 0.0) >= now.makespan * (1 - PROVEN)
        limits = _range(result, now)
        return f"{then} as before{' (proven)' if is_proven else f' ({limits})' if limits else ''}"
    digits = max(MIN_DIGITS, math.ceil(-math.log10(abs(share))) + 1)
    instead = "" if short else f" instead of {_time(now, digits)}"
    changes = "; ".join(filter(None, [f"{_percent(share)} %", _range(result, now)]))
    return f"{_time(result, digits)}{instead} ({changes})"


def _range(result: Result, now: Result) -> str:
    """Return the range of possible changes of the optimum, unless the change found is proven."""
    gaps = (result.gap, now.gap)
    if None in gaps or max(gap or 0.0 for gap in gaps) <= PROVEN or not now.lower_bound or not now.makespan:
        return ""
    least = (result.lower_bound or 0.0) / now.makespan - 1
    most = (result.makespan or 0.0) / now.lower_bound - 1
    old, new = set(now.instance.agent_ids), set(result.instance.agent_ids)
    if old < new:
        most = min(most, 0.0)  # more agents never increase the optimum
    if new < old:
        least = max(least, 0.0)
    return f"the optimum: {_percent(least)} to {_percent(most)} %"


def _percent(share: float) -> str:
    if abs(share) < PROVEN:
        return "0"
    return f"{100 * share:+.0f}" if abs(share) >= 0.1 else f"{100 * share:+.2g}"


def _time(result: Result, digits: int = MIN_DIGITS) -> str:
    return f"{number(result.makespan, digits)} {result.instance.units.time}".rstrip()
