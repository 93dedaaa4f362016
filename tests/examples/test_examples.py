"""The example scripts run, in seconds, and print what they are meant to show."""

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


def test_replan(checkout):
    """Every plan serves all sites again, and with fewer drones takes longer."""
    printed = run(checkout / "examples" / "replan.py")
    hours = [float(part.split(" h")[0]) for part in printed.split("done in ")[1:]]
    assert len(hours) == 2
    assert hours[0] < hours[1]
    assert printed.count("drones drop out") == 2
    last_lines = [block.strip().splitlines()[-2] for block in printed.split("; done in")[:-1]]
    assert all(line.endswith(" 0 unserved") for line in last_lines)


@pytest.mark.slow
def test_train_stable_baselines3(checkout):
    """A short training of somebody else's PPO on the environment ends with a plan better than chance."""
    pytest.importorskip("stable_baselines3")
    output = run(checkout / "examples" / "train_stable_baselines3.py", "--steps", "3000")
    makespan = {line.split()[0]: float(line.split()[3]) for line in output.splitlines()}
    assert makespan["optimal"] <= makespan["greedy"]
    assert makespan["optimal"] <= makespan["learned"] < makespan["random"]
