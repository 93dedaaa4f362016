"""The store: endings of runs as rows of one file, and leases on runs in progress."""

import json
import os
import sqlite3
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from types import TracebackType
from typing import Self

from alloc.allocators.experiments.store.errors import BUSY_S, explained
from alloc.allocators.experiments.store.key import Run, fingerprint, fingerprint_of
from alloc.allocators.experiments.store.outcome import TRANSIENT, Ending, Outcome
from alloc.allocators.experiments.store.owner import is_gone, this_process
from alloc.allocators.experiments.store.schema import APPLICATION, MIGRATIONS, checked_version
from alloc.problems import InputError, Instance, Mission
from alloc.problems.formats.files import PathLike, named
from alloc.problems.formats.npz import to_npz

LEASE_S = 60.0
"""Duration of a lease, unless renewed, of a process that cannot be observed."""

MAX_KEYS = 500
"""Maximum number of keys in a query, as SQLite limits the parameters of a statement."""

LIMITS = ("time_limit_s", "iterations", "target_gap", "deadline_ms")

CONDITIONS = ("objective", *LIMITS, "threads", "version", "machine", "knowledge")
"""Fields that all runs of a comparison share, except for the versions of plugins."""

RUN = tuple(field.name for field in fields(Run))
ENDING = tuple(field.name for field in fields(Ending))


@dataclass(frozen=True)
class Record:
    """A row of the store: a run and its ending."""

    run: Run
    ending: Ending


@dataclass(frozen=True)
class Claim:
    """Result of claiming a run.

    Attributes
    ----------
    key : str or None
        The claimed run; None if all runs have ended or are leased by others.
    done : frozenset of str
        Requested runs that have ended, here or elsewhere.
    """

    key: str | None
    done: frozenset[str]


