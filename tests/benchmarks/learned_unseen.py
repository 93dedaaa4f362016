"""How far learned methods are from the optimum on kinds of instances that no policy was trained on.

    python tests/benchmarks/learned_unseen.py --methods gappo,gappo-ls --jobs 2 --publish
    python tests/benchmarks/learned_unseen.py --references --families "speeds 2-8" --exact-time 60

The second command finds references instead: per instance the best bound that `cpsat` proves in --exact-time, and the
best T that it or `local-search` finds, kept in `learned_unseen_references.json`; those that are proven, or within 1e-5,
come in a moment. Beyond the bound is T / bound - 1, beyond the best known is T / best - 1; where bound and best known
differ, the optimum lies between. Exits with 1 if `gappo` is more than 2 % beyond the bound in the mean of a family, or
fails. A refusal counts as a failure.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from learned_families import LARGE, UNSEEN
from learned_runs import EQUAL, Row, add_options, crossed, known, publish, run, table

from alloc.allocators import load, solve

REFERENCES = Path(__file__).with_name("learned_unseen_references.json")
MOST_GAP = 0.02
CLOSE = 1e-5
"""Relative gap at which a reference needs no more time."""

HEAD = (
    "family | method | limit s: | beyond the bound: | worst: | beyond the best known: | best known beyond the bound: |"
)
HEAD += " unserved: | failures: | s: |"
Reference = dict[str, float]


def read_references() -> dict[str, dict[str, Reference]]:
    """Return bound and best known makespan, by family and seed."""
    return json.loads(REFERENCES.read_text()) if REFERENCES.exists() else {}


def find_references(families: list[str], seeds: range, exact_time: float) -> None:
    """Improve what is known of each instance, and keep it at once."""
    methods = {"local-search": min(10.0, exact_time), "cpsat": exact_time}
    allocators = {name: load(name) for name in methods}
    for family in families:
        for seed in seeds:
            instance, found = UNSEEN[family](seed), read_references()
            one = found.setdefault(family, {}).setdefault(str(seed), {"bound": 0.0, "best": float("inf")})
            for name, seconds in methods.items():
                if one["best"] <= one["bound"] * (1 + CLOSE):
                    break
                result = solve(instance, allocators[name], time_limit_s=seconds, target_gap=CLOSE, threads=1)
                assert result.makespan is not None
                assert result.lower_bound is not None
                one["bound"] = max(one["bound"], result.lower_bound)
                one["best"] = min(one["best"], result.makespan)
            print(f"{family}, seed {seed}: bound {one['bound']:.6f}, best {one['best']:.6f}", flush=True)
            REFERENCES.write_text(_one_line_each(found))


def _one_line_each(found: dict[str, dict[str, Reference]]) -> str:
    """Return JSON with a line per instance, in the order of the families."""
    blocks = []
    for family in (name for name in UNSEEN if name in found):
        lines = [f'  "{seed}": {json.dumps(found[family][seed])}' for seed in sorted(found[family], key=int)]
        blocks.append(f"{json.dumps(family)}: {{\n" + ",\n".join(lines) + "\n}")
    return "{\n" + ",\n".join(blocks) + "\n}\n"


def line(rows: list[Row], references: dict[str, Reference]) -> tuple[list[str], float]:
    """Return a row of the table, and the mean excess over the bound; infinite where a run failed or left a task."""
    task, answered = rows[0].task, [row for row in rows if not row.why]
    begin = [task.family, task.method, f"{task.time_limit:g}"]
    if not answered:
        return [*begin, *["-"] * 5, f"{len(rows)} of {len(rows)}", "-", rows[0].why], np.inf
    bound, best = (np.array([references[str(row.task.seed)][key] for row in answered]) for key in ("bound", "best"))
    makespan = np.array([row.served for row in answered])
    whole = np.array([row.unserved == 0 for row in answered])
    assert (makespan[whole] >= bound[whole] * (1 - EQUAL)).all(), f"a bound of {task.family} is not of these instances"
    beyond, failures, unserved = makespan / bound - 1, len(rows) - len(answered), sum(row.unserved for row in answered)
    known_best = np.minimum(best, makespan)
    columns = [
        f"{beyond.mean():.2%}",
        f"{beyond.max():.2%}",
        f"{(makespan / known_best - 1).mean():.2%}",
        f"{(known_best / bound - 1).mean():.2%}",
        str(unserved),
        f"{failures} of {len(rows)}" if failures else "0",
        f"{np.mean([row.seconds for row in answered]):.2f}",
        next((row.why for row in rows if row.why), ""),
    ]
    return [*begin, *columns], np.inf if failures or unserved else float(beyond.mean())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, methods="gappo,gappo-ls", seeds=10)
    parser.add_argument("--families", help="split by semicolons; all by default")
    parser.add_argument("--objective", default="makespan-energy", choices=["makespan", "makespan-energy"])
    parser.add_argument("--time-limit", type=float, default=2.0, help="seconds")
    parser.add_argument("--large-time-limit", type=float, default=10.0, help="seconds with 2000 agents and more")
    parser.add_argument("--references", action="store_true", help="find references in place of runs")
    parser.add_argument("--exact-time", type=float, default=25.0, help="seconds per reference that is hard to prove")
    parser.add_argument("--first-seed", type=int, default=0, help="of references")
    options = parser.parse_args()
    families = options.families.split(";") if options.families else list(UNSEEN)
    if options.references:
        find_references(families, range(options.first_seed, options.first_seed + options.seeds), options.exact_time)
        return 0
    tasks, methods = [], known(options.methods)
    for family in families:
        limit = options.large_time_limit if family in LARGE else options.time_limit
        tasks += crossed([options.objective], [family], options.seeds, [limit], options.threads, methods)
    rows = run(tasks, jobs=options.jobs, kept=options.runs, again=options.again.split(","))
    references, lines, good = read_references(), [], True
    for family in families:
        for method in methods:
            of_both = [row for row in rows if (row.task.family, row.task.method) == (family, method)]
            columns, excess = line(of_both, references[family])
            lines.append(columns)
            good &= method != "gappo" or excess <= MOST_GAP
    text = table(HEAD, lines)
    print(text)
    if options.publish:
        note = f"Objective {options.objective}, {options.seeds} instances per family, threads: {options.threads}."
        publish("learned_unseen.py", f"{note}\n\n{text}")
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
