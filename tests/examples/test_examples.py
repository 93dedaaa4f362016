"""The example scripts run in seconds, and print the expected output."""

import re
import subprocess
import sys

import pytest


def run(script, *arguments):
    """Run a script as a user would; return what it prints."""
    done = subprocess.run(
        [sys.executable, str(script), *arguments], capture_output=True, text=True, timeout=110, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_solve_from_python(checkout):
    """Both objectives reach the same proven makespan, and the second saves energy."""
    lines = run(checkout / "examples" / "solve_from_python.py").splitlines()
    first, second = (line for line in lines if line.startswith("makespan"))
    assert first.startswith("makespan: optimal, 2 h")
    assert second.startswith("makespan-energy: optimal, 2 h")
    assert float(second.split()[-1]) < float(first.split()[-1])


@pytest.mark.slow
def test_replan(checkout):
    """Few drones are reassigned when one drops out; with forty fewer, the makespan is longer."""
    printed = run(checkout / "examples" / "replan.py")
    shares = [float(part.split(" %")[0]) for part in printed.split("drones move (")[1:]]
    hours = [float(part.split(" h")[0]) for part in printed.split("done at ")[1:] if " h\n" in part[:12]]
    assert len(shares) == len(hours) == 2
    assert shares[0] < 20
    assert hours[0] < hours[1]
    assert " without it, at " in printed


def test_ground_station(checkout):
    """Each changed order has its cause: a failed drone, or a new task."""
    lines = run(checkout / "examples" / "ground_station.py").splitlines()
    assert any("d3: None  (agent d3 failed at 1)" in line for line in lines)
    assert any(re.search(r"d\d: south  \(\w.* at [\d.]+\)", line) for line in lines)
    assert lines[-1].endswith("all is done")


@pytest.mark.slow
def test_train_stable_baselines3(checkout):
    """A short training of a third-party PPO on the environment gives a plan better than random."""
    pytest.importorskip("stable_baselines3")
    output = run(checkout / "examples" / "train_stable_baselines3.py", "--steps", "3000")
    makespan = {line.split()[0]: float(line.split()[3]) for line in output.splitlines()}
    assert makespan["optimal"] <= makespan["greedy"]
    assert makespan["optimal"] <= makespan["learned"] < makespan["random"]
