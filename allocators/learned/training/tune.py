"""Tuning of hyperparameters by many short trainings, of which unpromising ones are pruned.

References
----------
Akiba et al. (2019), arXiv:1907.10902 (Optuna), whose tree-structured Parzen estimator samples the trials and whose
median rule prunes them.
"""

import os
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from alloc.allocators.learned.algorithms.hyperparameters import Hyperparameters
from alloc.allocators.learned.algorithms.registry import method_parameters
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.parameters import TrainingParameters
from alloc.allocators.learned.training.trainer import Trainer
from alloc.problems import InputError, MissingPackageError
from alloc.problems.game import Board

if TYPE_CHECKING:
    import optuna

LOG_SPACES: dict[str, tuple[float, float] | tuple[int, int]] = {
    "learning_rate": (1e-4, 5e-3),
    "ent_coef": (1e-4, 0.3),
    "target_kl": (3e-3, 5e-2),
    "update_epochs": (1, 6),
    "minibatch_size": (32, 256),
    "batch_size": (32, 256),
    "num_steps": (2, 20),
    "softmax_temperature": (0.1, 3.0),
    "tau": (1e-3, 0.1),
    "target_update_interval": (20, 500),
    "temperature": (0.02, 1.0),
}
"""Bounds of hyperparameters that are sampled log-uniformly; only those that a method has and uses are tuned."""

UNIFORM_SPACES: dict[str, tuple[float, float]] = {
    "gamma": (0.4, 1.0),
    "clip_coef": (0.05, 0.4),
    "gae_lambda": (0.8, 1.0),
}
"""Bounds of hyperparameters that are sampled uniformly."""


class Sampler(Protocol):
    """The methods of `optuna.Trial` that sample values."""

    def suggest_float(self, name: str, low: float, high: float, *, log: bool = False) -> float:
        """Return a number from `low` to `high`."""

    def suggest_int(self, name: str, low: int, high: int, *, log: bool = False) -> int:
        """Return an integer from `low` to `high`."""


def suggested(trial: Sampler, default: Hyperparameters) -> dict[str, float]:
    """Sample the hyperparameters of a trial; those that are None in `default` remain None."""
    values: dict[str, float] = {}
    for field in fields(default):
        name = field.name
        if getattr(default, name) is None:
            continue
        if name in UNIFORM_SPACES:
            values[name] = trial.suggest_float(name, *UNIFORM_SPACES[name])
        elif name in LOG_SPACES and isinstance(getattr(default, name), int):
            low, high = LOG_SPACES[name]
            values[name] = trial.suggest_int(name, int(low), int(high), log=True)
        elif name in LOG_SPACES:
            values[name] = trial.suggest_float(name, *LOG_SPACES[name], log=True)
    return values


def open_study(path: Path, method: str, seed: int) -> "optuna.Study":
    """Open the study of a method in an SQLite file, which is created if it does not exist.

    Raises
    ------
    InputError
        If Optuna is not installed, or the file does not contain studies.
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
        study.sampler = optuna.samplers.TPESampler(seed=seed + len(study.trials))  # a resumed study draws other numbers
        return study
    except MemoryError:
        raise
    except Exception as error:  # of Optuna, SQLAlchemy, Alembic or sqlite3, depending on the content of the file
        reason = next(iter(str(error).splitlines()), type(error).__name__)[:100]
        raise InputError(f"is not a study; name another file ({reason})", source=str(path)) from error


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
    """Train with sampled hyperparameters until the study has `trials` finished trials.

    Every trial has its own seed, so that no hyperparameters win by a lucky seed. The first trial of a study uses the
    defaults.

    Parameters
    ----------
    study : optuna.Study
        A study from `open_study`.
    parameters : TrainingParameters
        Parameters of each training except the sampled hyperparameters.
    trials : int
        Number of finished trials, including those already in the study.
    limits : Limits
        Limits of each training.
    seed : int
        Seed of the first trial; the others have consecutive seeds.
    boards : list of Board, optional
        Validation games; those of the curriculum by default.
    on_trial : callable
        Called with study and trial after each trial.
    """
    import optuna
    from optuna.trial import TrialState

    default = parameters.learner or method_parameters(parameters.method)

    def objective(trial: optuna.Trial) -> float:
        learner = replace(default, **suggested(trial, default))  # type: ignore[arg-type]
        trainer = Trainer(replace(parameters, learner=learner), seed + trial.number, boards)
        while not trainer.is_over(limits):
            report = trainer.advance(limits)
            assert report is not None
            trial.report(report.best_cost, report.generation)
            if trial.should_prune():
                raise optuna.TrialPruned
        return trainer.history[-1].best_cost

    if not study.trials:
        study.enqueue_trial(suggested(_Defaults(default), default))
    finished = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE, TrialState.PRUNED))
    study.optimize(objective, max(0, trials - len(finished)), callbacks=[on_trial])


class _Defaults:
    """A `Sampler` of a method's default hyperparameters, clipped to their bounds."""

    def __init__(self, default: Hyperparameters) -> None:
        self._default = default

    def suggest_float(self, name: str, low: float, high: float, *, log: bool = False) -> float:
        return float(min(high, max(low, getattr(self._default, name))))

    def suggest_int(self, name: str, low: int, high: int, *, log: bool = False) -> int:
        return int(min(high, max(low, getattr(self._default, name))))
