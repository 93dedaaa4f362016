"""Tables of a store, and migrations from older versions."""

import sqlite3

from alloc.problems import InputError

APPLICATION = 0x616C6C6F
"""Application id of stores (``PRAGMA application_id``): "allo"."""

MIGRATIONS: tuple[str, ...] = (
    """
    CREATE TABLE runs (
        key TEXT PRIMARY KEY,
        instance TEXT NOT NULL,
        method TEXT NOT NULL,
        parameters TEXT NOT NULL,
        seed INTEGER NOT NULL,
        objective TEXT NOT NULL,
        time_limit_s REAL,
        iterations INTEGER,
        target_gap REAL,
        threads INTEGER NOT NULL,
        version TEXT NOT NULL,
        machine TEXT NOT NULL,
        outcome TEXT NOT NULL,
        reason TEXT NOT NULL,
        details TEXT NOT NULL,
        exit_code INTEGER,
        picked TEXT NOT NULL,
        status TEXT NOT NULL,
        stop_reason TEXT NOT NULL,
        makespan REAL,
        served_makespan REAL,
        lower_bound REAL,
        gap REAL,
        energy REAL,
        energy_lower_bound REAL,
        energy_gap REAL,
        distance REAL,
        battery_remaining_percent REAL,
        reward REAL,
        unserved INTEGER,
        runtime_s REAL,
        wall_s REAL NOT NULL,
        cpu_s REAL,
        memory_mb REAL NOT NULL,
        memory_limit_mb REAL NOT NULL,
        cores TEXT NOT NULL,
        at_once INTEGER NOT NULL,
        started_at REAL NOT NULL,
        finished_at REAL NOT NULL,
        trace TEXT NOT NULL
    ) WITHOUT ROWID;
    CREATE TABLE instances (
        instance TEXT PRIMARY KEY,
        name TEXT NOT NULL,
        agents INTEGER NOT NULL,
        tasks INTEGER NOT NULL
    ) WITHOUT ROWID;
    CREATE TABLE leases (
        key TEXT PRIMARY KEY,
        owner TEXT NOT NULL,
        expires_at REAL NOT NULL
    ) WITHOUT ROWID;
    """,
    """
    ALTER TABLE runs ADD COLUMN knowledge TEXT NOT NULL DEFAULT '';
    ALTER TABLE runs ADD COLUMN deadline_ms REAL;
    ALTER TABLE runs ADD COLUMN measures TEXT;
    ALTER TABLE runs ADD COLUMN host TEXT NOT NULL DEFAULT '';
    """,
    """
    ALTER TABLE runs ADD COLUMN revision TEXT NOT NULL DEFAULT '';
    CREATE TABLE plans (key TEXT PRIMARY KEY, plan BLOB NOT NULL);
    CREATE TABLE contents (instance TEXT PRIMARY KEY, content BLOB NOT NULL);
    """,
)
"""Migrations from each version to the next; the version of a file (``PRAGMA user_version``) is their number."""


def checked_version(connection: sqlite3.Connection, path: str) -> int:
    """Return the version of a file, 0 for an empty one; raise an error if it is not a store or of a later version."""
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if application != APPLICATION and (version or application or tables):
        raise InputError("is a database of another program; name another file", source=path)
    if version > len(MIGRATIONS):
        raise InputError(
            f"is a store of version {version}, made by a later version of alloc; this one knows up to "
            f"{len(MIGRATIONS)}: update alloc, or name another file",
            source=path,
        )
    return int(version)
