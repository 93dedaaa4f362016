"""Reading of stores for a page: all runs, with traces thinned to the resolution of the page."""

import json
import math
import os
import sqlite3
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, fields, replace
from urllib.request import pathname2url

from alloc.allocators.contract.tolerance import relative_gap
from alloc.allocators.experiments.store.errors import BUSY_S, explained
from alloc.allocators.experiments.store.key import Run
from alloc.allocators.experiments.store.outcome import Ending, TracePoints
from alloc.allocators.experiments.store.schema import checked_version
from alloc.allocators.experiments.store.store import ENDING, RUN, Record, record_of
from alloc.problems import InputError
from alloc.problems.formats.files import PathLike, named

EDGES_S = tuple(1e-3 * 10 ** (step / 20) for step in range(256))
"""Times, 20 per decade, at which traces are sampled: shares and quantiles at these times are exact."""

EVERY = 1000
"""Number of runs between two calls of the progress callback."""

Progress = Callable[[str], None]
"""Called from time to time with a description of the progress."""


@dataclass(frozen=True)
class Known:
    """An instance of a store: its name, which need not be unique, and its size."""

    name: str
    agents: int
    tasks: int


@dataclass(frozen=True)
class Archive:
    """Contents of several stores.

    Attributes
    ----------
    paths : sequence of path
    records : dict
        Runs by key, in order of their start. Of a run in several stores, the record that ended last.
    instances : dict
        Instances by the hash of their content.
    origins : dict
        Index in `paths` of the store of each run's record.
    """

    paths: Sequence[PathLike]
    records: dict[str, Record] = field(default_factory=dict)
    instances: dict[str, Known] = field(default_factory=dict)
    origins: dict[str, int] = field(default_factory=dict)

    def contents(self, wanted: Sequence[str]) -> Iterator[tuple[str, bytes]]:
        """Yield the hash and the .npz content of each wanted instance that is stored, in the given order."""
        yield from self._blobs("SELECT content FROM contents WHERE instance = ?", wanted)

    def plans(self, wanted: Sequence[str]) -> dict[str, bytes]:
        """Return the stored plans of these runs, packed, by key; each from the store of the run's record."""
        return dict(self._blobs("SELECT plan FROM plans WHERE key = ?", wanted, self.origins))

    def _blobs(
        self, query: str, wanted: Sequence[str], origins: Mapping[str, int] | None = None
    ) -> Iterator[tuple[str, bytes]]:
        """Yield the results of a query per key, in the store given by `origins`, or else in the first that has one."""
        with ExitStack() as stack:
            opened = [(stack.enter_context(_opened(path)), named(path)) for path in self.paths]
            able = {number: one for number, one in enumerate(opened) if _has_plans(one[0])}
            for key in wanted:
                for number in able if origins is None else able.keys() & {origins[key]}:
                    connection, name = able[number]
                    with explained(name):
                        row = connection.execute(query, (key,)).fetchone()
                    if row is not None:
                        yield key, row[0]
                        break


def read_stores(paths: Sequence[PathLike], progress: Progress = lambda words: None) -> Archive:
    """Return the contents of stores, which are not changed, even if an earlier version wrote them.

    Raises
    ------
    InputError
        If a file cannot be read, is damaged, of a later version, or not a store.
    """
    found: dict[str, Record] = {}
    instances: dict[str, Known] = {}
    origins: dict[str, int] = {}
    for number, path in enumerate(paths):
        with _opened(path) as connection:
            if checked_version(connection, named(path)) == 0:  # an empty file: no run has started
                continue
            for known, *about in connection.execute("SELECT instance, name, agents, tasks FROM instances"):
                instances[known] = Known(*about)
            for key, record in _records(connection):
                if key not in found or found[key].ending.finished_at < record.ending.finished_at:
                    found[key], origins[key] = record, number
                if len(found) % EVERY == 0:
                    progress(f"{len(found)} runs read")
    order = sorted(found, key=lambda key: found[key].ending.started_at)
    return Archive(paths, _with_shared_bounds({key: found[key] for key in order}), instances, origins)


