"""How long `alloc --help` takes, over that of bare Typer apps with as many commands, run in turns.

    python tests/benchmarks/help_startup.py [ROUNDS]

One bare app is as Typer comes, with rich; the other, the stricter, formats its help as `alloc` does, without.
"""

import statistics
import subprocess
import sys
import time

from alloc.cli.main import app

LIMIT = 1.4
BARE = f"""
import typer

app = typer.Typer({{}})
for number in range({len(app.registered_commands)}):
    app.command(f"command-{{{{number}}}}")(lambda x=1: None)
app()
"""
PROGRAMS = {
    "alloc": ("-m", "alloc.cli"),
    "bare": ("-c", BARE.format("")),
    "bare, no rich": ("-c", BARE.format("rich_markup_mode=None")),
}


def seconds(*arguments: str) -> float:
    """Return the wall-clock time of one run of Python."""
    began = time.perf_counter()
    subprocess.run([sys.executable, *arguments, "--help"], stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began


rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
turns = [{name: seconds(*one) for name, one in PROGRAMS.items()} for _ in range(rounds + 1)][1:]
medians = {name: statistics.median(turn[name] for turn in turns) for name in PROGRAMS}
for name, value in medians.items():
    print(f"{name:14} {1000 * value:6.1f} ms   ratio {medians['alloc'] / value:.2f}")
sys.exit(medians["alloc"] > LIMIT * min(medians["bare"], medians["bare, no rich"]))
