"""``alloc import-mission``."""

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import STANDARD, note, say
from alloc.cli.output.files import check_outputs
from alloc.problems.text import counted, labelled, number
from alloc.problems.vocabulary import ForeignFormat

if TYPE_CHECKING:
    from alloc.problems import Mission, RecordOptions

EXAMPLES = examples(
    "alloc import-mission space config.yaml --seed 3 --output mission.json",
    "alloc import-mission cfstp printed.txt --output mission.json",
    "alloc import-mission london animal_rescues.csv --from 2019-07-01 --until 2019-07-14 --compress 24 --output m.json",
    "alloc import-mission new-brunswick nbfires.csv --agents 20 --compress 100 --output mission.json",
    closing="The files are not part of alloc; docs/missions/records.md says where to get them and how they are read.",
)
DAY = "%Y-%m-%d"


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("import-mission", epilog=EXAMPLES)(import_mission_command)


def import_mission_command(
    file_format: Annotated[
        ForeignFormat,
        typer.Argument(
            metavar="FORMAT",
            help="cfstp, output of the tests of lcpz/cfstp; space, a configuration of the SPACE simulator; or records: "
            "london, animal rescues by the fire brigade; new-brunswick, forest fires.",
        ),
    ],
    file: Annotated[str, typer.Argument(metavar="FILE", help="The file: text, YAML, or a table.")],
    output: Annotated[str, typer.Option(metavar="FILE", help="Mission to write: .json, or -.")],
    seed: options.SeedOption = 0,
    agents: Annotated[
        int | None, typer.Option(min=1, help="Number of agents for records.", show_default="10, or the fleet")
    ] = None,
    ability: Annotated[float | None, typer.Option(help="Ability of these agents.", show_default="1")] = None,
    speed: Annotated[
        float | None, typer.Option(help="Speed of these agents in km/h.", show_default="30 in London, else 60")
    ] = None,
    compress: Annotated[
        float | None, typer.Option(help="Factor by which the time between records is divided.", show_default="1")
    ] = None,
    first: Annotated[
        datetime | None, typer.Option("--from", formats=[DAY], help="First day of the records.", show_default="all")
    ] = None,
    last: Annotated[
        datetime | None, typer.Option("--until", formats=[DAY], help="Last day of the records.", show_default="all")
    ] = None,
    fleet: Annotated[
        str | None, typer.Option(metavar="FILE", help="List of vehicles of the London Fire Brigade.")
    ] = None,
    quiet: options.QuietOption = False,
) -> None:
    """Import a mission from a file of another program.

    This may be a benchmark, the configuration of a simulator, or a record of real events.
    """
    from alloc.problems import import_mission, write_mission

    check_outputs(("--output", output), read=[("FILE", file), ("--fleet", fleet)])
    given = {
        "agents": agents,
        "ability": ability,
        "speed": speed,
        "compress": compress,
        "first": None if first is None else first.date(),
        "last": None if last is None else last.date(),
        "fleet": fleet,
    }
    mission = import_mission(
        file_format,
        file,
        _options(file_format, {name: value for name, value in given.items() if value is not None}),
        seed=seed,
        name=Path(file if output == STANDARD else output).stem,
        report=None if quiet else note,
    )
    write_mission(mission, output)
    if not quiet and output != STANDARD:
        say(_summary(mission, output))


def _options(file_format: ForeignFormat, given: dict[str, object]) -> "RecordOptions | None":
    """Return the options for records; raise an error if one is given with another format."""
    from alloc.problems import RecordOptions

    if file_format in (ForeignFormat.LONDON, ForeignFormat.NEW_BRUNSWICK):
        return RecordOptions(**given)  # type: ignore[arg-type]  # which it checks
    for name in given:
        flag = {"first": "from", "last": "until"}.get(name, name)
        raise typer.BadParameter(f"is for records only, not for {file_format}", param_hint=f"'--{flag}'")
    return None


def _summary(mission: "Mission", output: str) -> str:
    instance, last = mission.instance, number(float(mission.appears.max()))
    when = labelled(last, instance.units.time)
    return f"wrote {output}: {counted(instance.n, 'agent')}, {counted(instance.m, 'task')}, the last after {when}"
