"""``alloc tune``."""

import pytest

from alloc.allocators.learned.training import tune as module


@pytest.mark.needs("optuna")
def test_best_hyperparameters_are_printed_as_options_of_train(alloc, monkeypatch):
    """The best hyperparameters are printed as options of `alloc train`."""

    def tune(study, parameters, trials, limits, *, seed, on_trial):
        study.optimize(lambda trial: trial.suggest_float("learning_rate", 0.5, 0.5), trials, callbacks=[on_trial])

    monkeypatch.setattr(module, "tune", tune)
    ran = alloc("tune", "ppo", "--study", "ppo.db", "--trials", "2")
    assert (ran.code, ran.out) == (0, "")
    assert ran.err.splitlines()[-1] == "best cost 0.5: alloc train ppo --set learning_rate=0.5"


def test_bad_usage_is_one_line(alloc):
    """Unknown methods, families and folders are one-line errors."""
    for options in (
        ("gapo", "--study", "s.db"),
        ("ppo", "--study", "nowhere/s.db"),
        ("ppo", "--study", "s", "--family", "x"),
    ):
        ran = alloc("tune", *options)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
