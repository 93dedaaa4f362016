"""``alloc generate``."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from alloc.cli.commands.experiments.sources import covering
from alloc.cli.options import examples
from alloc.cli.output.console import STANDARD, say
from alloc.problems.vocabulary import Distribution, Knowledge, MissionFamily, Sites, Starts

if TYPE_CHECKING:
    from alloc.problems import Instance, Mission

EXAMPLES = examples(
    "alloc generate paper-1 --seed 7 --output demo.json",
    "alloc generate random --agents 50 --tasks 12 --sites clustered --range 0.5 --seed 1 --output demo.json",
    "alloc generate random --speed 20:60 --battery 10:30 --real --seed 3 --output demo.npz",
    "alloc generate paper-4 --seed 100 --count 20 --output instances",
    "alloc generate covering --agents 40 --tasks 16 --ability-max 100 --workload uniform --seed 3 --output demo.json",
    "alloc generate mission --family failures --agents 20 --tasks 40 --seed 7 --output mission.json",
    "alloc generate cfstp --agents 10 --seed 1 --count 100 --output cfstp",
    closing="SPREAD is a single value, LOW:HIGH for uniform random values, or none for no limit.",
)

SEED = Annotated[int, typer.Option(min=0, help="Random seed; with --count, the first of several.")]
FIXED = ("family", "seed", "count", "output")
"""Arguments and options that apply to all families."""

SIZES = ("agents", "tasks")
SPREADS = ("communication_range", "battery", "speed", "priority")
COVERING = (*SIZES, "ability_min", "ability_max", "workload", "integer", "choices")
MISSION = {
    "agents": "agents",
    "tasks": "tasks",
    "mission_family": "family",
    "knowledge": "knowledge",
    "radius": "radius",
    "sensing": "sensing",
    "loss": "loss",
}
"""Parameter of a mission that each option sets."""


class Family(StrEnum):
    """What can be generated."""

    PAPER_1 = "paper-1"
    PAPER_2 = "paper-2"
    PAPER_3 = "paper-3"
    PAPER_4 = "paper-4"
    RANDOM = "random"
    COVERING = "covering"
    MISSION = "mission"
    CFSTP = "cfstp"


def _option(text: str, default: str, *names: str, metavar: str | None = None) -> object:
    return typer.Option(*names, help=text, show_default=default, metavar=metavar)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("generate", epilog=EXAMPLES)(generate_command)


def generate_command(
    family: Annotated[
        Family,
        typer.Argument(
            metavar="FAMILY",
            help="paper-1 to paper-4, a scenario of the paper; random, with the options below; covering, machine "
            "covering without places: 100 agents with abilities from 1 to 1000, 25 tasks, workloads equal or uniform; "
            "mission, 20 agents and 40 tasks over time, of the kind that --family selects; or cfstp, a mission of 20 "
            "agents and 300 tasks with deadlines on a grid.",
        ),
    ],
    seed: SEED = 0,
    count: Annotated[int, typer.Option(min=1, help="Number of instances or missions, with consecutive seeds.")] = 1,
    output: Annotated[
        str,
        typer.Option(
            metavar="FILE|DIR", help="File to write, - for standard output; with --count a folder with a file per seed."
        ),
    ] = STANDARD,
    agents: Annotated[int | None, _option("Number of agents.", "100")] = None,
    tasks: Annotated[int | None, _option("Number of tasks.", "20")] = None,
    ability: Annotated[Distribution | None, _option("Distribution of abilities; not dirichlet.", "uniform")] = None,
    ability_min: Annotated[float | None, _option("Least ability, work per hour.", "1")] = None,
    ability_max: Annotated[float | None, _option("Largest ability.", "10")] = None,
    workload: Annotated[Distribution | None, _option("Distribution of workloads.", "dirichlet")] = None,
    load: Annotated[float | None, _option("Total workload over total ability.", "1")] = None,
    integer: Annotated[
        bool | None, _option("Integer or real abilities and workloads.", "integer", "--integer/--real")
    ] = None,
    sites: Annotated[Sites | None, _option("Distribution of places.", "uniform")] = None,
    clusters: Annotated[int | None, _option("Number of clusters.", "4")] = None,
    dimensions: Annotated[int | None, _option("Number of dimensions, 2 or 3.", "3")] = None,
    world_size: Annotated[float | None, _option("Side of the square or cube.", "1")] = None,
    starts: Annotated[Starts | None, _option("Where agents start.", "tasks")] = None,
    depots: Annotated[int | None, _option("Number of depots.", "1")] = None,
    communication_range: Annotated[
        str | None, _option("Distance of the farthest task that an agent takes.", "none", "--range", metavar="SPREAD")
    ] = None,
    battery: Annotated[str | None, _option("Energy of an agent.", "20", metavar="SPREAD")] = None,
    speed: Annotated[str | None, _option("Distance per hour.", "none", metavar="SPREAD")] = None,
    priority: Annotated[str | None, _option("Priority of a task.", "1", metavar="SPREAD")] = None,
    allowed_fraction: Annotated[float | None, _option("Share of the tasks that each agent may do.", "1")] = None,
    choices: Annotated[int | None, _option("Tasks that each agent may take, for covering.", "all")] = None,
    energy_per_distance: Annotated[float | None, _option("Energy per unit of distance.", "6")] = None,
    tau: Annotated[float | None, _option("Base of the reward (3).", "0.5")] = None,
    mission_family: Annotated[MissionFamily | None, _option("Kind of mission.", "steady", "--family")] = None,
    knowledge: Annotated[Knowledge | None, _option("What agents know in the mission.", "local")] = None,
    radius: Annotated[float | None, _option("Radio radius of agents in the mission.", "0.3")] = None,
    sensing: Annotated[float | None, _option("Sensing radius of agents in the mission.", "0.3")] = None,
    loss: Annotated[float | None, _option("Share of messages that are lost in the mission.", "0.2")] = None,
) -> None:
    """Generate instances or missions.

    Families are the scenarios of the paper, random instances, machine covering, and missions.
    """
    wanted = {name: value for name, value in locals().items() if value is not None and name not in FIXED}
    _check_options(family, wanted)
    if count > 1:
        _check_folder(output)
    for number in range(seed, seed + count):
        _write(_instance(family, wanted, number), output, into_folder=count > 1)
    if output != STANDARD:
        what = "missions" if family in (Family.MISSION, Family.CFSTP) else "instances"
        say(f"wrote {output}" if count == 1 else f"wrote {count} {what} into {output}")


def _check_folder(output: str) -> None:
    """Raise an error for what cannot be a folder of several files, or is a mistake for one."""
    if output == STANDARD:
        raise typer.BadParameter("must name a folder for several instances", param_hint="'--output'")
    if output.lower().endswith((".json", ".npz", ".csv")):
        raise typer.BadParameter(f"{output!r} is the name of a file; --count needs a folder", param_hint="'--output'")


def _check_options(family: Family, wanted: dict[str, Any]) -> None:
    """Raise an error for an option that does not apply to this family."""
    taken = {Family.COVERING: COVERING, Family.CFSTP: SIZES, Family.MISSION: MISSION}.get(family, ())
    for name in wanted:
        owner = _owner(name)
        if name not in taken and not (family is Family.RANDOM and (name in SIZES or owner is Family.RANDOM)):
            raise typer.BadParameter(f"is for {owner}, not for {family}", param_hint=f"'{_flag(name)}'")


def _owner(name: str) -> Family:
    """Return the family that an option is mainly for."""
    if name == "choices":
        return Family.COVERING
    return Family.MISSION if name in MISSION and name not in SIZES else Family.RANDOM


def _instance(family: Family, wanted: dict[str, Any], seed: int) -> "Instance | Mission":
    from alloc.problems import Family as Parameters
    from alloc.problems import MissionParameters, paper, random_cfstp, random_instance, random_mission

    if family is Family.MISSION:
        return random_mission(MissionParameters(**{MISSION[name]: value for name, value in wanted.items()}), seed)
    if family is Family.CFSTP:
        return random_cfstp(**wanted, seed=seed)
    if family is Family.COVERING:
        return covering(seed, **wanted)
    if family is not Family.RANDOM:
        return paper(int(family.removeprefix("paper-")), seed)
    spreads: dict[str, Any] = {name: _spread(value, name) for name, value in wanted.items() if name in SPREADS}
    return random_instance(Parameters(**{**wanted, **spreads}), seed)


def _write(made: "Instance | Mission", output: str, *, into_folder: bool) -> None:
    from alloc.problems import InputError
    from alloc.problems.formats.messages import unwritable

    if not into_folder:
        _write_file(made, output)
        return
    folder = Path(output)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise InputError("is a file; several instances need a folder", source=output) from error
    except OSError as error:
        raise unwritable(error, folder, output) from error
    _write_file(made, str(folder / f"{made.name}.json"))


def _write_file(made: "Instance | Mission", output: str) -> None:
    from alloc.problems import Mission, write_instance, write_mission

    if isinstance(made, Mission):
        write_mission(made, output)
    else:
        write_instance(made, output)


def _flag(name: str) -> str:
    known = {"communication_range": "range", "integer": "integer/--real", "mission_family": "family"}
    return "--" + known.get(name, name).replace("_", "-")


def _spread(text: str, name: str) -> float | tuple[float, ...] | None:
    """Parse ``none``, ``VALUE`` or ``LOW:HIGH``; the family validates the values."""
    from alloc.problems import InputError

    if text == "none":
        return None
    try:
        ends = tuple(float(part) for part in text.split(":"))
    except ValueError as error:
        raise InputError(f"must be a number, LOW:HIGH or none, got {text!r}", name) from error
    return ends[0] if len(ends) == 1 else ends
