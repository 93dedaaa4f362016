"""Statistics of rows: runs of a method, paired differences, and when a makespan was reached."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from alloc.allocators.experiments.reproduction.protocol import TESTS
from alloc.allocators.experiments.reproduction.rows import Learned, Solved
from alloc.allocators.experiments.statistics import interval, signed_rank

Row = TypeVar("Row", Learned, Solved)

OPTIMAL = 1 + 1e-4
"""Ratio of makespan to proven bound up to which a plan counts as optimal."""

Runs = list[list[Learned]]
"""Rows of each run, in the order of their iterations."""


@dataclass(frozen=True)
class Effect:
    """Mean of the paired differences of two methods over runs, its BCa interval and Wilcoxon's p.

    Attributes
    ----------
    runs : int
    mean : float
        nan without a run.
    low, high, p : float or None
        None for fewer than three runs.
    left_out : int
        Further runs, in which the figure is not finite for one of the two.
    """

    runs: int
    mean: float
    low: float | None
    high: float | None
    p: float | None
    left_out: int = 0


def is_optimal(row: Learned | Solved) -> bool:
    """Return whether the makespan equals the proven bound."""
    return row.makespan <= row.lower_bound * OPTIMAL


def solved_to_the_bound(learned: Sequence[Learned], solved: Sequence[Solved]) -> tuple[int, int]:
    """Return the number of instances with a plan whose makespan equals the proven bound, and the number of all."""
    rows: list[Learned | Solved] = [*learned, *solved]
    rows = [row for row in rows if row.scenario != TESTS]
    met = {(row.scenario, row.run) for row in rows if is_optimal(row)}
    return len(met), len({(row.scenario, row.run) for row in rows})


def of_scenario(rows: Sequence[Row], scenario: int) -> list[Row]:
    """Return the rows of a scenario."""
    return [row for row in rows if row.scenario == scenario]


def latest_length(rows: Sequence[Learned]) -> list[Learned]:
    """Return the rows of the longest runs only, as shorter ones have other step-size schedules."""
    longest = max((row.iterations for row in rows), default=0)
    return [row for row in rows if row.iterations == longest]


def runs_of(rows: Sequence[Learned], method: str) -> Runs:
    """Return the rows of each run of a method, in order."""
    found: dict[int, list[Learned]] = {}
    for row in sorted(rows, key=lambda row: (row.run, row.iteration)):
        if row.method == method:
            found.setdefault(row.run, []).append(row)
    return list(found.values())


def effect(rows: Sequence[Learned], method: str, other: str, figure: Callable[[list[Learned]], float]) -> Effect | None:
    """Return the paired difference of a figure between two methods; None without a common run.

    Runs in which the figure is not finite for either method are left out and counted.
    """
    ours, theirs = ({run[0].run: figure(run) for run in runs_of(rows, name)} for name in (method, other))
    pairs = [(ours[run], theirs[run]) for run in sorted(ours.keys() & theirs.keys())]
    values = np.array([one - two for one, two in pairs if np.isfinite(one) and np.isfinite(two)])
    values[np.abs(values) < 1e-9] = 0.0
    if not pairs:
        return None
    mean = float(values.mean()) if len(values) else float("nan")
    return Effect(len(values), mean, *interval(values), signed_rank(values), len(pairs) - len(values))


def final(name: str) -> Callable[[list[Learned]], float]:
    """Return a function that gives a figure at the end of a run."""
    return lambda run: float(getattr(run[-1], name))


def reached(makespan: float) -> Callable[[list[Learned]], float]:
    """Return the function that gives the first iteration at which a run was judged to be at a makespan, or inf."""
    return lambda run: float(next((row.iteration for row in run if row.makespan <= makespan), np.inf))


def fluctuation(run: list[Learned]) -> float:
    """Return the mean rise of the makespan from a point to the next in the second half of a run, 0 where it falls."""
    late = [row.makespan for row in run if row.iteration >= run[-1].iteration / 2]
    return float(np.mean(np.maximum(0.0, np.diff(late)))) if len(late) > 1 else 0.0