def _with_shared_bounds(records: dict[str, Record]) -> dict[str, Record]:
    """Return runs with their gaps to the best bound that any run proved on the instance, as it holds for all."""
    best: dict[str, float] = {}
    for record in records.values():
        if record.ending.lower_bound is not None:
            best[record.run.instance] = max(record.ending.lower_bound, best.get(record.run.instance, 0.0))
    return {key: _against(record, best.get(record.run.instance)) for key, record in records.items()}


def _against(record: Record, bound: float | None) -> Record:
    makespan = record.ending.makespan
    if makespan is None or bound is None:
        return record
    return Record(record.run, replace(record.ending, gap=relative_gap(makespan, bound)))


def _records(connection: sqlite3.Connection) -> Iterator[tuple[str, Record]]:
    has = {row[1] for row in connection.execute("PRAGMA table_info(runs)")}
    usual = {one.name: "NULL" if one.default is None else "''" for kind in (Run, Ending) for one in fields(kind)}
    columns = ", ".join(name if name in has else f"{usual[name]} AS {name}" for name in ("key", *RUN, *ENDING))
    measures = "measures" if "measures" in has else "NULL"
    for *row, measured in connection.execute(f"SELECT {columns}, {measures} FROM runs"):
        key, record = record_of(tuple(row))
        ending = replace(record.ending, trace=thinned(record.ending.trace))
        yield key, Record(record.run, ending if measured is None else _of_mission(ending, json.loads(measured)))


def _of_mission(ending: Ending, measures: Mapping[str, float | None]) -> Ending:
    """Return the ending of a policy's run on a mission, with the mission time as the makespan."""
    time = measures.get("mission_time")
    return replace(ending, makespan=time, served_makespan=time, lower_bound=measures.get("mission_time_lower_bound"))


def _has_plans(connection: sqlite3.Connection) -> bool:
    """Return whether the version of a store has plans and the content of instances."""
    return connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'plans'").fetchone() is not None


@contextmanager
def _opened(path: PathLike) -> Iterator[sqlite3.Connection]:
    """Open a store for reading while others may write to it."""
    if not os.path.exists(path):
        raise InputError("there is no such file; check the path", source=named(path))
    with explained(named(path)):
        opened = _connected(os.path.abspath(os.fspath(path)), named(path))
    with closing(opened) as connection, explained(named(path)):
        yield connection


def _connected(place: str, name: str) -> sqlite3.Connection:
    """Return a read-only connection.

    In a read-only folder, SQLite cannot create the files that coordinate readers and writers. A store is then read as
    immutable, which is correct only while nobody writes to it: a write-ahead log beside it shows that somebody does,
    or was interrupted. Later writers are not detected.

    Raises
    ------
    InputError
        If there is such a log.
    """
    try:
        return _tried(place, "mode=ro")
    except sqlite3.OperationalError as error:
        kind = str(getattr(error, "sqlite_errorname", ""))
        if not kind.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN")) or not os.path.exists(place):
            raise
    for log in (f"{place}-wal", f"{place}-journal"):
        if os.path.exists(log) and os.path.getsize(log):
            raise InputError(
                f"is being written, or its writer was interrupted, as {os.path.basename(log)} shows, and its"
                " folder is read-only here; read it when the comparison has ended, or make the folder writable",
                source=name,
            )
    return _tried(place, "immutable=1")


def _tried(place: str, mode: str) -> sqlite3.Connection:
    """Return a connection after a first query, as SQLite does not open the file before."""
    connection = sqlite3.connect(f"file:{pathname2url(place)}?{mode}", uri=True, timeout=BUSY_S)
    try:
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    except sqlite3.Error:
        connection.close()
        raise
    return connection


def moment(time_s: float) -> int:
    """Return the index of the first of `EDGES_S` at or after a time."""
    return min(bisect_left(EDGES_S, time_s), len(EDGES_S) - 1)


def thinned(trace: TracePoints) -> TracePoints:
    """Return the last point of a trace up to each of `EDGES_S`, so that values at these times do not change."""
    last = {moment(point[0]): point for point in trace if math.isfinite(point[0])}
    return tuple(last.values())
