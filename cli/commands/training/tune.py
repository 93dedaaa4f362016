"""``alloc tune``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli.commands.training.train_options import MethodArgument
from alloc.cli.options import examples
from alloc.cli.output.console import note, say
from alloc.cli.output.files import check_output
from alloc.problems.text import number

if TYPE_CHECKING:
    import optuna

EXAMPLES = examples(
    "alloc tune ppo --study ppo.db --trials 40 --steps 200000",
    "alloc tune ppo --study ppo.db --trials 80 --steps 200000",
    closing="The second example continues the study of the first; several processes may share a study. At the end, the "
    "options for `alloc train` are printed.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("tune", epilog=EXAMPLES)(tune_command)


def tune_command(
    method: MethodArgument,
    study: Annotated[str, typer.Option(metavar="FILE", help="SQLite file of the study; an existing one is continued.")],
    trials: Annotated[int, typer.Option(min=1, help="Number of trials, including those in the file.")] = 40,
    steps: Annotated[int, typer.Option(min=1, help="Decisions of agents per trial.")] = 100_000,
    family: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="As for `alloc train`; may be repeated.", show_default="mixed"),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Random seed.")] = 0,
) -> None:
    """Tune the hyperparameters of a learned method.

    Trials are scored on validation games.
    """
    check_output(study)
    from alloc.allocators.learned.algorithms.registry import method_parameters
    from alloc.allocators.learned.training.families import check_families

    learner, families = method_parameters(method), tuple(family or ["mixed"])
    check_families(families)
    import torch

    torch.set_num_threads(1)
    from alloc.allocators.learned.training.curriculum import Curriculum
    from alloc.allocators.learned.training.limits import Limits
    from alloc.allocators.learned.training.parameters import TrainingParameters
    from alloc.allocators.learned.training.run import DEFAULT_POPULATION
    from alloc.allocators.learned.training.tune import open_study, tune

    parameters = TrainingParameters(
        method=method,
        population=DEFAULT_POPULATION if method == "gappo" else 1,
        decisions=max(1, min(20_000, steps // 5)),
        learner=learner,
        curriculum=Curriculum(families),
    )
    from alloc.allocators.runtime.interrupts import sigterm_interrupts

    opened = open_study(Path(study), method, seed)
    try:
        with sigterm_interrupts():
            tune(opened, parameters, trials, Limits(steps=steps), seed=seed, on_trial=_tell)
    except KeyboardInterrupt:
        note(f"interrupted; {study} holds {len(opened.trials)} trials")
    try:
        best = opened.best_trial
    except ValueError:
        raise typer.Exit(1) from None
    say(f"best cost {number(best.value, 4)}: alloc train {method} {_settings(best.params)}")


def _settings(values: dict[str, float]) -> str:
    return " ".join(f"--set {name}={value:.4g}" for name, value in values.items())


def _tell(study: "optuna.Study", trial: "optuna.trial.FrozenTrial") -> None:
    figures = list(trial.intermediate_values.values())
    cost = number(figures[-1], 4) if figures else "none"
    say(f"trial {trial.number}  {trial.state.name.lower()}  cost {cost}  {_settings(trial.params)}")
