"""Training in missions as a function, equivalent to `alloc train --missions`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from alloc.allocators.learned.algorithms.hyperparameters import PpoParameters
from alloc.allocators.learned.files.run_files import RunFiles
from alloc.allocators.learned.missions.policy_file import load_network
from alloc.allocators.learned.missions.training.curriculum import FAMILIES, MissionCurriculum
from alloc.allocators.learned.missions.training.trainer import DEFAULT_PPO, MissionTrainer, MissionTrainingParameters
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.loop import run_training
from alloc.allocators.learned.training.report import Report
from alloc.allocators.parallel.engine import Engine, never_stop
from alloc.problems import InputError
from alloc.problems.arguments import whole
from alloc.problems.errors import of_these
from alloc.problems.missions.mission import Mission

DEFAULT_GENERATIONS = 150
"""Number of generations if no limit is given."""

DEFAULT_POPULATION = 4
"""Number of networks of `gappo`; `ppo` trains one."""


def train_on_missions(
    method: str,
    output: Path | str,
    *,
    families: Sequence[str] = ("mixed",),
    missions: Sequence[Mission] = (),
    steps: int | None = None,
    minutes: float | None = None,
    iterations: int | None = None,
    patience: int | None = None,
    init: Path | str | None = None,
    population: int | None = None,
    decisions: int = 60_000,
    parameters: Mapping[str, object] | None = None,
    seed: int = 0,
    resume: bool = False,
    checkpoint: Path | str | None = None,
    log: Path | str | None = None,
    tensorboard: Path | str | None = None,
    engine: Engine | None = None,
    should_stop: Callable[[], bool] = never_stop,
    on_start: Callable[[MissionTrainer, Limits], None] = lambda trainer, limits: None,
    on_report: Callable[[Report], None] = lambda report: None,
) -> MissionTrainer:
    """Train a network for missions, and write the best one so far after each generation.

    Parameters
    ----------
    method : {"gappo", "ppo"}
        ``gappo``: evolution, followed by a population that learns by PPO and is bred; ``ppo``: one network that learns
        by PPO.
    output : Path or str
        Policy file to write.
    families : sequence of str
        Families of training missions, see `MissionFamily`; ``mixed`` for all except the paper's.
    missions : sequence of Mission
        Training missions in place of families.
    steps, minutes, iterations, patience, init, population, decisions, seed, resume, checkpoint, log, tensorboard
        As for `train`.
    parameters : mapping, optional
        Hyperparameters of PPO by name.
    engine, should_stop, on_start, on_report
        As for `train`.

    Returns
    -------
    MissionTrainer

    Raises
    ------
    InputError
        If a parameter is out of range, a file cannot be read, or a file of another origin would be overwritten.
    TrainingError
        If the engine gives up; the run can be resumed.
    """
    if method not in ("gappo", "ppo"):
        raise InputError(f"{method!r} does not learn in missions; gappo and ppo do", "method")
    if population is not None and method != "gappo":
        raise InputError(f"{method} trains one network; gappo breeds several", "population")
    files = RunFiles.beside(output, checkpoint, log, tensorboard)
    files.check(resume=resume)
    size = whole(population, "population", 1) if population else DEFAULT_POPULATION
    trainer = MissionTrainer(
        MissionTrainingParameters(
            method=method,
            population=size if method == "gappo" else 1,
            evolved=MissionTrainingParameters.evolved if method == "gappo" else 0,
            decisions=whole(decisions, "decisions", 1),
            learner=_learner(parameters or {}),
            curriculum=replace(MissionCurriculum(_families(families)), missions=tuple(missions)),
        ),
        whole(seed, "seed", 0),
        None if init is None else load_network(init).state_dict(),
    )
    if resume:
        trainer.resume(files.checkpoint)
    if steps is None and minutes is None and iterations is None:
        iterations = DEFAULT_GENERATIONS
    limits = Limits(steps, iterations, minutes, patience)
    on_start(trainer, limits)
    run_training(trainer, files, limits, engine=engine, should_stop=should_stop, on_report=on_report)
    return trainer


def _learner(parameters: Mapping[str, object]) -> PpoParameters:
    """Return the default hyperparameters of PPO in missions with changes by `parameters`."""
    from alloc.allocators.learned.algorithms.registry import method_parameters

    given = method_parameters("ppo", parameters)
    assert isinstance(given, PpoParameters)
    return replace(DEFAULT_PPO, **{name: getattr(given, name) for name in parameters})


def _families(names: Sequence[str]) -> tuple[str, ...]:
    if "mixed" in names:
        return FAMILIES
    for name in names:
        if name not in FAMILIES:
            raise InputError(f"there is no family {name!r}{of_these(name, ('mixed', *FAMILIES))}", "missions")
    return tuple(names)