class Store:
    """Runs in a file; a context manager. For a single thread; any number of processes may open the same file.

    Each ending is one transaction, which is on disk when `finish` returns. A run in progress has a lease, which ends
    with its process on the same machine, and `LEASE_S` after the last renewal elsewhere.

    Parameters
    ----------
    path : str or path
        Created if it does not exist. WAL mode, which lets others read while one process writes, needs a local file
        system.
    again : collection of Outcome
        Outcomes that are retried once, if runs ended with them before the store was opened.

    Raises
    ------
    InputError
        If the file cannot be read or written, is locked, damaged, of a later version, or not a store; raised by all
        methods.
    """

    def __init__(self, path: PathLike, again: Collection[Outcome] = ()) -> None:
        self.path = named(path, output=True)
        self.again = frozenset(again) | TRANSIENT
        self.owner = this_process()
        self._opened_at = time.time()
        with explained(self.path):
            self._connection = sqlite3.connect(os.fspath(path), timeout=BUSY_S, isolation_level=None)
            try:
                self._prepare()
            except BaseException:
                self._connection.close()
                raise

    def _prepare(self) -> None:
        self._connection.execute("BEGIN")  # a consistent snapshot, even while another process initialises the file
        version = checked_version(self._connection, self.path)
        self._connection.execute("COMMIT")
        self._use_wal()
        self._connection.execute("PRAGMA synchronous = NORMAL")  # a lease need not survive a power failure
        if version == len(MIGRATIONS):
            return
        with self._transaction():
            known = checked_version(self._connection, self.path)  # another process may have been faster
            for script in MIGRATIONS[known:]:
                for statement in filter(str.strip, script.split(";")):
                    self._connection.execute(statement)
            self._connection.execute(f"PRAGMA application_id = {APPLICATION}")
            self._connection.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")

    def _use_wal(self) -> None:
        """Switch to WAL mode; retry, as SQLite does not wait if several processes switch at once."""
        limit = time.monotonic() + BUSY_S
        while True:
            try:
                self._connection.execute("PRAGMA journal_mode = WAL")
                return
            except sqlite3.OperationalError as error:
                if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > limit:
                    raise
            time.sleep(0.01)

    def add(self, problem: Instance | Mission) -> str:
        """Store the name and size of a problem, and the content of an instance; return the hash of the content."""
        content = None if isinstance(problem, Mission) else to_npz(problem)
        known = fingerprint(problem) if content is None else fingerprint_of(content)
        sized = problem.instance if isinstance(problem, Mission) else problem
        row = (known, problem.name, sized.n, sized.m)
        with self._transaction():
            self._connection.execute("INSERT OR REPLACE INTO instances VALUES (?, ?, ?, ?)", row)
            if content is not None:
                self._connection.execute("INSERT OR IGNORE INTO contents VALUES (?, ?)", (known, content))
        return known

    def claim(self, keys: Sequence[str]) -> Claim:
        """Take a lease on the first of these runs that has neither ended nor a lease."""
        done: set[str] = set()
        with self._transaction():
            for start in range(0, len(keys), MAX_KEYS):
                part = keys[start : start + MAX_KEYS]
                ended, leased = self._ended(part), self._leased(part)
                done |= ended
                free = next((key for key in part if key not in ended and key not in leased), None)
                if free is not None:
                    lease = (free, self.owner, time.time() + LEASE_S)
                    self._connection.execute("INSERT OR REPLACE INTO leases VALUES (?, ?, ?)", lease)
                    return Claim(free, frozenset(done))
        return Claim(None, frozenset(done))

    def _ended(self, keys: Sequence[str]) -> set[str]:
        """Return the runs that have ended, without those to be retried."""
        rows = self._connection.execute(
            f"SELECT key, outcome, finished_at FROM runs WHERE key IN ({_marks(keys)})", keys
        )
        return {key for key, outcome, at in rows if outcome not in self.again or at >= self._opened_at}

    def _leased(self, keys: Sequence[str]) -> set[str]:
        """Return the runs with a valid lease."""
        rows = self._connection.execute(
            f"SELECT key, owner, expires_at FROM leases WHERE key IN ({_marks(keys)})", keys
        )
        now = time.time()
        return {key for key, owner, expires_at in rows if expires_at > now and not is_gone(owner)}

    def renew(self) -> None:
        """Extend all leases of this process."""
        with self._transaction():
            self._connection.execute(
                "UPDATE leases SET expires_at = ? WHERE owner = ?", (time.time() + LEASE_S, self.owner)
            )

    def release(self, key: str) -> None:
        """Release the lease on a run that did not end."""
        with self._transaction():
            self._connection.execute("DELETE FROM leases WHERE key = ? AND owner = ?", (key, self.owner))

    def finish(self, run: Run, ending: Ending, plan: bytes | None = None) -> bool:
        """Write the ending of a run, in one transaction.

        Parameters
        ----------
        run : Run
        ending : Ending
        plan : bytes, optional
            Allocation of the run; see `packed`.

        Returns
        -------
        bool
            False, and nothing is written, if the lease had expired and another process has claimed or finished the run.
        """
        key = run.key
        with self._transaction(durable=True):
            held = self._connection.execute("SELECT owner FROM leases WHERE key = ?", (key,)).fetchone()
            if held is None or held[0] != self.owner:
                return False
            values = {**asdict(run), **asdict(ending), "key": key, "outcome": str(ending.outcome)}
            values["trace"] = json.dumps(ending.trace)
            columns = ("key", *RUN, *ENDING)
            self._connection.execute(
                f"INSERT OR REPLACE INTO runs ({', '.join(columns)}) VALUES ({_marks(columns)})",
                [values[column] for column in columns],
            )
            self._connection.execute("DELETE FROM plans WHERE key = ?", (key,))
            if plan is not None:
                self._connection.execute("INSERT INTO plans VALUES (?, ?)", (key, plan))
            self._connection.execute("DELETE FROM leases WHERE key = ?", (key,))
        return True

    def records(self, keys: Sequence[str] | None = None) -> dict[str, Record]:
        """Return the runs that have ended, by key: all, or those in `keys`."""
        found: dict[str, Record] = {}
        columns = ", ".join(("key", *RUN, *ENDING))
        with explained(self.path):
            if keys is None:
                found |= map(record_of, self._connection.execute(f"SELECT {columns} FROM runs"))
            for start in range(0, len(keys or ()), MAX_KEYS):
                part = (keys or ())[start : start + MAX_KEYS]
                rows = self._connection.execute(f"SELECT {columns} FROM runs WHERE key IN ({_marks(part)})", part)
                found |= map(record_of, rows)
        return found

    def settings(self) -> dict[tuple[object, ...], int]:
        """Return the number of runs with each combination of `CONDITIONS`."""
        columns = ", ".join(CONDITIONS)
        with explained(self.path):
            rows = self._connection.execute(f"SELECT {columns}, count(*) FROM runs GROUP BY {columns}").fetchall()
        return {tuple(row[:-1]): int(row[-1]) for row in rows}

    def leases(self) -> dict[str, str]:
        """Return the owners of leases by key, including expired leases."""
        with explained(self.path):
            return dict(self._connection.execute("SELECT key, owner FROM leases").fetchall())

    @contextmanager
    def _transaction(self, *, durable: bool = False) -> Iterator[None]:
        """Run a block as one transaction; a durable one survives a power failure once it is complete."""
        with explained(self.path):
            if durable:
                self._connection.execute("PRAGMA synchronous = FULL")
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:  # some errors, such as a full disk, end the transaction
                    self._connection.execute("ROLLBACK")
                raise
            finally:
                if durable:
                    self._connection.execute("PRAGMA synchronous = NORMAL")

    def close(self) -> None:
        """Release all leases of this process and close the file."""
        try:
            with self._transaction():
                self._connection.execute("DELETE FROM leases WHERE owner = ?", (self.owner,))
        finally:
            self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
            return
        try:
            self.close()
        except InputError:  # the original error is more informative
            self._connection.close()


def _marks(values: Collection[str]) -> str:
    return ", ".join("?" * len(values))


def record_of(row: tuple[object, ...]) -> tuple[str, Record]:
    """Return the key and the run in a row of the columns ``key``, `RUN` and `ENDING`."""
    run = Run(**dict(zip(RUN, row[1:], strict=False)))  # type: ignore[arg-type]
    values = dict(zip(ENDING, row[1 + len(RUN) :], strict=True))
    values["outcome"] = Outcome(str(values["outcome"]))
    values["trace"] = tuple(map(tuple, json.loads(str(values["trace"]))))
    return str(row[0]), Record(run, Ending(**values))  # type: ignore[arg-type]
