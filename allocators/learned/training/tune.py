"""Tuning: many short trainings with other hyperparameters, the hopeless ones ended early.

References
----------
Akiba et al. (2019), arXiv:1907.10902 (Optuna), whose tree-structured Parzen estimator draws what is tried and whose
median rule ends trials.
"""

import os
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from alloc.allocators.learned.training.trainer import Limits, Trainer, TrainingParameters
from alloc.problems import InputError, MissingPackageError
from alloc.problems.game import Board

if TYPE_CHECKING:
    import optuna

SPACES: dict[str, tuple[float, float] | tuple[int, int]] = {
    "learning_rate": (1e-4, 5e-3),
    "entropy_weight": (1e-4, 0.3),
    "kl_target": (3e-3, 5e-2),
    "epochs": (1, 6),
    "minibatch": (32, 256),
    "steps": (2, 20),
    "softness": (0.1, 3.0),
    "target_share": (1e-3, 0.1),
    "target_period": (20, 500),
    "temperature": (0.02, 1.0),
}
"""Least and most of what is tuned, drawn in proportion; a method is tuned in those that it has and uses."""

SHARES: dict[str, tuple[float, float]] = {"discount": (0.4, 1.0), "clip": (0.05, 0.4), "smoothing": (0.8, 1.0)}
"""The same, drawn evenly."""


def suggested(trial: "optuna.Trial", default: Any) -> dict[str, float]:
    """Draw hyperparameters for a trial; None in `default` is left so."""
    values: dict[str, float] = {}
    for field in fields(default):
        name = field.name
        if getattr(default, name) is None:
            continue
        if name in SHARES:
            values[name] = trial.suggest_float(name, *SHARES[name])
        elif name in SPACES and isinstance(getattr(default, name), int):
            low, high = SPACES[name]
            values[name] = trial.suggest_int(name, int(low), int(high), log=True)
        elif name in SPACES:
            values[name] = trial.suggest_float(name, *SPACES[name], log=True)
    return values


def open_study(path: Path, method: str, seed: int) -> "optuna.Study":
    """Open the study of a method in an SQLite file, or begin it.

    Raises
    ------
    InputError
        If Optuna is not installed, or the file holds no studies.
    """
    try:
        import optuna
    except ImportError as error:
        message = "needs Optuna, which is not installed; pip install 'alloc-mrta[tune]'"
        raise MissingPackageError(message, "alloc tune") from error
    if path.exists() and not os.access(path, os.R_OK | os.W_OK):
        raise InputError("may not be read and written; change its permissions", source=str(path))
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    try:
        study = optuna.create_study(
            storage=f"sqlite:///{path}",
            study_name=method,
            load_if_exists=True,
            pruner=optuna.pruners.MedianPruner(n_startup_trials=5, n_warmup_steps=1),
        )
        study.sampler = optuna.samplers.TPESampler(seed=seed + len(study.trials))  # nothing is drawn twice
        return study
    except MemoryError:
        raise
    except Exception as error:  # of Optuna, SQLAlchemy, Alembic or sqlite3: of what is in the file
        reason = next(iter(str(error).splitlines()), type(error).__name__)[:100]
        raise InputError(f"is not a file of studies ({reason})", source=str(path)) from error


def tune(
    study: "optuna.Study",
    parameters: TrainingParameters,
    trials: int,
    limits: Limits,
    *,
    seed: int = 0,
    boards: list[Board] | None = None,
    on_trial: Callable[["optuna.Study", "optuna.trial.FrozenTrial"], None] = lambda study, trial: None,
) -> None:
    """Train with other hyperparameters until the study holds so many trials that ended.

    Every trial has a seed of its own, so that no hyperparameters win by a lucky one. The first trial of a study takes
    the defaults.
    """
    import optuna
    from optuna.trial import TrialState

    def objective(trial: optuna.Trial) -> float:
        values = suggested(trial, parameters.learner)
        trained = replace(parameters, learner=replace(parameters.learner, **values))
        trainer = Trainer(trained, seed + trial.number, boards)
        while not trainer.is_over(limits):
            report = trainer.advance(limits)
            assert report is not None
            trial.report(report.best_cost, report.generation)
            if trial.should_prune():
                raise optuna.TrialPruned
        return trainer.history[-1].best_cost

    if not study.trials:
        defaults = suggested(_Defaults(parameters.learner), parameters.learner)
        study.enqueue_trial(defaults)
    ended = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE, TrialState.PRUNED))
    study.optimize(objective, max(0, trials - len(ended)), callbacks=[on_trial])


class _Defaults:
    """Suggests what a method's parameters are by default, cut to the space."""

    def __init__(self, default: Any) -> None:
        self._default = default

    def suggest_float(self, name: str, low: float, high: float, log: bool = False) -> float:
        return float(min(high, max(low, getattr(self._default, name))))

    def suggest_int(self, name: str, low: int, high: int, log: bool = False) -> int:
        return int(min(high, max(low, getattr(self._default, name))))
