"""Export of all runs of a comparison, one row each: as CSV, or as Parquet with traces."""

import csv
import io
from dataclasses import asdict
from importlib.util import find_spec
from typing import get_type_hints

from alloc.allocators.experiments.store.key import MISSION, Run
from alloc.allocators.experiments.store.outcome import Ending
from alloc.allocators.experiments.stored import Comparison, Endings
from alloc.allocators.experiments.stored_missions import result_of
from alloc.problems import MissingPackageError, MissionResult

NAMES = ("instance_name", "label")
"""Columns before those of `Run` and `Ending`: the name of the instance, and the label of the method."""

LONG = ("details", "trace")
"""Fields that are left out of the CSV."""

TRACE = ("time_s", "makespan", "energy", "lower_bound")


def require_pyarrow() -> None:
    """Raise a `MissingPackageError` if pyarrow is not installed."""
    if find_spec("pyarrow") is None:
        raise MissingPackageError("Parquet needs pyarrow; install with: pip install 'alloc-mrta[parquet]'", "report")


def run_rows(comparison: Comparison, endings: Endings) -> list[dict[str, object]]:
    """Return a row for each run that has ended, with the fields of `Run` and `Ending`."""
    rows = []
    for (number, label, seed), job in comparison.jobs.items():
        ending = endings[label][number][comparison.seeds.index(seed)]
        if ending is not None:
            names = {"instance_name": comparison.instances[number].name, "label": label}
            measures = asdict(result_of(ending)) if ending.measures else {}
            row = {**names, **asdict(job.run), **asdict(ending), "outcome": str(ending.outcome)}
            rows.append(measures | row)
    return rows


def _columns(comparison: Comparison) -> dict[str, object]:
    """Return the types of the columns by name: the fields of `Run` and `Ending` and, for missions, the measures."""
    is_of_missions = any(job.run.objective == MISSION for job in comparison.jobs.values())
    measures = get_type_hints(MissionResult) if is_of_missions else {}
    hints = {**dict.fromkeys(NAMES, str), **get_type_hints(Run), **get_type_hints(Ending), **measures}
    return {name: hint for name, hint in hints.items() if name != "measures"}


def runs_csv(comparison: Comparison, endings: Endings) -> str:
    """Return CSV with a header and a line per run, without traces; None becomes an empty cell."""
    columns = [name for name in _columns(comparison) if name not in LONG]
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n", extrasaction="ignore")
    writer.writeheader()
    writer.writerows(run_rows(comparison, endings))
    return text.getvalue()


def runs_parquet(comparison: Comparison, endings: Endings) -> bytes:
    """Return a Parquet file of all runs, in which a trace is a list of points.

    Raises
    ------
    MissingPackageError
        If pyarrow is not installed.
    """
    require_pyarrow()
    import pyarrow
    import pyarrow.parquet

    point = pyarrow.struct([(name, pyarrow.float64()) for name in TRACE])
    kinds = {int: pyarrow.int64(), float: pyarrow.float64()}
    hints = {**_columns(comparison), "trace": list}
    columns = {
        name: pyarrow.list_(point)
        if hint is list
        else next((kind for plain, kind in kinds.items() if hint in (plain, plain | None)), pyarrow.string())
        for name, hint in hints.items()
    }
    rows = run_rows(comparison, endings)
    for row in rows:
        row["trace"] = [dict(zip(TRACE, one, strict=True)) for one in row["trace"]]  # type: ignore[attr-defined]
    buffer = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows, schema=pyarrow.schema(columns)), buffer)
    return buffer.getvalue()
