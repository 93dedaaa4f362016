"""Report of stores as one self-contained HTML file."""

import json
import os
import time
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from importlib.resources import files

from alloc.allocators.experiments.report.page.details import MAX_TRACES, details, rounded
from alloc.allocators.experiments.report.page.encode import compressed
from alloc.allocators.experiments.report.page.groups import Layout, laid_out
from alloc.allocators.experiments.report.page.libraries import libraries, require_packages
from alloc.allocators.experiments.report.page.series import series
from alloc.allocators.experiments.report.page.source import EDGES_S, Archive, Progress, read_stores
from alloc.allocators.experiments.report.page.summary import Entry, conditions, methods, notes, paired
from alloc.allocators.experiments.store.outcome import Outcome
from alloc.allocators.plan.palette import SERIES
from alloc.problems import InputError
from alloc.problems.formats import check_writable, write_text_atomically
from alloc.problems.formats.files import PathLike, is_stream, named
from alloc.problems.text import one_line

DETAIL_BYTES, DETAIL_BYTES_A_RUN = 1_500_000, 150
"""Maximum size of maps and traces on a page: a constant, and an addition per run."""

MAX_FAILURES = 500
"""Maximum number of distinct failures whose tracebacks are on a page, the most frequent first."""

FIGURES = ("makespan", "served_makespan", "lower_bound", "gap", "energy", "runtime_s", "cpu_s", "memory_mb", "unserved")
"""Fields of an ending that are columns of the table of runs."""

SUFFIX = ".html"

PARTS = ("report.html.jinja", "report.css", "charts.js", "tables.js", "map.js", "instance.js", "report.js")
"""Files beside this module: the template, the style, and the scripts in order of execution."""

GREY = "#999999"
"""The eighth colour of methods, as the palette has no further colour that is visible on white."""


def check_page(path: PathLike) -> None:
    """Raise an error if a page cannot be written because of its suffix, a missing package, or its location."""
    if not os.fspath(path).lower().endswith(SUFFIX) or is_stream(path):
        raise InputError(f"must end in {SUFFIX}", source=named(path, output=True))
    require_packages()
    check_writable(path)


def report_html(
    stores: Sequence[PathLike],
    output: PathLike,
    *,
    title: str | None = None,
    against: str | None = None,
    progress: Progress = lambda words: None,
) -> int:
    """Write a report of all runs in stores as one self-contained HTML page.

    It contains tables of runs and methods, paired statistics, performance profiles, convergence, trade-offs, scaling,
    gaps, failures, and maps of the plans.

    Parameters
    ----------
    stores : sequence of str or path
        Files of ``alloc compare --store``. They are only read, and may be written by others at the same time.
    output : str or path
        A file that ends in ``.html``; written atomically.
    title : str, optional
        Title of the page; by default the names of the stores.
    against : str, optional
        Method, as written in the tables, that all others are compared with; by default all pairs are compared or, if
        there are too many, all methods with the first one.
    progress : callable, optional
        Called from time to time with a description of the progress.

    Returns
    -------
    int
        Number of runs.

    Raises
    ------
    InputError
        If a store cannot be read, `against` is not a method in it, or the page cannot be written.
    MissingPackageError
        If Jinja2, vl-convert-python or itables is not installed.
    """
    check_page(output)
    if not stores:
        raise InputError("must name at least one store", "stores")
    archive = read_stores(stores, progress)
    layout = laid_out(archive)
    if against is not None and against not in layout.labels:
        raise InputError(f"{against!r} is not among the methods {', '.join(layout.labels) or '(none)'}", "against")
    heading = one_line(title) if title else "Runs of " + ", ".join(os.path.basename(named(path)) for path in stores)
    write_text_atomically(output, _rendered(heading, _contents(archive, layout, heading, against, progress)))
    return len(archive.records)


