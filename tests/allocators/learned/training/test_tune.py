"""Tuning: begins with the defaults, can be resumed, and ends hopeless trials early."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from alloc.allocators.learned.algorithms.registry import METHODS, method_parameters
from alloc.allocators.learned.network.actor_critic import NetworkSize
from alloc.allocators.learned.training import member as module
from alloc.allocators.learned.training.curriculum import Curriculum
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.parameters import TrainingParameters
from alloc.allocators.learned.training.tune import LOG_SPACES, UNIFORM_SPACES, open_study, suggested, tune
from alloc.allocators.learned.training.validation import Validation, games_on
from alloc.problems import InputError
from alloc.problems.generate import paper_like

CURRICULUM, BOARDS = games_on([paper_like(8, 2, 35, 0)], Curriculum(games=(2, 2)))
TINY = TrainingParameters("ppo", 1, 20, NetworkSize(4, 4, 1), method_parameters("ppo"), curriculum=CURRICULUM)


@pytest.mark.needs("optuna")
def test_study_starts_with_the_defaults_and_is_resumed(tmp_path: Path) -> None:
    """Two trials, then one more in another process, are three; the first has the defaults."""
    path = tmp_path / "study.db"
    tune(open_study(path, "ppo", 0), TINY, 2, Limits(iterations=1), boards=BOARDS)
    again = open_study(path, "ppo", 0)
    tune(again, TINY, 3, Limits(iterations=1), boards=BOARDS)
    assert [trial.number for trial in again.trials] == [0, 1, 2]
    first = again.trials[0].params
    assert first == {name: getattr(TINY.learner, name) for name in first}
    assert len({trial.params["learning_rate"] for trial in again.trials}) == 3


@pytest.mark.needs("optuna")
def test_poor_trials_are_pruned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A trial that is worse than most previous ones is pruned."""
    costs = iter([0.1] * 15 + [0.9] * 3)
    monkeypatch.setattr(module, "validate", lambda *_: Validation(next(costs), 0.0, 1.0, 0.1, 1.0, 0.0))
    study = open_study(tmp_path / "study.db", "ppo", 0)
    tune(study, replace(TINY, decisions=1), 6, Limits(iterations=3), boards=BOARDS)
    assert [trial.state.name for trial in study.trials] == ["COMPLETE"] * 5 + ["PRUNED"]


@pytest.mark.parametrize("method", METHODS)
def test_search_spaces_surround_the_defaults(method: str) -> None:
    """The ranges of tuned hyperparameters contain the defaults of every method."""

    class Lowest:
        def suggest_float(self, name: str, low: float, high: float, log: bool = False) -> float:
            assert low <= getattr(default, name) <= high, name
            return low

        suggest_int = suggest_float

    default = method_parameters(method)
    got = suggested(Lowest(), default)
    assert {"learning_rate", "gamma"} <= got.keys() <= LOG_SPACES.keys() | UNIFORM_SPACES.keys()


def test_missing_optuna_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error says what to install."""
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(InputError, match=r"alloc-mrta\[tune\]"):
        open_study(tmp_path / "study.db", "ppo", 0)


@pytest.mark.needs("optuna")
def test_other_files_are_refused(tmp_path: Path) -> None:
    """A file that is not an SQLite database is reported in one line."""
    (tmp_path / "study.db").write_text("no database, and long enough to be seen as such" * 10)
    with pytest.raises(InputError, match="is not a study"):
        open_study(tmp_path / "study.db", "ppo", 0)
