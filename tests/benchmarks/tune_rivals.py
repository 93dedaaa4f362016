"""Random search over the main hyperparameters of ppo, a2c, dqn and ddpg: as many trials and decisions for each.

    python tests/benchmarks/tune_rivals.py --trials 8 --decisions 25000 --output tuning.csv

The first trial of each method is its defaults. What is compared is the cost of validation games (seeds from 2 * 10^9
on), which are neither trained on nor reported. Trials that the output names are not run again, so that a search can be
broken off and taken up; the best of each method are printed at the end. One trial takes half a minute to a minute.
"""

import argparse
import csv
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch

from alloc.allocators.learned.curriculum import Curriculum
from alloc.allocators.learned.learner import Lesson
from alloc.allocators.learned.methods import method_parameters, new_learner
from alloc.allocators.learned.network import NetworkSize
from alloc.allocators.learned.validation import validate, validation_boards
from alloc.problems.game import PLANNING

LESSON = 2500
"""Decisions per lesson: how finely schedules fall."""

Space = dict[str, tuple[float, float] | list[Any]]
"""Ranges, drawn from evenly in proportion, and lists of choices."""

SPACES: dict[str, Space] = {
    "ppo": {
        "learning_rate": (3e-4, 4e-3),
        "entropy_weight": (1e-3, 3e-2),
        "discount": [0.95, 0.99, 1.0],
        "clip": [0.1, 0.2, 0.3],
        "epochs": [2, 3, 4],
        "minibatch": [64, 128],
    },
    "a2c": {
        "learning_rate": (5e-4, 6e-3),
        "entropy_weight": (1e-3, 1e-1),
        "discount": [0.9, 0.97, 0.99, 1.0],
        "steps": [2, 3, 5, 10],
        "value_weight": [0.25, 0.5, 1.0],
    },
    "dqn": {
        "learning_rate": (3e-4, 4e-3),
        "discount": [0.3, 0.5, 0.7, 0.9],
        "temperature": (0.02, 0.3),
        "exploring": [0.05, 0.2, 0.5],
        "reuse": [1.0, 2.0],
        "minibatch": [32, 64],
        "target_period": [30, 100, 300],
    },
    "ddpg": {
        "learning_rate": (3e-4, 4e-3),
        "actor_share": [0.3, 1.0],
        "discount": [0.3, 0.5, 0.7, 0.9],
        "entropy_weight": (0.03, 1.0),
        "reuse": [1.0, 2.0],
        "minibatch": [32, 64],
        "target_share": [0.005, 0.02, 0.05],
    },
}

FIELDS = ("method", "trial", "settings", "decisions", "cost", "time", "distance", "others_time", "seconds")


def drawn(method: str, trial: int) -> dict[str, Any]:
    """Return the settings of a trial, none for the first: always the same ones."""
    rng = np.random.default_rng([sum(map(ord, method)), trial])
    if trial == 0:
        return {}
    return {
        name: rng.choice(of).item() if isinstance(of, list) else float(f"{of[0] * (of[1] / of[0]) ** rng.random():.3g}")
        for name, of in SPACES[method].items()
    }


def run(method: str, trial: int, settings: dict[str, Any], decisions: int) -> dict[str, Any]:
    """Train from nothing for so many decisions, and validate."""
    parameters = method_parameters(method, {name: str(value) for name, value in settings.items()})
    learner = new_learner(method, NetworkSize(), parameters, seed=trial)
    curriculum, done, lesson = Curriculum(), 0, 0
    began = time.perf_counter()
    while done < decisions:
        task = Lesson(1000 * trial + lesson, min(LESSON, decisions - done), curriculum, done / decisions)
        done, lesson = done + learner.take(task).decisions, lesson + 1
    seconds = time.perf_counter() - began
    got = validate(learner.policy, validation_boards(curriculum), PLANNING, curriculum)
    figures = {name: round(getattr(got, name), 5) for name in ("cost", "time", "distance", "others_time")}
    row = {"method": method, "trial": trial, "settings": json.dumps(settings), "decisions": decisions}
    return {**row, **figures, "seconds": round(seconds, 1)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--methods", nargs="+", default=list(SPACES), choices=list(SPACES))
    parser.add_argument("--trials", type=int, default=8)
    parser.add_argument("--decisions", type=int, default=25_000)
    parser.add_argument("--output", type=Path, default=Path("tuning.csv"))
    options = parser.parse_args()
    torch.set_num_threads(1)
    rows = list(csv.DictReader(options.output.open())) if options.output.exists() else []
    known = {(row["method"], int(row["trial"]), int(row["decisions"])) for row in rows}
    for trial in range(options.trials):
        for method in options.methods:
            if (method, trial, options.decisions) in known:
                continue
            row = run(method, trial, drawn(method, trial), options.decisions)
            fresh = not options.output.exists()
            with options.output.open("a", newline="") as file:
                writer = csv.DictWriter(file, FIELDS)
                if fresh:
                    writer.writeheader()
                writer.writerow(row)
            print(*row.values(), file=sys.stderr)
    rows = [row for row in csv.DictReader(options.output.open()) if int(row["decisions"]) == options.decisions]
    for method in options.methods:
        best = sorted((row for row in rows if row["method"] == method), key=lambda row: float(row["cost"]))
        for row in best[:3]:
            print(method, row["cost"], row["time"], row["distance"], row["settings"])


if __name__ == "__main__":
    main()
