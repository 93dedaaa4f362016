"""``alloc export``."""

from typing import Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.files import check_outputs
from alloc.problems.vocabulary import ModelFormat, ModelKind

EXAMPLES = examples(
    "alloc export demo.json --output demo.lp",
    "alloc export demo.json --model plain --format mps --output -",
    "alloc export demo.json --objective makespan-energy --makespan 1.5 --output demo.lp",
    "alloc evaluate demo.json demo.sol",
    closing="HiGHS, CBC, Gurobi and SCIP read the model, and `alloc evaluate` reads their solutions.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app` under both of its names; the help of the second refers to the first."""
    app.command("export", epilog=EXAMPLES)(export_command)
    examples_of_both = EXAMPLES.replace("alloc export ", "alloc export-model ")
    app.command("export-model", help="The same as `alloc export`.", epilog=examples_of_both)(export_command)


def export_command(
    instance: options.InstanceArgument,
    output: Annotated[str, typer.Option(metavar="FILE", help="File to write; - is standard output.")],
    file_format: Annotated[
        ModelFormat | None, typer.Option("--format", help="Format of the file.", show_default="by the suffix")
    ] = None,
    model: Annotated[
        ModelKind, typer.Option(help="class: variables count interchangeable agents; plain: one per agent and task.")
    ] = ModelKind.CLASS,
    objective: Annotated[
        options.PlainObjective, typer.Option(help="What is minimised: the makespan, or the energy at --makespan.")
    ] = options.PlainObjective.MAKESPAN,
    makespan: Annotated[
        float | None,
        typer.Option(
            metavar="TIME",
            help="Deadline of all tasks; needed for the energy, and for agents with speeds.",
            show_default="it is minimised",
        ),
    ] = None,
) -> None:
    """Export an instance as an integer programme for any solver."""
    from alloc.problems import read_instance, write_model

    check_outputs(("--output", output), read=[("INSTANCE", instance)])
    write_model(
        read_instance(instance),
        output,
        format=file_format,
        model=model,
        objective=objective.value,
        makespan=makespan,
    )
