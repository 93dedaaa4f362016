"""The training loop, which writes all files after each generation."""

from collections.abc import Callable

from alloc.allocators.learned.files.run_files import RunFiles
from alloc.allocators.learned.files.training_log import TrainingLog
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.population import PopulationTraining
from alloc.allocators.learned.training.report import Report
from alloc.allocators.parallel.engine import Engine, EngineError, never_stop
from alloc.problems import TrainingError


def run_training(
    trainer: PopulationTraining,
    files: RunFiles,
    limits: Limits,
    *,
    engine: Engine | None = None,
    should_stop: Callable[[], bool] = never_stop,
    on_report: Callable[[Report], None] = lambda report: None,
) -> None:
    """Train until a limit is reached, with checkpoint, policy and log written after every generation.

    The checkpoint is written first and contains the content of the other files, so that a run that is killed between
    two writes repairs the others when it is resumed.

    Parameters
    ----------
    trainer : PopulationTraining
    files : RunFiles
        The policy file contains the networks of all members of the best generation, best first.
    limits : Limits
    engine : Engine, optional
        Engine that trains the members; by default one after another in this process.
    should_stop : callable
        As for `Engine.map`; an unfinished generation is dropped.
    on_report : callable
        Called with every `Report`.

    Raises
    ------
    TrainingError
        If the engine gives up; the run can be resumed.
    """
    trainer.save(files.checkpoint)
    if trainer.best:
        trainer.write_policy(files.policy)
    with TrainingLog(Report, files.log, files.tensorboard, trainer.history) as lines:
        while not trainer.is_over(limits) and not should_stop():
            report = _advanced(trainer, files, limits, engine, should_stop)
            if report is None:
                return
            try:
                trainer.save(files.checkpoint)
            finally:  # there may be disk space for one of the two
                if report.generation == trainer.best_generation:
                    trainer.write_policy(files.policy)
            lines.append(report)
            on_report(report)


def _advanced(
    trainer: PopulationTraining,
    files: RunFiles,
    limits: Limits,
    engine: Engine | None,
    should_stop: Callable[[], bool],
) -> Report | None:
    """Train another generation and return its report; errors of the engine are extended by how to resume."""
    try:
        return trainer.advance(limits, engine, should_stop)
    except EngineError as error:
        kept = f"{files.checkpoint} holds {trainer.generation} generations, and resuming goes on from them"
        raise TrainingError(f"{error}; {kept}") from error
