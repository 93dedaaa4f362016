"""``alloc compare``."""

import threading
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.commands.experiments import options as store_options
from alloc.cli.commands.experiments.missions import MissionRuns, compare_missions
from alloc.cli.commands.experiments.sources import gather
from alloc.cli.options import examples
from alloc.cli.output.console import note, say, table
from alloc.cli.output.files import check_outputs
from alloc.cli.output.rows import show_done, write_rows
from alloc.problems.text import heading, labelled, number, percent
from alloc.problems.vocabulary import Knowledge

if TYPE_CHECKING:
    from alloc.allocators import Allocator
    from alloc.allocators.experiments.compare import Row
    from alloc.problems import Units

EXAMPLES = examples(
    "alloc compare demo.json --methods greedy,ga,cpsat",
    "alloc compare instances/*.json --methods ga,gappo --seeds 5 --time-limit 3 --csv table.csv",
    "alloc compare demo.json --methods 'ga[population=40],ga[population=400]' --time-limit 1",
    "alloc compare demo.json --methods milp,gappo --objective makespan-energy --seeds 7,8,9 --json",
    "alloc compare paper-1:0-99 --methods greedy,gappo --seeds 3 --time-limit 5 --store runs.db --report table.tex",
    "alloc compare missions/*.json --policies nearest,greedy,gappo --seeds 3 --store runs.db",
    closing="A method or policy that refuses gets a row with the reason. Ctrl-C prints the finished rows, with exit "
    "code 1.",
)

MethodsOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME,NAME,...",
        autocompletion=options.complete_methods,
        help="Methods; see `alloc methods`. Parameters go in brackets, as in ga[population=200].",
    ),
]
PoliciesOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME,NAME,...",
        autocompletion=options.complete_policy_list,
        help="Policies for missions, in the same form; the first is the baseline: "
        f"{', '.join(options.BUILT_IN_POLICIES)}, or plugins.",
    ),
]
SeedsOption = Annotated[
    str, typer.Option(metavar="SEEDS", help="Seeds such as 0,1,2, or a number N for the seeds 0 to N - 1.")
]
DeadlineOption = Annotated[
    float | None,
    typer.Option(min=0, help="Milliseconds for each decision of a policy; 0 for no limit.", show_default="no limit"),
]
CsvOption = Annotated[
    str | None, typer.Option(metavar="FILE", help="Write the table here as CSV; - is standard output.")
]


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("compare", epilog=EXAMPLES)(compare_command)


def compare_command(
    instances: Annotated[
        list[str],
        typer.Argument(
            metavar="INSTANCE...",
            help=f"Instances, or missions with --policies, each {options.READABLE}; folders and patterns of these; "
            "tables of instances; and families such as paper-1:0-9.",
        ),
    ],
    methods: MethodsOption = None,
    policies: PoliciesOption = None,
    seeds: SeedsOption = "1",
    objective: options.ObjectiveOption = options.PlainObjective.MAKESPAN,
    time_limit: options.TimeLimitOption = None,
    iterations: options.IterationsOption = None,
    target_gap: options.TargetGapOption = None,
    threads: options.ThreadsOption = None,
    knowledge: Annotated[
        Knowledge | None, typer.Option(help="What agents in missions know.", show_default="as each mission says")
    ] = None,
    deadline_ms: DeadlineOption = None,
    csv: CsvOption = None,
    json: options.JsonOption = False,
    store: store_options.StoreOption = None,
    workers: store_options.WorkersOption = None,
    memory: store_options.MemoryOption = None,
    kill_after: store_options.KillAfterOption = None,
    retry: store_options.RetryOption = False,
    report: store_options.ReportOption = None,
    engine: store_options.EngineOption = None,
    address: store_options.AddressOption = None,
) -> None:
    """Compare methods on instances, or policies on missions.

    Each is run with every seed; a table is printed.
    """
    from alloc.allocators import Budget
    from alloc.problems.formats import is_standard_output

    storage = store_options.checked(store, workers, memory, kill_after, report, engine, address, retry=retry)
    written = [("--csv", csv), *(("--report", file) for file in report or ())]
    check_outputs(*written, read=[("--store", store), *(("INSTANCE", instance) for instance in instances)])
    if json and csv is not None and is_standard_output(csv):
        raise typer.BadParameter("cannot be standard output together with --json", param_hint="'--csv'")
    of_methods: dict[str, object] = {
        "--time-limit": time_limit,
        "--iterations": iterations,
        "--target-gap": target_gap,
        "--threads": threads,
        "--objective": None if objective is options.PlainObjective.MAKESPAN else objective,
    }
    _check_kind(methods, policies, of_methods, {"--knowledge": knowledge, "--deadline-ms": deadline_ms})
    outputs = store_options.Outputs(csv, json)
    if policies is not None:
        listed = options.listed(policies, "--policies")
        mission_runs = MissionRuns(instances, listed, _seeds(seeds), knowledge, deadline_ms or None)
        raise typer.Exit(compare_missions(storage, mission_runs, outputs))
    assert methods is not None
    budget = Budget(options.time_limit(time_limit, iterations), iterations, target_gap)
    runs = store_options.MethodRuns(instances, _seeds(seeds), objective.value, budget, threads)
    if storage is not None:
        raise typer.Exit(_compare_in_store(storage, methods, runs, outputs))
    raise typer.Exit(_compare(_methods(methods), runs, outputs))


