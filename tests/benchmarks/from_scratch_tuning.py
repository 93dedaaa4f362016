"""Tunes all five methods for `from_scratch.py`: the same number of trials, decisions and games for each.

    python tests/benchmarks/from_scratch_tuning.py --study from_scratch.db

Needs Optuna (extra `tune`). What is tried, and when a trial is given up, is what `alloc tune` does; the first trial of
each method is its defaults. Trials are compared on instances of the paper's scenario 1 with the seeds of validation,
which are neither trained nor reported on. A study can be broken off and taken up, and several processes can work at
it; the best settings of each method that is done go to from_scratch_tuned.json.
"""

import argparse
import json
import os
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import optuna
import torch
from from_scratch import GAPPO, PRICE, Variant, parameters_of
from from_scratch_report import METHODS

from alloc.allocators.learned.training.curriculum import reference_board
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.tune import open_study, tune
from alloc.allocators.learned.training.validation import VALIDATION_SEED
from alloc.problems.game import Board
from alloc.problems.generate import paper

GAMES = 12
"""Instances of scenario 1 on which trials are compared."""

TUNED = Path(__file__).with_name("from_scratch_tuned.json")


def judges() -> list[Board]:
    """Return the games on which trials are compared."""
    instances = [paper(1, VALIDATION_SEED + number) for number in range(GAMES)]
    return [reference_board(instances, [PRICE] * GAMES, np.random.default_rng(0))]


def untuned(method: str) -> Variant:
    """Return what is tuned: the variant of that name with the defaults of its method."""
    return Variant(method, {}, GAPPO.population if method == "gappo" else 1)


def tell(study: optuna.Study, trial: optuna.trial.FrozenTrial) -> None:
    """Say how a trial went."""
    cost = list(trial.intermediate_values.values())[-1]
    print(
        f"{study.study_name} {trial.number} {trial.state.name} {cost:.4f} {trial.params}", file=sys.stderr, flush=True
    )


def keep(method: str, settings: dict[str, float]) -> None:
    """Note the best settings of a method."""
    tuned = json.loads(TUNED.read_text(encoding="utf-8")) if TUNED.exists() else {}
    tuned[method] = {name: f"{value:.4g}" for name, value in settings.items()}
    ordered = {name: tuned[name] for name in METHODS if name in tuned}
    TUNED.write_text(json.dumps(ordered, indent=2) + "\n", encoding="utf-8")


def main() -> None:
    """Tune method after method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--study", type=Path, required=True, help="SQLite file of the trials")
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=METHODS)
    parser.add_argument("--trials", type=int, default=12)
    parser.add_argument("--decisions", type=int, default=60_000, help="of agents, per trial")
    options = parser.parse_args()
    torch.set_num_threads(1)
    for method in options.methods:
        study = open_study(options.study, method, seed=0)
        parameters = parameters_of(untuned(method), options.decisions)
        tune(study, parameters, options.trials, Limits(steps=options.decisions), boards=judges(), on_trial=tell)
        keep(method, study.best_params)


if __name__ == "__main__":
    main()
