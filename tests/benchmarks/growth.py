"""Growth of time and memory from a thousand to a million agents: whole commands, npz file to result file.

    python tests/benchmarks/growth.py --methods greedy local-search --plot docs/benchmarks/scale.png

Each command is a process of its own. Its seconds are parted into start (interpreter and imports), reading, solving
(`runtime_s` of the result) and the rest (bounds by linear programme, summary, writing); memory is its largest resident
set. Exponents are those of the power law from 10,000 agents on, by least squares on logarithms: of solving, and of the
whole command without its start. Runs that go on until their time limit have none.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

READ = "import sys, time; from alloc.problems import read_instance; b = time.perf_counter();"
READ += " read_instance(sys.argv[1]); print(time.perf_counter() - b)"

WATCH = """
import resource, subprocess, sys, time
begin = time.perf_counter()
subprocess.run(sys.argv[1:], stderr=subprocess.DEVNULL)
seconds = time.perf_counter() - begin
print()
print(seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
"""A process that is small itself: a child's peak counts from that of its parent."""

CASES = {
    "at tasks": [],
    "own places": ["--starts", "own"],
    "short ranges": ["--starts", "own", "--dimensions", "2"],
    "travel times": ["--starts", "own", "--dimensions", "2", "--speed", "1:5"],
}
REACHED = 40
"""Tasks within an agent's reach on average, where ranges are short."""


@dataclass(frozen=True)
class Row:
    """What one command took; seconds, and bytes."""

    case: str
    method: str
    agents: int
    start_s: float
    read_s: float
    solve_s: float
    wall_s: float
    memory: int
    gap: float
    unserved: int

    @property
    def rest_s(self) -> float:
        return max(0.0, self.wall_s - self.start_s - self.read_s - self.solve_s)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agents", type=int, nargs="+", default=[1_000, 10_000, 100_000, 1_000_000])
    parser.add_argument("--methods", nargs="+", default=["greedy"])
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--objective", default="makespan", choices=["makespan", "makespan-energy"])
    parser.add_argument("--time-limit", default="30", help="seconds, of each run")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--table", help="write the table here as well, as JSON that --from reads")
    parser.add_argument("--from", dest="known", nargs="*", default=[], help="tables to be shown along, none measured")
    parser.add_argument("--plot", help="draw seconds against agents into this .svg or .png file")
    options = parser.parse_args()
    rows = [Row(**row) for name in options.known for row in json.loads(Path(name).read_text())]
    if not options.known:
        rows = measure(options)
    if options.table:
        Path(options.table).write_text(json.dumps([vars(row) for row in rows], indent=1))
    print(markdown(rows))
    if options.plot:
        draw(rows, options.plot)


def measure(options: argparse.Namespace) -> list[Row]:
    """Generate, read and solve everything asked for, and show each row as it comes."""
    rows = []
    alloc = [sys.executable, "-c", "import sys; from alloc.cli.main import main; sys.exit(main())"]
    with tempfile.TemporaryDirectory() as folder:
        for case in options.cases:
            for agents in options.agents:
                instance, answer = f"{folder}/instance.npz", f"{folder}/result.json"
                size = ["--agents", str(agents), "--tasks", str(max(1, agents // 100))]
                _run([*alloc, "generate", "random", *size, *_more(case, agents), "--seed", options.seed,
                      "--output", instance])  # fmt: skip
                _run([*alloc, "validate", instance])  # what was just written is in the cache of the system
                read_s = float(_run([sys.executable, "-c", READ, instance])[0])
                for method in options.methods:
                    solve = ["--method", method, "--objective", options.objective, "--time-limit", options.time_limit]
                    start_s = _run([*alloc, "solve", "--method", method, "no-such-file.npz"])[1]
                    _, wall_s, memory = _run([*alloc, "solve", instance, *solve, "--output", answer])
                    result = json.loads(Path(answer).read_text())
                    gap = float("nan") if result["gap"] is None else result["gap"]
                    rows.append(
                        Row(case, method, agents, start_s, read_s, result["runtime_s"], wall_s, memory, gap,
                            len(result["unserved_tasks"]))
                    )  # fmt: skip
                    print(rows[-1], file=sys.stderr, flush=True)
    return rows


def _more(case: str, agents: int) -> list[str]:
    """Options of `alloc generate`; ranges shrink as tasks grow dense, so that an agent reaches as many of them."""
    ranged = case in ("short ranges", "travel times")
    radius = np.sqrt(REACHED / np.pi / max(1, agents // 100))
    return [*CASES[case], *(["--range", f"{0.8 * radius:.4f}:{1.2 * radius:.4f}"] if ranged else [])]


def _run(command: list[str]) -> tuple[str, float, int]:
    """Run `command`; return its output, seconds, and largest resident set in bytes."""
    process = subprocess.run([sys.executable, "-c", WATCH, *command], stdout=subprocess.PIPE, text=True, check=True)
    output, _, figures = process.stdout.rstrip().rpartition("\n")
    seconds, memory = figures.split()
    return output, float(seconds), int(memory) * (1 if sys.platform == "darwin" else 1024)


def exponent(rows: list[Row], seconds: list[float]) -> float:
    """Return b of seconds = a agents^b through `rows` of at least 10,000 agents."""
    large = [(row.agents, time) for row, time in zip(rows, seconds, strict=True) if row.agents >= 10_000]
    agents, times = np.array(large).T
    return float(np.polyfit(np.log(agents), np.log(np.maximum(times, 1e-3)), 1)[0])


def series(rows: list[Row]) -> dict[tuple[str, str], list[Row]]:
    """Gather rows by case and method."""
    keys = dict.fromkeys((row.case, row.method) for row in rows)
    return {key: [row for row in rows if (row.case, row.method) == key] for key in keys}


def markdown(rows: list[Row]) -> str:
    """Return the rows as a table."""
    lines = [
        "| agents begin | method | agents | start s | read s | solve s | rest s | whole command s | peak MiB | gap |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for (case, method), group in series(rows).items():
        for row in group:
            times = f"{row.start_s:.2f} | {row.read_s:.2f} | {row.solve_s:.2f} | {row.rest_s:.2f} | {row.wall_s:.2f}"
            gap = f"{row.unserved} unserved" if row.unserved else f"{100 * row.gap:.3f} %"
            lines.append(f"| {case} | {method} | {row.agents:,} | {times} | {row.memory / 2**20:.0f} | {gap} |")
        ends_by_itself = group[0].solve_s < group[-1].solve_s / 2
        if ends_by_itself and sum(row.agents >= 10_000 for row in group) > 1:
            solve = exponent(group, [row.solve_s for row in group])
            whole = exponent(group, [row.wall_s - row.start_s for row in group])
            lines.append(f"| {case} | {method} | exponent | | | {solve:.2f} | | {whole:.2f} | | |")
    return "\n".join(lines)


def draw(rows: list[Row], path: str) -> None:
    """Draw whole commands, beyond the start, against agents, with a line of slope 1."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    colours = dict(zip(CASES, ("#0072b2", "#e69f00", "#009e73", "#cc79a7"), strict=True))
    styles = dict(zip(dict.fromkeys(row.method for row in rows), ("-", "--", ":"), strict=False))
    for (case, method), group in series(rows).items():
        x, y = [row.agents for row in group], [row.wall_s - row.start_s for row in group]
        label = f"{method}, {case}"
        axes.loglog(x, y, styles[method], marker="o", markersize=4, color=colours[case], label=label)
    ends = np.array([min(row.agents for row in rows), max(row.agents for row in rows)])
    axes.loglog(ends, ends * 8e-6, color="0.6", linewidth=1, label="linear")
    axes.set_xlabel("agents (100 per task)")
    axes.set_ylabel("seconds, npz file to result file, without the program's start")
    axes.grid(color="0.9", which="major")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
    figure.savefig(path, metadata={"Date": None} if path.endswith(".svg") else None, dpi=130)


if __name__ == "__main__":
    main()
