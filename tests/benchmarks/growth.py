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
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

READ = "import sys, time; from alloc.problems import read_instance; b = time.perf_counter();"
READ += " read_instance(sys.argv[1]); print(time.perf_counter() - b)"
WATCH = "import resource, subprocess, sys, time; b = time.perf_counter(); subprocess.run(sys.argv[1:], stderr=-3);"
WATCH += "print(); print(time.perf_counter() - b, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
"""A process that is small itself: a child's peak counts from that of its parent."""

ALLOC = [sys.executable, "-c", "import sys; from alloc.cli.main import main; sys.exit(main())"]
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
    gap: str

    def __str__(self) -> str:
        rest_s = max(0.0, self.wall_s - self.start_s - self.read_s - self.solve_s)
        times = " | ".join(f"{t:.2f}" for t in (self.start_s, self.read_s, self.solve_s, rest_s, self.wall_s))
        return f"| {self.case} | {self.method} | {self.agents:,} | {times} | {self.memory / 2**20:.0f} | {self.gap} |"


def measure(options: argparse.Namespace, folder: str) -> Iterator[Row]:
    """Generate, read and solve everything asked for."""
    instance, answer = f"{folder}/instance.npz", f"{folder}/result.json"
    for case, agents in ((case, agents) for case in options.cases for agents in options.agents):
        tasks = max(1, agents // 100)
        radius = np.sqrt(REACHED / np.pi / tasks)  # shrinks as tasks grow dense, so that an agent reaches as many
        ranges = ["--range", f"{0.8 * radius:.4f}:{1.2 * radius:.4f}"] if case in list(CASES)[2:] else []
        size = ["--agents", str(agents), "--tasks", str(tasks), "--seed", options.seed]
        _run([*ALLOC, "generate", "random", *size, *CASES[case], *ranges, "--output", instance])
        _run([*ALLOC, "validate", instance])  # what was just written is in the cache of the system
        read_s = float(_run([sys.executable, "-c", READ, instance])[0])
        for method in options.methods:
            solve = ["--method", method, "--objective", options.objective, "--time-limit", options.time_limit]
            start_s = _run([*ALLOC, "solve", "--method", method, "no-such-file.npz"])[1]
            _, wall_s, memory = _run([*ALLOC, "solve", instance, *solve, "--output", answer])
            result = json.loads(Path(answer).read_text())
            unserved, gap = len(result["unserved_tasks"]), result["gap"]
            told = f"{unserved} unserved" if unserved else "-" if gap is None else f"{100 * gap:.3f} %"
            yield Row(case, method, agents, start_s, read_s, result["runtime_s"], wall_s, memory, told)


def _run(command: list[str]) -> tuple[str, float, int]:
    """Run `command`; return its output, seconds, and largest resident set in bytes."""
    process = subprocess.run([sys.executable, "-c", WATCH, *command], stdout=subprocess.PIPE, text=True, check=True)
    output, _, figures = process.stdout.rstrip().rpartition("\n")
    seconds, memory = figures.split()
    return output, float(seconds), int(memory) * (1 if sys.platform == "darwin" else 1024)


def series(rows: list[Row]) -> dict[tuple[str, str], list[Row]]:
    """Gather rows by case and method."""
    keys = dict.fromkeys((row.case, row.method) for row in rows)
    return {key: [row for row in rows if (row.case, row.method) == key] for key in keys}


def exponents(group: list[Row]) -> tuple[float, float] | None:
    """Return b of seconds = a agents^b from 10,000 agents on, of solving and of the command without its start."""
    large = [row for row in group if row.agents >= 10_000]
    if len(large) < 2 or group[0].solve_s >= group[-1].solve_s / 2:
        return None
    times = np.maximum([[row.solve_s, row.wall_s - row.start_s] for row in large], 1e-3)
    solve, whole = np.polyfit(np.log([row.agents for row in large]), np.log(times), 1)[0]
    return solve, whole


def draw(rows: list[Row], path: str) -> None:
    """Draw whole commands, beyond the start, against agents, with a line of slope 1."""
    from alloc.allocators.plotting.style import drawn, new_figure

    figure = new_figure(7.5, 5)
    axes = figure.subplots()
    methods = list(dict.fromkeys(row.method for row in rows))
    for (case, method), group in series(rows).items():
        x, y = [row.agents for row in group], [row.wall_s - row.start_s for row in group]
        look = {"linestyle": ("-", "--", ":", "-.")[methods.index(method) % 4], "color": f"C{list(CASES).index(case)}"}
        axes.loglog(x, y, marker="o", markersize=4, label=f"{method}, {case}", **look)
    ends = np.array([min(row.agents for row in rows), max(row.agents for row in rows)])
    axes.loglog(ends, ends * 8e-6, color="0.6", linewidth=1, label="linear")
    axes.set(xlabel="agents (100 per task)", ylabel="time from npz file to result file, without start-up (s)")
    axes.grid(color="0.9", which="major")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
    drawn(lambda: figure, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agents", type=int, nargs="+", default=[1_000, 10_000, 100_000, 1_000_000])
    parser.add_argument("--methods", nargs="+", default=["greedy"])
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--objective", default="makespan", choices=["makespan", "makespan-energy"])
    parser.add_argument("--time-limit", default="30", help="seconds, of each run")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--plot", help="draw seconds against agents into this .svg or .png file")
    options = parser.parse_args()
    rows = []
    print("| agents begin | method | agents | start s | read s | solve s | rest s | whole command s | peak MiB | gap |")
    print("|---|---|--:|--:|--:|--:|--:|--:|--:|--:|")
    with tempfile.TemporaryDirectory() as folder:
        for row in measure(options, folder):
            print(row, flush=True)
            rows.append(row)
    for (case, method), group in series(rows).items():
        if (found := exponents(group)) is not None:
            print(f"| {case} | {method} | exponent | | | {found[0]:.2f} | | {found[1]:.2f} | | |")
    if options.plot:
        draw(rows, options.plot)


if __name__ == "__main__":
    main()
