"""The page of a reproduction, made from its rows alone."""

from collections.abc import Sequence

import numpy as np

from alloc.allocators.experiments.reproduction.claims import CLAIMS
from alloc.allocators.experiments.reproduction.findings import NOT, UNKNOWN, Data, table, tested
from alloc.allocators.experiments.reproduction.parts import ablations, population
from alloc.allocators.experiments.reproduction.prose import ASSUMED, ASSUMPTIONS, FIGURES, HEAD, PROCEDURE, SEEDS
from alloc.allocators.experiments.reproduction.protocol import (
    DECISIONS,
    LEARNING,
    OTHERS,
    PAPER_BATTERY,
    PAPER_METHODS,
    SCENARIOS,
    TESTS,
)
from alloc.allocators.experiments.reproduction.rows import Learned, Solved
from alloc.allocators.experiments.reproduction.summary import (
    effect,
    final,
    latest_length,
    of_scenario,
    reached,
    runs_of,
    solved_to_the_bound,
)
from alloc.allocators.experiments.statistics import holm, interval
from alloc.problems.text import counted


def page(learned: Sequence[Learned], solved: Sequence[Solved], environments: Sequence[dict[str, str]]) -> str:
    """Return the page in Markdown."""
    rows = latest_length(learned)
    data = Data(rows, solved)
    parts = [
        HEAD,
        _extent(rows, solved),
        "## Claims of the paper",
        _claims(data),
        "## Figures",
        FIGURES,
        _optimum(data),
        *(_figure(scenario) for scenario in SCENARIOS),
        "![Battery left](reproduction/figure-6.png)",
        "Bars are means over runs, lines their range; grey marks the values in the paper.",
        "## Results at equal numbers of decisions",
        *(part for length in _lengths(learned) for part in _budget(learned, length)),
        "## Ablation of GAPPO",
        ablations(rows),
        "## The four scenarios",
        _scenarios(rows),
        "Battery is what is left after the episode, in which every hop is flown. Battery and hops are means over runs.",
        "## Methods that do not learn, on the same instances",
        _others(solved),
        PROCEDURE,
        ASSUMPTIONS,
        table(["open in the paper", "our choice"], ASSUMED, left=2),
        SEEDS,
        "## Versions and machines",
        _environments(environments),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _lengths(rows: Sequence[Learned]) -> list[int]:
    """Return the lengths of runs in iterations, in decreasing order."""
    return sorted({row.iterations for row in rows}, reverse=True)


def _budget(learned: Sequence[Learned], length: int) -> tuple[str, ...]:
    """Return title, table and finding of all runs of a given number of iterations."""
    rows = [row for row in learned if row.iterations == length]
    return f"### {length} iterations, {DECISIONS * length:,} decisions", _tests(rows), population(rows)


def _extent(rows: Sequence[Learned], solved: Sequence[Solved]) -> str:
    """State the number of runs of each method, beside the paper's 100."""
    counts = {method: len(runs_of(of_scenario(rows, TESTS), method)) for method in LEARNING}
    named = ", ".join(f"`{method}` {count}" for method, count in counts.items() if count)
    others = len({row.run for row in solved})
    length = max(row.iterations for row in rows)
    fewest = min((count for count in counts.values() if count), default=0)
    short = (
        ""
        if fewest >= 100
        else f"**The paper reports more than 100 runs of each method; some methods have only {fewest} here.** "
    )
    tail = f"Methods that do not learn: {counted(others, 'run')}." if others else ""
    return f"{short}Runs of {length} iterations: {named}. {tail}".rstrip()


def _claims(data: Data) -> str:
    lines = []
    verdicts = []
    for claim in CLAIMS:
        found, verdict = claim.find(data)
        verdicts.append(verdict)
        lines.append([claim.where, f"“{claim.words}”", claim.test, found, f"**{verdict}**"])
    fail, unknown = (sum(one.startswith(kind) for one in verdicts) for kind in (NOT, UNKNOWN))
    held = len(verdicts) - fail - unknown
    total = f"Of {len(verdicts)} claims, {held} hold, {fail} do not hold, and {unknown} cannot be checked."
    return f"{total}\n\n" + table(["where", "the paper", "our test", "effect", "verdict"], lines, left=5)


def _figure(scenario: int) -> str:
    return f"![Makespan over iterations, scenario {scenario}](reproduction/figure-{scenario + 1}.png)"


def _optimum(data: Data) -> str:
    """State for how many instances the optimum is known."""
    met, total = solved_to_the_bound(data.learned, data.solved)
    if not total:
        return ""
    which = f"all {counted(total, 'instance')}" if met == total else f"{met} of {counted(total, 'instance')}"
    return f"For {which}, a plan is known whose makespan equals the lower bound, which proves it optimal."


def _mean(values: Sequence[float], form: str) -> str:
    """Return the mean of the finite values with its interval, and the number of values left out."""
    finite = np.array([value for value in values if np.isfinite(value)])
    left_out = f", {len(values) - len(finite)} left out" if len(finite) < len(values) else ""
    if not len(finite):
        return "-" + left_out
    low, high = interval(finite)
    between = "" if low is None or high is None else f" [{low:{form}}, {high:{form}}]"
    return f"{finite.mean():{form}}{between}{left_out}"


def _tests(rows: Sequence[Learned]) -> str:
    """Return the table of results on the test games, with differences from `ppo`."""
    own = of_scenario(rows, TESTS)
    present = [name for name in LEARNING if runs_of(own, name)]
    effects = {
        (name, figure): effect(own, name, "ppo", final(figure))
        for figure in ("makespan", "drawn")
        for name in present
        if name != "ppo"
    }
    known = [one for one in effects.values() if one is not None]
    corrected = iter(holm([one.p for one in known]))
    p_values = {key: next(corrected) for key, one in effects.items() if one is not None}

    def less(name: str, figure: str, form: str) -> str:
        if (name, figure) not in p_values:
            return ""
        return tested(effects[name, figure], p_values[name, figure], form)

    lines = []
    for name in present:
        runs = runs_of(own, name)
        steps = np.sort([reached(1.05)(run) for run in runs])
        middle = steps[(len(steps) - 1) // 2]
        lines.append(
            [
                f"`{name}`",
                str(len(runs)),
                _mean([run[-1].makespan for run in runs], ".3f"),
                less(name, "makespan", "+.3f"),
                _mean([run[-1].drawn for run in runs], ".4f"),
                less(name, "drawn", "+.4f"),
                f"{middle:.0f}" if np.isfinite(middle) else "-",
                _mean([run[-1].unserved for run in runs], ".2f"),
                f"{np.mean([run[-1].decisions for run in runs]):,.0f}",
            ]
        )
    header = ["method", "runs", "final T", "minus `ppo`", "best of 8 sampled", "minus `ppo`"]
    return table([*header, "iterations to T = 1.05", "unserved", "decisions"], lines)


def _scenarios(rows: Sequence[Learned]) -> str:
    lines = []
    for scenario in SCENARIOS:
        for name in LEARNING:
            runs = runs_of(of_scenario(rows, scenario), name)
            if not runs:
                continue
            last = [run[-1] for run in runs]
            stated = PAPER_BATTERY["gappo" if name == "gappo" else "others"][scenario] if name in PAPER_METHODS else ()
            lines.append(
                [
                    str(scenario),
                    f"`{name}`",
                    str(len(last)),
                    f"{np.median([row.makespan for row in last]):.3f}",
                    _mean([row.makespan for row in last], ".3f"),
                    _mean([row.battery for row in last], ".1f"),
                    " to ".join(f"{value}" for value in dict.fromkeys(stated)),
                    f"{np.mean([row.hops for row in last]):.2f}",
                    f"{np.mean([row.unserved for row in last]):.2f}",
                ]
            )
    header = ["scenario", "method", "runs", "median T", "mean T", "battery (%)", "in the paper", "hops", "unserved"]
    return table(header, lines, left=2)


def _others(solved: Sequence[Solved]) -> str:
    lines = []
    for scenario in SCENARIOS:
        for name in OTHERS:
            rows = [row for row in of_scenario(solved, scenario) if row.method == name]
            if rows:
                makespans = [row.makespan for row in rows]
                optimal = sum(row.makespan <= row.lower_bound * (1 + 1e-6) for row in rows)
                lines.append(
                    [
                        str(scenario),
                        f"`{name}`",
                        f"{np.median(makespans):.4f}",
                        f"{np.max(makespans):.4f}",
                        f"{optimal} of {len(rows)}",
                        f"{np.nanmean([row.battery for row in rows]):.1f}"
                        if any(row.battery > 0 for row in rows)
                        else "-",
                    ]
                )
    header = ["scenario", "method", "median T", "worst T", "proven optimal T", "battery of the plan (%)"]
    limits = sorted({row.time_limit_s for row in solved})
    limits_text = " and ".join(f"{limit:g} s" for limit in limits)
    if not lines:
        return "No runs."
    return f"Objective makespan-energy, {limits_text} and one thread each.\n\n{table(header, lines, left=2)}"


def _environments(environments: Sequence[dict[str, str]]) -> str:
    lines = [
        [entry["machine"], ", ".join(f"{k} {v}" for k, v in entry.items() if k != "machine")] for entry in environments
    ]
    return table(["machine", "versions"], lines, left=2) if lines else "Not recorded."
