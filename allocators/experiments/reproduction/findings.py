"""How claims are tested on the rows: the effect in words, and the verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from alloc.allocators.experiments.reproduction.protocol import OTHERS, PAPER_BATTERY, PAPER_METHODS, SCENARIOS, TESTS
from alloc.allocators.experiments.reproduction.rows import Learned, Solved
from alloc.allocators.experiments.reproduction.summary import (
    Effect,
    effect,
    final,
    of_scenario,
    runs_of,
)
from alloc.allocators.experiments.statistics import holm
from alloc.problems.generate.paper_scenarios import SCENARIOS as PAPER_SCENARIOS
from alloc.problems.text import counted

RIVALS = PAPER_METHODS[1:]

SIGNIFICANT = 0.05
OPTIMAL = 1 + 1e-4
"""Makespan that counts as the optimum, which is 1 h."""

ENERGY_PER_DISTANCE = 6.0
"""Of all instances, as `paper_like` makes them."""

ENOUGH = 8
"""Runs below which not even the same sign in all of them is significant against four rivals."""

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
    """Return an effect with its interval in words."""
    if one is None:
        return "no runs"
    if one.low is None or one.high is None:
        return f"{one.mean:{form}} ({counted(one.runs, 'run')})"
    return f"{one.mean:{form}} [{one.low:{form}}, {one.high:{form}}], {counted(one.runs, 'run')}"


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


def traditional(data: Data) -> Finding:
    """Compare with methods that learn nothing, by the median makespan in each scenario."""
    parts, worse = [], False
    for scenario in SCENARIOS:
        ours = [run[-1].makespan for run in runs_of(of_scenario(data.learned, scenario), "gappo")]
        rows = of_scenario(data.solved, scenario)
        theirs = {
            name: float(np.median(found))
            for name in OTHERS
            if (found := [row.makespan for row in rows if row.method == name and np.isfinite(row.makespan)])
        }
        if not ours or not theirs:
            continue
        best = min(theirs.values())
        worse |= float(np.median(ours)) > best + 1e-4
        parts.append(f"scenario {scenario}: {np.median(ours):.3f}, the best of the others {best:.3f}")
    return "; ".join(parts) or "no runs", (NOT if worse else HOLDS) if parts else UNKNOWN


def least_energy(data: Data) -> Finding:
    """Compare the battery left by plans, flown directly, with that of methods that learn nothing."""
    parts, less = [], False
    for scenario in SCENARIOS:
        runs = runs_of(of_scenario(data.learned, scenario), "gappo")
        known = [row for row in of_scenario(data.solved, scenario) if np.isfinite(row.battery)]
        means = [float(np.mean([row.battery for row in known if row.method == name])) for name in _methods(known)]
        if not runs or not means:
            continue
        per_distance = 100 * ENERGY_PER_DISTANCE / PAPER_SCENARIOS[scenario].battery
        ours = 100 - per_distance * float(np.mean([run[-1].distance for run in runs]))
        less |= ours < max(means) - 0.1
        parts.append(f"scenario {scenario}: {ours:.1f} %, the best of the others {max(means):.1f} %")
    return "; ".join(parts) or "no runs", (NOT if less else HOLDS) if parts else UNKNOWN


def _methods(rows: Sequence[Solved]) -> list[str]:
    return [name for name in OTHERS if any(row.method == name for row in rows)]


def optimal(data: Data) -> Finding:
    """Count the runs of `gappo` that end at the optimum."""
    parts, everywhere = [], True
    for scenario in SCENARIOS:
        runs = runs_of(of_scenario(data.learned, scenario), "gappo")
        hits = sum(run[-1].makespan <= OPTIMAL for run in runs)
        everywhere &= hits == len(runs) > 0
        parts.append(f"scenario {scenario}: {hits} of {len(runs)}")
    return "; ".join(parts), HOLDS if everywhere else NOT


def proven(data: Data) -> Finding:
    """Count the instances with a plan as long as the bound."""
    met = {(row.scenario, row.run) for row in data.solved if row.makespan <= OPTIMAL}
    total = {(row.scenario, row.run) for row in data.solved}
    text = (
        f"{len(met)} of {len(total)} instances have a plan of 1 h, which total load over total ability proves optimal"
    )
    return text, "the value holds; 20^100 allocations cannot be searched" if met and met == total else UNKNOWN


def scale(data: Data) -> Finding:
    """Compare the lead over the nearest rival in scenarios 2 to 4 with that in scenario 1."""
    leads: list[Effect] = []
    for scenario in SCENARIOS:
        rows = of_scenario(data.learned, scenario)
        found = [one for rival in RIVALS if (one := effect(rows, "gappo", rival, final("makespan"))) is not None]
        leads += [max(found, key=lambda one: one.mean)] if found else []
    text = (
        ", ".join(f"{lead.mean:+.3f}" for lead in leads) + " hours, `gappo` less the nearest rival, in scenarios 1 to 4"
    )
    if len(leads) < len(SCENARIOS) or min(lead.runs for lead in leads) < ENOUGH:
        return text if leads else "no runs", TOO_FEW
    grows = all(lead.mean < min(0.0, leads[0].mean) for lead in leads[1:])
    return text, HOLDS if grows else NOT


def battery(data: Data) -> Finding:
    """Compare the battery left after the episode with the paper's figures."""
    parts, alike = [], True
    for scenario in SCENARIOS:
        rows = of_scenario(data.learned, scenario)
        means = {
            name: float(np.mean([run[-1].battery for run in runs]))
            for name in PAPER_METHODS
            if (runs := runs_of(rows, name))
        }
        rivals = [means[name] for name in RIVALS if name in means]
        if "gappo" not in means or not rivals:
            continue
        low, high = PAPER_BATTERY["others"][scenario]
        alike &= max(rivals) <= high + 5 and means["gappo"] > max(rivals)
        parts.append(
            f"scenario {scenario}: {means['gappo']:.1f} %, others {min(rivals):.1f} to {max(rivals):.1f} % "
            f"(paper {PAPER_BATTERY['gappo'][scenario][0]:.1f}, others {low} to {high})"
        )
    return "; ".join(parts) or "no runs", (HOLDS if alike else NOT) if parts else UNKNOWN


def population(data: Data) -> Finding:
    """Compare three members with one."""
    one = effect(of_scenario(data.learned, TESTS), "gappo", "gappo-single", final("makespan"))
    if one is None or one.p is None or one.runs < ENOUGH:
        return told(one), TOO_FEW
    return told(one), HOLDS if one.mean < 0 and one.p < SIGNIFICANT else NOT


def sizes(data: Data) -> Finding:
    """Tell the worst makespan on instances far larger than those that were learned from."""
    rows = [run[-1] for k in SCENARIOS[1:] for run in runs_of(of_scenario(data.learned, k), "gappo")]
    if not rows:
        return "no runs", UNKNOWN
    worst = max(row.makespan for row in rows)
    served = sum(np.isfinite(row.makespan) for row in rows)
    text = f"trained with at most 50 agents; with 300 and 500 all tasks served in {served} of {len(rows)}, "
    text += f"T at worst {worst:.3f}"
    return text, HOLDS if worst < 1.1 else NOT


def unchecked(reason: str) -> Callable[[Data], Finding]:
    """Return the finding of a claim that nothing here can test."""
    return lambda data: (reason, UNKNOWN)
