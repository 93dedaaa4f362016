"""``alloc train``."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from alloc.cli.commands.training import train_options as options
from alloc.cli.commands.training.train_missions import Shared, check_no_games, train_in_missions
from alloc.cli.commands.training.train_options import Engine
from alloc.cli.options import SeedOption, assignments, examples
from alloc.cli.output.console import STANDARD, complain, note, say
from alloc.cli.output.files import check_output, check_outputs, read_instances
from alloc.problems.text import counted, number
from alloc.problems.vocabulary import Reward, TurnRule

if TYPE_CHECKING:
    from alloc.allocators.learned.missions.training.trainer import MissionTrainer
    from alloc.allocators.learned.training.limits import Limits
    from alloc.allocators.learned.training.report import Report
    from alloc.allocators.learned.training.trainer import Trainer
    from alloc.problems import Instance

EXAMPLES = examples(
    "alloc train gappo --output policy.safetensors --steps 2000000",
    "alloc train gappo --output policy.safetensors --steps 2000000 --resume",
    "alloc train ppo --output mine.safetensors --instances my-instances --init policy.safetensors --minutes 10",
    "alloc solve demo.json --method gappo --policy policy.safetensors",
    "alloc train gappo --missions mixed --output missions.safetensors --minutes 150",
    closing="Ctrl-C ends the training; the last complete generation is stored, and --resume continues from it with the "
    "same results, also after a crash. With --steps or --iterations the same seed gives the same policy on any engine; "
    "with --minutes alone the schedules depend on elapsed time.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("train", epilog=EXAMPLES)(train_command)


def train_command(
    method: options.MethodArgument,
    output: options.OutputOption,
    steps: options.StepsOption = None,
    minutes: options.MinutesOption = None,
    iterations: options.GenerationsOption = None,
    patience: options.PatienceOption = None,
    family: options.FamilyOption = None,
    instances: options.TrainingInstancesOption = None,
    missions: options.MissionsOption = None,
    init: options.InitOption = None,
    population: options.PopulationOption = None,
    generation_steps: options.GenerationStepsOption = None,
    former_generation_steps: options.FormerGenerationStepsOption = None,
    settings: options.HyperparametersOption = None,
    turn: options.TurnOption = TurnRule.BIDDING,
    reward: options.RewardOption = Reward.MAKESPAN,
    seed: SeedOption = 0,
    resume: options.ResumeOption = False,
    checkpoint: options.CheckpointOption = None,
    log: options.LogOption = None,
    tensorboard: options.TensorBoardOption = None,
    engine: options.EngineOption = Engine.SERIAL,
    workers: options.WorkersOption = None,
    address: options.AddressOption = None,
    threads: options.TorchThreadsOption = 1,
) -> None:
    """Train a learned method.

    A checkpoint is written after each generation.
    """
    state, lines = _files(output, checkpoint, log, init)
    from alloc.allocators.parallel.engines import check_engine, make_engine
    from alloc.allocators.runtime.interrupts import sigterm_interrupts

    check_engine(engine.value, workers, address)
    if missions is not None:
        check_no_games(family=family, instances=instances, turn=turn, reward=reward)
    problems = None if instances is None else read_instances(instances)
    progress, size = Progress(problems or []), former_generation_steps or generation_steps
    engines = make_engine(engine.value, workers, address, threads)
    with _failures_told(state, progress), engines as where, sigterm_interrupts():
        shared = Shared(
            steps=steps,
            minutes=minutes,
            iterations=iterations,
            patience=patience,
            init=init,
            population=population,
            parameters=assignments(settings),
            seed=seed,
            resume=resume,
            checkpoint=state,
            log=lines,
            tensorboard=tensorboard,
            engine=where,
        )
        if missions is None:
            _train_in_games(method, output, family, problems, size, turn, reward, shared, progress)
        else:
            train_in_missions(method, output, missions, size, shared, progress)
    progress.close(output)


def _train_in_games(
    method: str,
    output: str,
    families: list[str] | None,
    problems: "list[Instance] | None",
    decisions: int | None,
    turn: TurnRule,
    reward: Reward,
    shared: Shared,
    progress: "Progress",
) -> None:
    """Train on families of instances, or on given instances."""
    from alloc.allocators import train

    train(
        method,
        output,
        families=families or ["mixed"],
        instances=problems,
        decisions=decisions or 20_000,
        turn=turn.value,
        reward=reward.value,
        on_start=progress.start,
        on_report=progress.tell,
        **shared,
    )


@contextmanager
def _failures_told(state: str, progress: "Progress") -> Iterator[None]:
    """After an interrupt or a failure of the engine, print the state of the checkpoint; failures exit with code 1."""
    from alloc.allocators import TrainingError

    try:
        yield
    except KeyboardInterrupt:
        note(f"interrupted; {state} holds {counted(progress.generations, 'generation')}")
    except TrainingError as error:
        complain(str(error))
        raise typer.Exit(1) from None


def _files(output: str, checkpoint: str | None, log: str | None, init: str | None) -> tuple[str, str]:
    """Return the names of checkpoint and log, after checking that all files can be written and differ."""
    check_output(output)
    state = checkpoint or str(Path(output).with_suffix(".checkpoint"))
    lines = log or str(Path(output).with_suffix(".csv"))
    check_outputs(("--output", output), ("--checkpoint", state), ("--log", lines), read=[("--init", init)])
    if STANDARD in (output, state, lines):
        raise typer.BadParameter("policy, checkpoint and log must be files", param_hint="'--output'")
    return state, lines


class Progress:
    """Prints a line for each generation.

    Parameters
    ----------
    instances : sequence of Instance
        Instances for training; empty if they are generated.
    """

    def __init__(self, instances: "Sequence[Instance]") -> None:
        self._instances = instances
        self._trainer: Trainer | MissionTrainer | None = None
        self._limits: Limits | None = None

    @property
    def generations(self) -> int:
        """Number of complete generations."""
        return 0 if self._trainer is None else self._trainer.generation

    def start(self, trainer: "Trainer | MissionTrainer", limits: "Limits") -> None:
        """Print which instances are held out; a callback for `on_start`."""
        self._trainer, self._limits = trainer, limits
        if self._instances:
            from alloc.allocators.learned.training.validation import split_notes

            for line in split_notes(self._instances):
                note(line)

    def tell(self, report: "Report") -> None:
        """Print the figures of a generation; a callback for `on_report`."""
        assert self._trainer is not None
        assert self._limits is not None
        done = self._trainer.progress(self._limits)
        left = report.seconds * (1 - done) / done / 60 if done > 0 else float("inf")
        say(
            f"gen {report.generation}  {report.decisions:,} decisions  {number(report.decisions_per_second, 3)}/s"
            f"  T {report.time:.4f}  distance {report.distance:.4f}  others {report.others_time:.4f}"
            f"  unserved {number(report.unserved, 3)}"
            f"  cost {report.cost:.4f} (best {report.best_cost:.4f}, gen {self._trainer.best_generation})"
            f"  reward {number(report.reward, 3)}  entropy {number(report.entropy, 3)}"
            f"  KL {number(report.divergence, 2)}  rate {number(report.learning_rate, 2)}"
            f"  {report.seconds / 60:.1f} min, {left:.1f} left"
        )

    def close(self, policy: str) -> None:
        """Print which networks the policy file contains; exit with code 1 if there are none."""
        if self._trainer is None or self._trainer.generation == 0:
            note(f"no generation is complete; {policy} is not written")
            raise typer.Exit(1)
        best = self._trainer.history[self._trainer.best_generation - 1]
        say(
            f"{policy} contains the networks of generation {best.generation}: T {best.time:.4f},"
            f" distance {best.distance:.4f}, {number(best.unserved, 3)} tasks unserved"
        )
