"""How long `alloc --help` takes, over that of bare Typer apps with as many commands, run in turns.

    python tests/benchmarks/help_startup.py [ROUNDS]

One bare app is as Typer comes, with rich; the other, the stricter, formats its help as `alloc` does, without.
"""

import statistics
import subprocess
import sys
import time

LIMIT = 1.4

BARE = """
import typer

app = typer.Typer({options})


def command(x: int = 1) -> None:
    "Do something."


for number in range({commands}):
    app.command(f"command-{{number}}")(command)
app()
"""


def seconds(*arguments: str) -> float:
    """Return the wall-clock time of one run of Python."""
    began = time.perf_counter()
    subprocess.run([sys.executable, *arguments], stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began


def count_commands() -> int:
    """Return the number of commands that `alloc` has."""
    from alloc.cli.main import app

    return len(app.registered_commands)


def measure(rounds: int) -> dict[str, float]:
    """Return the median time of each app, in seconds, after one round to warm the caches."""
    commands = count_commands()
    programs = {
        "alloc": ("-m", "alloc.cli", "--help"),
        "bare": ("-c", BARE.format(options="", commands=commands), "--help"),
        "bare, no rich": ("-c", BARE.format(options="rich_markup_mode=None", commands=commands), "--help"),
    }
    times: dict[str, list[float]] = {name: [] for name in programs}
    for turn in range(rounds + 1):
        for name, arguments in programs.items():
            took = seconds(*arguments)
            if turn:
                times[name].append(took)
    return {name: statistics.median(values) for name, values in times.items()}


def main() -> int:
    """Print the medians and the ratios; fail if the ratio to the faster bare app is above the limit."""
    medians = measure(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
    for name, value in medians.items():
        print(f"{name:14} {1000 * value:6.1f} ms   ratio {medians['alloc'] / value:.2f}")
    return int(medians["alloc"] > LIMIT * min(medians["bare"], medians["bare, no rich"]))


if __name__ == "__main__":
    sys.exit(main())
