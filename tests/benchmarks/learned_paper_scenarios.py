r"""How good learned methods are on the paper's scenarios, on instances that no policy was trained or tuned on.

    python tests/benchmarks/learned_paper_scenarios.py --methods gappo --threads 2 --publish
    python tests/benchmarks/learned_paper_scenarios.py --methods gappo-ls,local-search --time-limits 0.1 1 --seeds 25 \
        --threads 1 --jobs 2 --publish --section hybrid
    python tests/benchmarks/learned_paper_scenarios.py --methods ppo,a2c,dqn,ddpg --scenarios 1 --time-limits 2 \
        --seeds 25 --threads 1 --jobs 2 --publish --section rivals

The objective is the least energy at the least makespan. Energies are compared with the least known at T = 1: those in
`local_search_best_known.json`, for seeds 0 to 99, and those that the runs themselves meet. A plan with T > 1 may take
less energy than any with T = 1, so that the mean ratio is given over all instances, and over those alone where the
method reached T = 1. The second table sets one method beside another on the same instances and limits: who has less
energy where both have the same T (sign test; interval of the mean ratio from Student's t on its logarithm), and who is
faster where T differs.
"""

import argparse
import json
import math
from pathlib import Path

import numpy as np
from learned_runs import EQUAL, Row, add_options, better, crossed, known, publish, run, table

BEST_KNOWN = Path(__file__).with_name("local_search_best_known.json")
HEAD = "scenario | method | limit s: | T mean: | T worst: | T = 1: | energy / best: | where T = 1: | unserved: |"
HEAD += " first T: | s: |"
PAIRED = "scenario | limit s: | same T: | less energy: | equal: | more: | p: | energy ratio (95 %): | faster: | slower:"


def figures(rows: list[Row], best: list[float]) -> list[str]:
    """Return the columns of a method in a scenario."""
    answered = [row for row in rows if not row.why]
    if not answered:
        return ["-"] * 8 + [rows[0].why]
    makespan = np.array([row.served for row in answered])
    ratio = np.array([row.energy / best[row.task.seed] for row in answered])
    at_one = makespan <= 1 + EQUAL
    remark = "" if len(answered) == len(rows) else f"{len(rows) - len(answered)} without: {_why(rows)}"
    late = sum(row.late for row in answered)
    return [
        f"{makespan.mean():.4f}",
        f"{makespan.max():.4f}",
        f"{at_one.sum()} of {len(rows)}",
        f"{np.nanmean(ratio):.3f}",
        f"{np.nanmean(ratio[at_one]):.3f}" if at_one.any() else "-",
        str(sum(row.unserved for row in answered)),
        f"{np.mean([row.first_makespan for row in answered]):.4f}",
        f"{np.mean([row.seconds for row in answered]):.2f}",
        "; ".join(filter(None, [remark, f"{late} late" if late else ""])),
    ]


def _why(rows: list[Row]) -> str:
    return next(row.why for row in rows if row.why)


def compared(pairs: list[tuple[Row, Row]]) -> list[str]:
    """Return how the first of each pair fares against the second."""
    from scipy.stats import binomtest, t

    pairs = [(one, other) for one, other in pairs if not one.why and not other.why]
    times = [((one.unserved, one.served), (other.unserved, other.served)) for one, other in pairs]
    faster, slower = sum(better(a, b) for a, b in times), sum(better(b, a) for a, b in times)
    same = [pair for pair, (a, b) in zip(pairs, times, strict=True) if not better(a, b) and not better(b, a)]
    less = sum(better((one.energy,), (other.energy,)) for one, other in same)
    more = sum(better((other.energy,), (one.energy,)) for one, other in same)
    chance = f"{binomtest(less, less + more).pvalue:.2g}" if less + more else "-"
    logs = np.log([one.energy / other.energy for one, other in same if one.energy > 0 and other.energy > 0])
    ratio = f"{math.exp(logs.mean()):.4f}" if len(logs) else "-"
    if len(logs) > 1:
        half = t.ppf(0.975, len(logs) - 1) * logs.std(ddof=1) / math.sqrt(len(logs))
        ratio += f" ({math.exp(logs.mean() - half):.4f}-{math.exp(logs.mean() + half):.4f})"
    counts = [len(same), less, len(same) - less - more, more]
    return [*map(str, counts), chance, ratio, str(faster), str(slower)]


def best_known(rows: list[Row]) -> dict[str, list[float]]:
    """Return the least energy known at T = 1, by scenario and seed."""
    best: dict[str, list[float]] = json.loads(BEST_KNOWN.read_text())
    for row in rows:
        scenario, seed = best[row.task.family[-1]], row.task.seed
        scenario += [math.nan] * (seed + 1 - len(scenario))
        if not row.why and row.makespan <= 1 + EQUAL:
            scenario[seed] = float(np.fmin(scenario[seed], row.energy))
    return best


def tables(rows: list[Row], options: argparse.Namespace) -> str:
    """Return both tables."""
    best = best_known(rows)
    groups: dict[tuple[str, str, float], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.task.family, row.task.method, row.task.time_limit), []).append(row)
    lines = [
        [family[-1], method, f"{limit:g}", *figures(group, best[family[-1]])]
        for (family, method, limit), group in sorted(groups.items(), key=lambda item: (item[0][0], item[0][2]))
    ]
    parts = [table(HEAD, lines)]
    one, other = options.compare.split(",")
    pairs = [
        [family[-1], f"{limit:g}", *compared(list(zip(group, groups[family, other, limit], strict=True)))]
        for (family, method, limit), group in sorted(groups.items())
        if method == one and (family, other, limit) in groups
    ]
    if pairs:
        parts.append(f"`{one}` against `{other}`, on the same instances:\n\n{table(PAIRED, pairs)}")
    return "\n\n".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, methods="gappo,gappo-ls,local-search,ppo,a2c,dqn,ddpg", seeds=100, threads=2)
    parser.add_argument("--scenarios", type=int, nargs="+", default=[1, 2, 3, 4], choices=[1, 2, 3, 4])
    parser.add_argument("--time-limits", type=float, nargs="+", default=[1.0], help="seconds")
    parser.add_argument("--compare", default="gappo-ls,local-search", help="two methods, one against the other")
    parser.add_argument("--section", default="", help="of the page, to publish in")
    options = parser.parse_args()
    families = [f"paper-{number}" for number in options.scenarios]
    tasks = crossed(
        ["makespan-energy"], families, options.seeds, options.time_limits, options.threads, known(options.methods)
    )
    rows = run(tasks, jobs=options.jobs, kept=options.runs, again=options.again.split(","))
    text = tables(rows, options)
    print(text)
    if options.publish:
        note = f"{options.seeds} instances per scenario, threads: {options.threads}, runs at a time: {options.jobs}."
        publish(" ".join(["learned_paper_scenarios.py", *options.section.split()]), f"{note}\n\n{text}")


if __name__ == "__main__":
    main()
