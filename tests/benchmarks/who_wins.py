"""Who wins where: all kinds of methods at equal time, for both objectives, as a table and a drawing.

    python tests/benchmarks/who_wins.py --seeds 10 --jobs 2 --runs docs/benchmarks/who_wins.csv --publish
    python tests/benchmarks/who_wins.py --again gappo,gappo-ls --jobs 2 --runs docs/benchmarks/who_wins.csv --publish

The second makes the runs of two methods anew and takes those of the others from the file. `exact` is `cpsat` for the
makespan and `milp` with energy. Energy ratios are to the least energy met at the least T on that instance (or 0.01 %
more, as real-valued abilities give each plan a T of its own): by any run here, and in the paper's scenarios by what
`local_search_best_known.json` has as well; a slower plan can be below 1. A
method is first on an instance if none that kept to the limit has a better answer: fewer tasks unserved, then less T,
then less energy; several can be. Late runs (20 % and 20 ms beyond the limit) are marked and never first.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from learned_families import ALL, PAPER
from learned_paper_scenarios import best_known
from learned_runs import EQUAL, PAGE, Row, Task, add_options, better, crossed, known, publish, run, table
from who_wins_plot import draw

METHODS = "greedy,local-search,ga,hedonic,auction,lp-round,exact,gappo,gappo-ls,ppo,a2c,dqn,ddpg"
EXACT = {"makespan": "cpsat", "makespan-energy": "milp"}
UNSEEN = "clustered;lognormal;ranges, plane;speeds 2-8"
LIMITS = (0.03, 0.3, 3.0)
RIVALS = ("ga", "hedonic")
ALIKE = 1e-4
"""Relative difference of makespans up to which energies are compared."""

Cells = dict[tuple[str, str, str, float], list[Row]]
"""Runs by objective, family, method and limit."""


def cells(rows: Iterable[Row]) -> Cells:
    """Sort rows into cells, the exact methods under that name."""
    found: Cells = {}
    for row in rows:
        task = row.task
        name = "exact" if task.method == EXACT[task.objective] else task.method
        found.setdefault((task.objective, task.family, name, task.time_limit), []).append(row)
    return found


def references(rows: list[Row]) -> dict[tuple[str, int], tuple[float, float]]:
    """Return the least makespan met on each instance, and the least energy at it."""
    met: dict[tuple[str, int], list[Row]] = {}
    for row in rows:
        if not row.why:
            met.setdefault((row.task.family, row.task.seed), []).append(row)
    kept = best_known([row for row in rows if row.task.family in PAPER])
    best = {}
    for (family, seed), found in met.items():
        makespan = min(row.makespan for row in found)
        energy = min(row.energy for row in found if row.makespan <= makespan * (1 + ALIKE))
        if family in PAPER and seed < len(kept[family[-1]]) and abs(makespan - 1) <= EQUAL:
            energy = float(np.fmin(energy, kept[family[-1]][seed]))
        best[family, seed] = makespan, energy
    return best


def firsts(found: Cells, objective: str, family: str, limit: float) -> dict[str, int]:
    """Return how often each method is first."""
    rivals = {key[2]: rows for key, rows in found.items() if (key[0], key[1], key[3]) == (objective, family, limit)}
    counts = dict.fromkeys(rivals, 0)
    for of_seed in zip(*rivals.values(), strict=True):
        for name, row in zip(rivals, of_seed, strict=True):
            fair = not row.why and not row.late
            counts[name] += fair and not any(better(other.score, row.score) for other in of_seed if not other.late)
    return counts


def cell(rows: list[Row], wins: int, energies: list[float] | None) -> list[str]:
    """Return mean T, mean energy ratio where it counts, and how often the method was first; or why there is nothing."""
    answered = [row for row in rows if not row.why]
    if not answered:
        return [rows[0].why.partition(":")[0], *[""] * (1 if energies is None else 2)]
    late = sum(row.late for row in answered)
    mark = "*" if len(answered) < len(rows) or any(row.unserved for row in answered) else ""
    mark += f" ({np.mean([row.seconds for row in answered]):.2g} s)" if late else ""
    columns = [f"{np.mean([row.served for row in answered]):.4f}{mark}"]
    if energies is not None:
        ratio = [row.energy / least for row, least in zip(rows, energies, strict=True) if not row.why]
        columns.append(f"{np.mean(ratio):.3f}")
    return [*columns, f"{wins}" if wins else "-"]


def family_tables(found: Cells, least: dict[tuple[str, int], tuple[float, float]], limits: list[float]) -> str:
    """Return a table per objective and family."""
    parts = []
    for objective, family in dict.fromkeys(key[:2] for key in found):
        energy = objective == "makespan-energy"
        head = " | ".join(f"T, {_named(limit)}: | " + ("energy: | " if energy else "") + "first:" for limit in limits)
        methods = list(dict.fromkeys(key[2] for key in found if key[:2] == (objective, family)))
        lines = []
        for method in methods:
            line = [f"`{method}`"]
            for limit in limits:
                rows = found[objective, family, method, limit]
                energies = [least[row.task.family, row.task.seed][1] for row in rows] if energy else None
                line += cell(rows, firsts(found, objective, family, limit)[method], energies)
            lines.append(line)
        parts.append(f"**{family}, {objective}**\n\n{table('method | ' + head, lines)}")
    return "\n\n".join(parts)


def summary(found: Cells, limits: list[float]) -> str:
    """Return a table of who is first most often, and on how many instances."""
    lines = []
    for objective, family in dict.fromkeys(key[:2] for key in found):
        line = [family, objective]
        for limit in limits:
            counts = firsts(found, objective, family, limit)
            most = max(counts.values())
            winners = [f"`{name}`" for name, count in counts.items() if count == most]
            line.append(f"{', '.join(winners)}: {most}" if most else "-")
        lines.append(line)
    return table("family | objective | " + " | ".join(_named(limit) for limit in limits), lines)


def _named(limit: float) -> str:
    return f"{1000 * limit:g} ms" if limit < 1 else f"{limit:g} s"


def behind(found: Cells, limits: list[float], method: str = "gappo") -> str:
    """Return where `method` is behind ga or hedonic: on how many instances in T, or in energy where T is the same."""
    lines = []
    for objective, family in dict.fromkeys(key[:2] for key in found):
        line = []
        for limit in limits:
            told = []
            for rival in RIVALS:
                mine, theirs = (found.get((objective, family, name, limit), []) for name in (method, rival))
                pairs = [pair for pair in zip(mine, theirs, strict=False) if not (pair[1].why or pair[1].late)]
                told += _against(rival, pairs)
            line.append("; ".join(told))
        if any(line):
            lines.append([family, objective, *line])
    if not any(key[2] == method for key in found):
        return ""
    if not lines:
        return f"`{method}` is nowhere behind {' or '.join(RIVALS)}."
    head = "family | objective | " + " | ".join(_named(limit) for limit in limits)
    return f"Where `{method}` is behind `{'` or `'.join(RIVALS)}`, and on how many instances:\n\n{table(head, lines)}"


def _against(rival: str, pairs: list[tuple[Row, Row]]) -> list[str]:
    """Return in words where the second of each pair is ahead of the first."""
    silent = sum(bool(mine.why) for mine, _ in pairs)
    both = [(mine, theirs) for mine, theirs in pairs if not mine.why]
    slower = [(mine, theirs) for mine, theirs in both if better(theirs.score[:2], mine.score[:2])]
    same = [pair for pair in both if pair not in slower and not better(pair[0].score[:2], pair[1].score[:2])]
    dearer = sum(better(theirs.score[2:], mine.score[2:]) for mine, theirs in same)
    told = [f"no answer {silent}"] if silent else []
    if slower:
        gap = np.mean([mine.served / theirs.served - 1 for mine, theirs in slower])
        told.append(f"slower {len(slower)} ({gap:+.2%})")
    told += [f"same T, more energy {dearer}"] if dearer else []
    return [f"`{rival}`: {', '.join(told)}"] if told else []


def tasks_of(options: argparse.Namespace) -> list[Task]:
    """Return all runs; the exact method is another for each objective."""
    families = [*PAPER, *filter(None, options.families.split(";"))]
    assert set(families) <= set(ALL), f"families are {', '.join(ALL)}"
    tasks = []
    for objective in options.objectives.split(","):
        chosen = [EXACT[objective] if name == "exact" else name for name in options.methods.split(",")]
        methods = known(",".join(dict.fromkeys(chosen)))
        tasks += crossed([objective], families, options.seeds, options.time_limits, options.threads, methods)
    return tasks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, methods=METHODS, seeds=5)
    parser.add_argument("--objectives", default="makespan,makespan-energy")
    parser.add_argument("--families", default=UNSEEN, help="beside the paper's scenarios, split by semicolons")
    parser.add_argument("--time-limits", type=float, nargs="+", default=list(LIMITS), help="seconds")
    parser.add_argument("--plot", type=Path, help=f"where to draw; {PAGE.with_name('who_wins.png').name} if published")
    options = parser.parse_args()
    again = [name for each in options.again.split(",") for name in ([each] if each != "exact" else EXACT.values())]
    rows = run(tasks_of(options), jobs=options.jobs, kept=options.runs, again=again)
    found, least = cells(rows), references(rows)
    limits = options.time_limits
    parts = (summary(found, limits), behind(found, limits), family_tables(found, least, limits))
    text = "First on most instances, and on how many:\n\n" + "\n\n".join(filter(None, parts))
    print(text)
    plot = options.plot or (PAGE.with_name("who_wins.png") if options.publish else None)
    if plot is not None:
        draw(found, least, plot)
    if options.publish:
        note = f"{options.seeds} instances each, threads: {options.threads}, runs at a time: {options.jobs}."
        publish("who_wins.py", f"![Who wins where](who_wins.png)\n\n{note}\n\n{text}")


if __name__ == "__main__":
    main()
