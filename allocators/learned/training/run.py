"""Training as a function, equivalent to `alloc train`; torch is imported after all options have been checked."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from alloc.allocators.learned.algorithms.hyperparameters import Hyperparameters
from alloc.allocators.learned.algorithms.registry import method_parameters
from alloc.allocators.learned.files.policy_header import read_header
from alloc.allocators.learned.files.run_files import RunFiles
from alloc.allocators.learned.training.families import check_families
from alloc.allocators.parallel.engine import Engine, never_stop
from alloc.problems import InputError, Instance
from alloc.problems.arguments import real

if TYPE_CHECKING:
    from alloc.allocators.learned.training.limits import Limits
    from alloc.allocators.learned.training.report import Report
    from alloc.allocators.learned.training.trainer import Trainer

DEFAULT_STEPS = 500_000
"""Number of decisions of agents if no limit is given."""

DEFAULT_POPULATION = 4
"""Number of networks of `gappo`; all other methods train one."""


def train(
    method: str,
    output: Path | str,
    *,
    steps: int | None = None,
    minutes: float | None = None,
    iterations: int | None = None,
    patience: int | None = None,
    families: Sequence[str] = ("mixed",),
    instances: Sequence[Instance] | None = None,
    init: Path | str | None = None,
    population: int | None = None,
    decisions: int = 20_000,
    parameters: Hyperparameters | Mapping[str, object] | None = None,
    turn: str = "bidding",
    reward: str = "makespan",
    seed: int = 0,
    resume: bool = False,
    checkpoint: Path | str | None = None,
    log: Path | str | None = None,
    tensorboard: Path | str | None = None,
    engine: Engine | None = None,
    should_stop: Callable[[], bool] = never_stop,
    on_start: "Callable[[Trainer, Limits], None]" = lambda trainer, limits: None,
    on_report: "Callable[[Report], None]" = lambda report: None,
) -> "Trainer":
    """Train a learned method, and write the best policy so far after each generation.

    With `steps` or `iterations`, the same seed gives the same policy on any engine; with only `minutes`, schedules
    follow the clock.

    Parameters
    ----------
    method : str
        ``gappo``, ``ppo``, ``a2c``, ``dqn`` or ``ddpg``.
    output : Path or str
        Policy file to write, for `load` and ``--policy``.
    steps : int, optional
        Decisions of agents in the whole run, summed over all members; `DEFAULT_STEPS` if no limit is given.
    minutes : float, optional
        Minutes of the whole run.
    iterations : int, optional
        Generations of the whole run.
    patience : int, optional
        Number of consecutive generations without better networks after which the run ends.
    families : sequence of str
        Families of training instances; see `families.FAMILIES`.
    instances : sequence of Instance, optional
        Training instances in place of families; of five or more, a fifth is held out for validation, see `hold_out`.
    init : Path or str, optional
        Policy file with the initial networks.
    population : int, optional
        Number of networks that are trained and bred, for ``gappo`` only; `DEFAULT_POPULATION` by default.
    decisions : int
        Decisions of agents per generation and network.
    parameters : Hyperparameters or mapping, optional
        Hyperparameters of the method, or values of some of them by name, as numbers or text.
    turn, reward : str
        Rules of the games; see `alloc.problems.game.Rules`.
    seed : int
        Seed of all random numbers.
    resume : bool
        Whether to continue the run in the checkpoint.
    checkpoint, log : Path or str, optional
        Files for the complete run, and for one CSV line per generation; beside `output` by default.
    tensorboard : Path or str, optional
        Folder for event files.
    engine : Engine, optional
        Engine that trains the networks, see `make_engine`; by default one after another in this process.
    should_stop : callable
        Returns whether to stop; an unfinished generation is dropped.
    on_start : callable
        Called with the trainer and the limits of the run before the first generation.
    on_report : callable
        Called with the report of every generation.

    Returns
    -------
    Trainer
        The trainer, with the reports of all generations as ``history``.

    Raises
    ------
    InputError
        If a parameter is out of range, options exclude each other, a file cannot be read, or a file of another origin
        would be overwritten.
    TrainingError
        If the engine gives up; the run can be resumed.
    """
    learner = _hyperparameters(method, parameters)
    check_families(families)
    minutes = None if minutes is None else real(minutes, "minutes")
    if population is not None and method != "gappo":
        raise InputError(f"{method} trains one network; gappo breeds several", "population")
    if init is not None:
        read_header(init)
    files = RunFiles.beside(output, checkpoint, log, tensorboard)
    files.check(resume=resume)
    from alloc.allocators.learned.files.training_log import summary_writer
    from alloc.allocators.learned.training.limits import Limits
    from alloc.allocators.learned.training.loop import run_training
    from alloc.allocators.learned.training.setup import new_trainer

    if tensorboard is not None:
        summary_writer()  # raises if TensorBoard is not installed; creating a writer would already purge its folder
    if steps is None and minutes is None and iterations is None:
        steps = DEFAULT_STEPS
    limits = Limits(steps, iterations, minutes, patience)
    size = (population or DEFAULT_POPULATION) if method == "gappo" else 1
    trainer = new_trainer(
        method, learner, size, decisions, families, turn=turn, reward=reward, seed=seed, instances=instances, init=init
    )
    if resume:
        trainer.resume(files.checkpoint)
    on_start(trainer, limits)
    run_training(trainer, files, limits, engine=engine, should_stop=should_stop, on_report=on_report)
    return trainer


def _hyperparameters(method: str, parameters: Hyperparameters | Mapping[str, object] | None) -> Hyperparameters:
    """Return the hyperparameters of a method from the argument of `train`.

    Raises
    ------
    InputError
        If there is no such method, or the hyperparameters are of another method or out of range.
    """
    if parameters is None or isinstance(parameters, Mapping):
        return method_parameters(method, parameters)
    expected = type(method_parameters(method))
    if type(parameters) is not expected:
        message = f"{method} has {expected.__name__}, got {type(parameters).__name__}"
        raise InputError(message, "parameters")
    return parameters
