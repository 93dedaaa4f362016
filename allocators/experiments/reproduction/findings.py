"""Tests of the paper's claims on the rows: the effect in words, and the verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from alloc.allocators.experiments.reproduction.protocol import OTHERS, PAPER_BATTERY, PAPER_METHODS, SCENARIOS, TESTS
from alloc.allocators.experiments.reproduction.rows import Learned, Solved
from alloc.allocators.experiments.reproduction.summary import (
    OPTIMAL,
    Effect,
    Runs,
    effect,
    final,
    is_optimal,
    of_scenario,
    runs_of,
    solved_to_the_bound,
)
from alloc.allocators.experiments.statistics import holm
from alloc.problems.generate.paper_scenarios import SCENARIOS as PAPER_SCENARIOS
from alloc.problems.text import counted

RIVALS = PAPER_METHODS[1:]

SIGNIFICANT = 0.05
ENERGY_PER_DISTANCE = 6.0
"""That of all instances made by `paper_like`."""

ENOUGH = 8
"""Fewest runs with which a difference can be significant against four rivals."""

HOLDS, NOT, UNKNOWN = "holds", "does not hold", "cannot be checked"
TOO_FEW = f"{UNKNOWN}: too few runs"


@dataclass(frozen=True)
class Data:
    """All rows of the page."""

    learned: Sequence[Learned]
    solved: Sequence[Solved]


Finding = tuple[str, str]
"""Effect in words and verdict."""


def told(one: Effect | None, form: str = "+.3f") -> str:
    """Return an effect with its interval in words, and the number of runs left out."""
    if one is None:
        return "no runs"
    left_out = f", {one.left_out} left out" if one.left_out else ""
    if not one.runs:
        return "no runs" + left_out
    if one.low is None or one.high is None:
        return f"{one.mean:{form}} ({counted(one.runs, 'run')}{left_out})"
    return f"{one.mean:{form}} [{one.low:{form}}, {one.high:{form}}], {counted(one.runs, 'run')}{left_out}"


def tested(one: Effect | None, p: float | None, form: str) -> str:
    """Return an effect in words, with its corrected p-value where there is one."""
    return told(one, form) + ("" if p is None else f", p = {p:.2g}")


def table(header: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    """Return a table in Markdown, whose first `left` columns are text and all others numbers."""
    rule = ["---"] * left + ["--:"] * (len(header) - left)
    return "\n".join("| " + " | ".join(line) + " |" for line in (header, rule, *rows))


def against_all(data: Data, scenario: int, figure: Callable[[list[Learned]], float], sign: int, form: str) -> Finding:
    """Test that `gappo` is better than each rival: `sign` times the difference above 0, corrected by Holm."""
    rows = of_scenario(data.learned, scenario)
    found = {rival: one for rival in RIVALS if (one := effect(rows, "gappo", rival, figure)) is not None}
    corrected = dict(zip(found, holm([one.p for one in found.values()]), strict=True))
    ahead = [
        rival
        for rival, one in found.items()
        if sign * one.mean > 0 and (p := corrected[rival]) is not None and p < SIGNIFICANT
    ]
    level = [rival for rival, one in found.items() if rival not in ahead and one.runs >= ENOUGH]
    if level:
        return _listed(found, form), f"{NOT}: not ahead of {', '.join(level)}"
    return _listed(found, form), HOLDS if len(ahead) == len(RIVALS) else TOO_FEW


def _listed(known: dict[str, Effect], form: str) -> str:
    return "; ".join(f"{rival} {told(one, form)}" for rival, one in known.items()) or "no runs"


def described(compared: Sequence[tuple[int, bool]]) -> str:
    """Return the verdict of a claim that is decided by means or medians, without a test.

    Parameters
    ----------
    compared : sequence of (int, bool)
        For each comparison, the smaller number of runs of the two sides, and whether the result is as claimed.
    """
    if any(runs >= ENOUGH and not as_claimed for runs, as_claimed in compared):
        return NOT
    return HOLDS if compared and all(runs >= ENOUGH for runs, _ in compared) else TOO_FEW


def traditional(data: Data) -> Finding:
    """Compare with methods that do not learn, by the median makespan in each scenario."""
    parts, compared = [], []
    for scenario in SCENARIOS:
        ours = [run[-1].makespan for run in runs_of(of_scenario(data.learned, scenario), "gappo")]
        rows = of_scenario(data.solved, scenario)
        found = {name: [_infinite_without(row.makespan) for row in rows if row.method == name] for name in OTHERS}
        theirs = {name: float(np.median(values)) for name, values in found.items() if values}
        compared += [
            (
                min(len(ours), len(found[name])),
                not (ours and name in theirs) or float(np.median(ours)) <= theirs[name] + 1e-4,
            )
            for name in OTHERS
        ]
        if ours and theirs:
            best = min(theirs.values())
            parts.append(f"scenario {scenario}: {np.median(ours):.3f}, best of the others {best:.3f}")
    return "; ".join(parts) or "no runs", described(compared)


def _infinite_without(makespan: float) -> float:
    """Return a makespan, infinite where a method found no plan, as for a policy that leaves a task unserved."""
    return float("inf") if np.isnan(makespan) else makespan


def least_energy(data: Data) -> Finding:
    """Compare the battery left by plans, flown directly, with that of methods that do not learn.

    Plans that leave a task unserved are left out on both sides, as agents that stay save energy.
    """
    parts, compared = [], []
    for scenario in SCENARIOS:
        runs = runs_of(of_scenario(data.learned, scenario), "gappo")
        distances = [run[-1].distance for run in runs if np.isfinite(run[-1].makespan)]
        rows = [row for row in of_scenario(data.solved, scenario) if np.isfinite(row.makespan + row.battery)]
        found = {name: [row.battery for row in rows if row.method == name] for name in OTHERS}
        means = {name: float(np.mean(values)) for name, values in found.items() if values}
        per_distance = 100 * ENERGY_PER_DISTANCE / PAPER_SCENARIOS[scenario].battery
        ours = 100 - per_distance * float(np.mean(distances)) if distances else float("inf")
        compared += [
            (min(len(distances), len(found[name])), name not in means or ours >= means[name] - 0.1) for name in OTHERS
        ]
        if distances and means:
            parts.append(f"scenario {scenario}: {ours:.1f} %, best of the others {max(means.values()):.1f} %")
    return "; ".join(parts) or "no runs", described(compared)


def optimal(data: Data) -> Finding:
    """Count the runs of `gappo` that end at the optimum; one that does not refutes "consistently"."""
    ended = [runs_of(of_scenario(data.learned, scenario), "gappo") for scenario in SCENARIOS]
    hits = [sum(is_optimal(run[-1]) for run in runs) for runs in ended]
    text = "; ".join(
        f"scenario {scenario}: {hit} of {len(runs)}" for scenario, hit, runs in zip(SCENARIOS, hits, ended, strict=True)
    )
    return text, every(sum(map(len, ended)) - sum(hits), ended)


def every(exceptions: int, ended: Sequence[Runs]) -> str:
    """Return the verdict of a claim on every run: one exception refutes it; otherwise enough runs must be there."""
    if exceptions:
        return NOT
    return HOLDS if min(map(len, ended)) >= ENOUGH else TOO_FEW


def proven(data: Data) -> Finding:
    """Count the instances with a plan whose makespan equals the bound."""
    met, total = solved_to_the_bound(data.learned, data.solved)
    if not total:
        return "no runs", UNKNOWN
    rows: list[Learned | Solved] = [*data.learned, *data.solved]
    bounds = [row.lower_bound for row in rows if row.scenario != TESTS]
    low, high = min(bounds), max(bounds)
    text = f"{met} of {total} instances have a plan whose makespan equals the proven bound, "
    text += f"{low:g} h" if low == high else f"{low:g} to {high:g} h"
    is_an_hour = met == total and max(abs(low - 1), abs(high - 1)) < OPTIMAL - 1
    return text, "the value holds; 20^100 allocations cannot be enumerated" if is_an_hour else UNKNOWN


def scale(data: Data) -> Finding:
    """Compare the lead over the best rival in scenarios 2 to 4 with that in scenario 1."""
    leads: list[Effect] = []
    for scenario in SCENARIOS:
        rows = of_scenario(data.learned, scenario)
        every_rival = [effect(rows, "gappo", rival, final("makespan")) for rival in RIVALS]
        found = [one for one in every_rival if one is not None and one.runs]
        leads += [max(found, key=lambda one: one.mean)] if found else []
    text = (
        ", ".join(f"{lead.mean:+.3f}" for lead in leads) + " hours, `gappo` minus the best rival, in scenarios 1 to 4"
    )
    if len(leads) < len(SCENARIOS) or min(lead.runs for lead in leads) < ENOUGH:
        return text if leads else "no runs", TOO_FEW
    grows = all(lead.mean < min(0.0, leads[0].mean) for lead in leads[1:])
    return text, HOLDS if grows else NOT


def battery(data: Data) -> Finding:
    """Compare the battery left after the episode with the paper's figures."""
    parts, compared = [], []
    for scenario in SCENARIOS:
        rows = of_scenario(data.learned, scenario)
        left = {name: [run[-1].battery for run in runs_of(rows, name)] for name in PAPER_METHODS}
        means = {name: float(np.mean(values)) for name, values in left.items() if values}
        rivals = [means[name] for name in RIVALS if name in means]
        low, high = PAPER_BATTERY["others"][scenario]
        compared += [
            (min(len(left["gappo"]), len(left[name])), means["gappo"] > means[name] <= high + 5)
            if "gappo" in means and name in means
            else (0, True)
            for name in RIVALS
        ]
        if "gappo" in means and rivals:
            parts.append(
                f"scenario {scenario}: {means['gappo']:.1f} %, others {min(rivals):.1f} to {max(rivals):.1f} % "
                f"(paper {PAPER_BATTERY['gappo'][scenario][0]:.1f}, others {low} to {high})"
            )
    return "; ".join(parts) or "no runs", described(compared)


def population(data: Data) -> Finding:
    """Compare three members with one."""
    one = effect(of_scenario(data.learned, TESTS), "gappo", "gappo-single", final("makespan"))
    if one is None or one.p is None or one.runs < ENOUGH:
        return told(one), TOO_FEW
    return told(one), HOLDS if one.mean < 0 and one.p < SIGNIFICANT else NOT


def sizes(data: Data) -> Finding:
    """Return the worst makespan on instances far larger than those of training."""
    ended = [runs_of(of_scenario(data.learned, scenario), "gappo") for scenario in SCENARIOS[1:]]
    makespans = [run[-1].makespan for runs in ended for run in runs]
    if not makespans:
        return "no runs", TOO_FEW
    served = sum(np.isfinite(makespans))
    text = f"trained with at most 50 agents; with 300 and 500, all tasks served in {served} of {len(makespans)} runs, "
    text += f"worst T {max(makespans):.3f}"
    return text, every(sum(makespan >= 1.1 for makespan in makespans), ended)


def unchecked(reason: str) -> Callable[[Data], Finding]:
    """Return the finding of a claim that cannot be tested here."""
    return lambda data: (reason, UNKNOWN)
