"""The training loop: generation after generation, with all files written after each."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

from alloc.allocators.learned.files.run_files import RunFiles
from alloc.allocators.learned.files.training_log import TrainingLog
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.report import Report
from alloc.allocators.parallel.engine import Engine, never_stop


class TrainingRun(Protocol):
    """What is trained generation by generation, such as a `Trainer`."""

    history: list[Report]

    @property
    def best(self) -> Sequence[object]:
        """The networks of the best generation, none before the first."""

    @property
    def best_generation(self) -> int:
        """The generation with the best networks, 0 before the first."""

    def is_over(self, limits: Limits) -> bool:
        """Whether a limit is reached."""

    def advance(self, limits: Limits, engine: Engine | None, should_stop: Callable[[], bool]) -> Report | None:
        """Train, validate and breed one generation; return None if it is not complete."""

    def save(self, path: Path) -> None:
        """Write a checkpoint of the whole run."""

    def write_policy(self, path: Path) -> None:
        """Write the best networks up to now to a policy file."""


def run_training(
    trainer: TrainingRun,
    files: RunFiles,
    limits: Limits,
    *,
    engine: Engine | None = None,
    should_stop: Callable[[], bool] = never_stop,
    on_report: Callable[[Report], None] = lambda report: None,
) -> None:
    """Train until a limit is reached, with checkpoint, policy and log written after every generation.

    The checkpoint is written first and contains what the other files say: a run that is killed between two of them
    repairs the others when it is resumed.

    Parameters
    ----------
    trainer : TrainingRun
    files : RunFiles
        The policy file gets the networks of all members of the best generation, the best first.
    limits : Limits
    engine : Engine, optional
        Where the members are trained; one after the other in this process by default.
    should_stop : callable
        As for `Engine.map`; an unfinished generation is dropped.
    on_report : callable
        Called with every `Report`.
    """
    trainer.save(files.checkpoint)
    if trainer.best:
        trainer.write_policy(files.policy)
    with TrainingLog(Report, files.log, files.tensorboard, trainer.history) as lines:
        while not trainer.is_over(limits) and not should_stop():
            report = trainer.advance(limits, engine, should_stop)
            if report is None:
                return
            try:
                trainer.save(files.checkpoint)
            finally:  # the disk may have room for one of the two
                if report.generation == trainer.best_generation:
                    trainer.write_policy(files.policy)
            lines.append(report)
            on_report(report)
