"""Arguments and options of ``alloc train``, some of which ``alloc tune`` shares."""

from enum import StrEnum
from typing import Annotated

import typer

from alloc.problems.vocabulary import Reward, TurnRule

STEPS = 500_000
"""Default number of agents' decisions if no other limit is given."""


class Engine(StrEnum):
    """Names of `alloc.allocators.parallel.engines.ENGINES`, without loading numpy."""

    SERIAL = "serial"
    PROCESSES = "processes"
    RAY = "ray"


MethodArgument = Annotated[str, typer.Argument(metavar="METHOD", help="Method: gappo, ppo, a2c, dqn or ddpg.")]
OutputOption = Annotated[str, typer.Option(metavar="FILE", help="Policy file to write: the best networks so far.")]
StepsOption = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Decisions of agents, of the whole population and including those before --resume.",
        show_default=f"{STEPS}; none if --minutes or --iterations is given",
    ),
]
MinutesOption = Annotated[float | None, typer.Option(help="Minutes of training, including those before --resume.")]
GenerationsOption = Annotated[
    int | None, typer.Option("--iterations", min=0, help="Generations, including those before --resume.")
]
PatienceOption = Annotated[
    int | None, typer.Option(min=1, help="Stop after this many generations without improvement.")
]
FamilyOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME",
        help="Instances to train on: mixed, paper (small ones like the paper's), elsewhere, real, heavy-tailed, "
        "clustered, depots, short-range, travel, battery, priority, unbalanced or varied; may be repeated.",
        show_default="mixed",
    ),
]
TrainingInstancesOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|DIR",
        help="Train on these instances instead; a random fifth of five or more is held out for validation.",
    ),
]
MissionsOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="FAMILY|FILE",
        help="Train on missions instead, for alloc simulate --policy gappo: families of "
        "alloc generate mission, mixed for all of them, or mission files; may be repeated.",
    ),
]
InitOption = Annotated[str | None, typer.Option(metavar="POLICY", help="Start from the networks of this policy file.")]
PopulationOption = Annotated[
    int | None, typer.Option(min=1, help="Networks in the population; for gappo only.", show_default="4")
]
GenerationStepsOption = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Decisions of agents per network and generation.",
        show_default="20000; 60000 on missions",
    ),
]
FormerGenerationStepsOption = Annotated[
    int | None, typer.Option("--lesson", min=1, hidden=True, help="Former name of --generation-steps.")
]
HyperparametersOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="A hyperparameter of the method, such as clip_coef=0.1; may be repeated. An unknown name, such as help=, "
        "prints all hyperparameters with their defaults.",
    ),
]
TurnOption = Annotated[TurnRule, typer.Option(help="Which agents move in a step: the highest bids, or all at once.")]
RewardOption = Annotated[Reward, typer.Option(help="Reward: the makespan, or the paper's coverage (3).")]
ResumeOption = Annotated[bool, typer.Option("--resume", help="Continue from the checkpoint.")]
CheckpointOption = Annotated[
    str | None,
    typer.Option(metavar="FILE", help="State of the run, for --resume.", show_default="OUTPUT with .checkpoint"),
]
LogOption = Annotated[
    str | None,
    typer.Option(metavar="FILE", help="CSV file with a row per generation.", show_default="OUTPUT with .csv"),
]
TensorBoardOption = Annotated[
    str | None, typer.Option(metavar="DIR", help="Also write event files for TensorBoard there.")
]
EngineOption = Annotated[Engine, typer.Option(help="Where the networks of the population are trained.")]
WorkersOption = Annotated[
    int | None, typer.Option(min=1, max=1024, help="Workers of --engine processes.", show_default="all processors")
]
AddressOption = Annotated[
    str | None,
    typer.Option(
        help="Address of the cluster, for --engine ray.", show_default="RAY_ADDRESS, else the cluster on this machine"
    ),
]
TorchThreadsOption = Annotated[
    int, typer.Option(min=1, max=1024, help="Threads of torch; the tensors are small, so more than one rarely helps.")
]