def _contents(
    archive: Archive, layout: Layout, heading: str, against: str | None, progress: Progress
) -> dict[str, str]:
    """Return the data of the page by element id."""
    groups = []
    for number, group in enumerate(layout.groups, 1):
        progress(f"statistics of {number} of {len(layout.groups)} conditions")
        told: Entry = {"conditions": conditions(group), "methods": methods(group), "notes": notes(group)}
        groups.append({**told, "paired": paired(layout, group, against), "series": series(layout, group)})
    names = len(layout.names)
    room = DETAIL_BYTES + DETAIL_BYTES_A_RUN * len(archive.records)
    chunks, chunk_of = details(archive, layout, room, lambda count: progress(f"{count} of {names} instances"))
    failures, failure_of = _failures(archive, layout)
    main = {
        "title": heading,
        "stores": [one_line(named(path)) for path in archive.paths],
        "made": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
        "version": version("alloc-mrta"),
        "colours": (*SERIES, GREY),
        "labels": layout.labels,
        "edges_s": EDGES_S,
        "most_traces": MAX_TRACES,
        "instances": {
            "name": layout.names,
            "agents": [one.agents for one in layout.known],
            "tasks": [one.tasks for one in layout.known],
            "chunk": [chunk_of.get(number, -1) for number in range(names)],
        },
        "groups": groups,
        "failures": failures,
    }
    data = {"main": main, "runs": _columns(archive, layout, failure_of)}
    found = {name: compressed(_json(value)) for name, value in data.items()}
    return found | {f"detail-{number}": chunk for number, chunk in enumerate(chunks)}


def _json(value: object) -> str:
    return json.dumps(_short(value), allow_nan=False, separators=(",", ":"))


def _short(value: object) -> object:
    """Return a value with all numbers in it rounded to six significant digits."""
    if isinstance(value, float):
        return rounded(value)
    if isinstance(value, dict):
        return {key: _short(item) for key, item in value.items()}
    return [_short(item) for item in value] if isinstance(value, list | tuple) else value


def _columns(archive: Archive, layout: Layout, failure_of: dict[str, int]) -> Entry:
    """Return all runs as columns, with repeated values encoded as numbers."""
    endings = [record.ending for record in archive.records.values()]
    places = [layout.places[key] for key in archive.records]
    found: Entry = {
        name: [getattr(place, name) for place in places] for name in ("group", "method", "instance", "seed")
    }
    found |= {name: [getattr(ending, name) for ending in endings] for name in FIGURES}
    found |= {name: [str(getattr(ending, name)) for ending in endings] for name in ("outcome", "status", "stop_reason")}
    found["started"] = [round(ending.started_at) for ending in endings]
    found["failure"] = [failure_of.get(key, -1) for key in archive.records]
    return found


def _failures(archive: Archive, layout: Layout) -> tuple[list[Entry], dict[str, int]]:
    """Return distinct failures, the most frequent first, and the number of the failure of each run."""
    kinds = {
        key: (layout.places[key].group, layout.places[key].method, record.ending)
        for key, record in archive.records.items()
        if record.ending.outcome is not Outcome.SOLVED
    }
    same = {key: (group, method, one.outcome, one.reason, one.details) for key, (group, method, one) in kinds.items()}
    count = Counter(same.values())
    number = {kind: place for place, (kind, _) in enumerate(count.most_common(MAX_FAILURES))}
    first: dict[object, str] = {}
    for key, kind in same.items():
        first.setdefault(kind, key)
    found: list[Entry] = [
        {
            "group": kind[0],
            "method": kind[1],
            "outcome": str(kind[2]),
            "reason": kind[3],
            "details": kind[4],
            "runs": count[kind],
            "instance": layout.places[first[kind]].instance,
            "seed": layout.places[first[kind]].seed,
        }
        for kind in number
    ]
    return found, {key: number[kind] for key, kind in same.items() if kind in number}


def _rendered(heading: str, data: dict[str, str]) -> str:
    from jinja2 import Environment, StrictUndefined

    own = files(__package__)
    template, style, *scripts = ((own / name).read_text(encoding="utf-8") for name in PARTS)
    frame = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    values = {"title": heading, "data": {**libraries(), **data}, "style": style, "scripts": scripts}
    return str(frame.from_string(template).render(values))