def _check_kind(
    methods: str | None, policies: str | None, of_methods: dict[str, object], of_policies: dict[str, object]
) -> None:
    """Raise an error unless either methods or policies are given, each with their own options only."""
    if (methods is None) == (policies is None):
        message = "give either --methods, for instances, or --policies, for missions"
        raise typer.BadParameter(message, param_hint="'--methods'")
    others, kind = (of_policies, "--policies") if policies is None else (of_methods, "--methods")
    for option, value in others.items():
        if value is not None:
            raise typer.BadParameter(f"can only be used with {kind}", param_hint=f"'{option}'")


def _compare_in_store(
    storage: store_options.StoreOptions,
    methods: str,
    runs: store_options.MethodRuns,
    outputs: store_options.Outputs,
) -> int:
    """Make the runs that are missing in the store, print the rows of all runs, and return the exit code."""
    from alloc.cli.commands.experiments.stored import compare_in_store, conclude
    from alloc.problems import Instance
    from alloc.problems.units import common_units

    variants = {
        label: (name, settings or {}) for label, (name, settings) in options.listed(methods, "--methods").items()
    }
    found, rows = compare_in_store(storage, variants, runs)
    units = common_units([one.units for one in found.comparison.instances if isinstance(one, Instance)])
    _write(rows, outputs, units)
    return conclude(storage, found, rows, quiet=outputs.is_standard_output_taken())


def _compare(
    methods: "dict[str, str | Allocator]", runs: store_options.MethodRuns, outputs: store_options.Outputs
) -> int:
    """Run the methods on all instances, print the rows, and return the exit code."""
    from alloc.allocators.experiments.compare import compare, share_bounds
    from alloc.allocators.runtime.interrupts import signals_set
    from alloc.problems.units import common_units

    problems = gather(runs.sources)
    units = common_units([problem.units for problem in problems])
    stop, rows, total = threading.Event(), list["Row"](), len(problems) * len(methods)
    with signals_set(stop):
        for row in compare(
            problems,
            methods,
            runs.seeds,
            objective=runs.objective,
            time_limit_s=runs.budget.time_limit_s,
            iterations=runs.budget.iterations,
            target_gap=runs.budget.target_gap,
            threads=runs.threads,
            stop=stop,
        ):
            rows.append(row)
            outcome = row.reason or f"T {labelled(number(row.makespan_mean), units.time)}, gap {percent(row.gap_mean)}"
            show_done(f"{row.instance}, {row.method}: {outcome}", len(rows), total)
    _write(share_bounds(rows), outputs, units)
    if stop.is_set():
        note(f"interrupted after {len(rows)} of {total} rows")
    complete = len(rows) == total and all(row.reason or row.runs == len(runs.seeds) for row in rows)
    served = any(row.runs for row in rows) and not any(row.unserved for row in rows)
    return 0 if complete and served else 1


def _methods(text: str) -> "dict[str, str | Allocator]":
    """Return the methods by label; those with parameters in brackets are loaded with them."""
    from alloc.allocators import describe, load

    found: dict[str, str | Allocator] = {}
    for label, (name, settings) in options.listed(text, "--methods").items():
        if name != "auto":
            describe(name)
        found[label] = name if settings is None else load(name, **settings)
    return found


def _seeds(text: str) -> list[int]:
    """Return the seeds of a list or a count: ``3`` stands for 0, 1 and 2, ``3,`` for 3 alone."""
    parts = [part.strip() for part in text.split(",")]
    parts = parts if parts[-1] else parts[:-1]
    if not parts or not all(part.isdecimal() and len(part) < 19 for part in parts):
        raise typer.BadParameter(f"{text!r} is neither a number nor a list such as 0,1,2", param_hint="'--seeds'")
    if "," in text:
        return list(dict.fromkeys(int(part) for part in parts))
    if not 1 <= int(text) <= 100_000:
        raise typer.BadParameter(f"must be 1 to 100000 seeds, got {text}", param_hint="'--seeds'")
    return list(range(int(text)))


def _write(rows: "list[Row]", outputs: store_options.Outputs, units: "Units") -> None:
    document: dict[str, object] = {"format": "alloc-comparison/1", "rows": [row.to_dict() for row in rows]}
    write_rows(document, _columns(), outputs.csv, lambda: _tell(rows, units), json=outputs.json)


def _tell(rows: "list[Row]", units: "Units") -> None:
    header = ["instance", "method", heading("T", units.time), "worst", "gap", "worst"]
    header += [heading("energy", units.energy), "time (s)", "worst", "runs", "status"]
    say(table(header, [_cells(row) for row in rows], left=2))
    for row in rows:
        if row.reason:
            note(f"{row.instance}: {row.reason}")


def _cells(row: "Row") -> list[str]:
    status = "no figures, see below" if row.reason else row.statuses
    if row.unserved:
        status += f", {row.unserved} unserved"
    return [
        row.instance,
        f"{row.method} ({row.picked})" if row.picked else row.method,
        number(row.makespan_mean, 5),
        number(row.makespan_worst, 5),
        percent(row.gap_mean),
        percent(row.gap_worst),
        number(row.energy_mean, 4),
        number(row.runtime_mean_s, 3),
        number(row.runtime_worst_s, 3),
        str(row.runs),
        status,
    ]


def _columns() -> list[str]:
    """Return the columns of the CSV: the names of the fields."""
    from dataclasses import fields

    from alloc.allocators.experiments.compare import Row

    return [field.name for field in fields(Row) if field.name != "makespans"]
