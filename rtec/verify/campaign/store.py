"""The store of a campaign: one file, the only truth about which jobs are done.

It is written by the coordinator only, a transaction a batch, in the write-ahead mode of SQLite: a process that is
killed leaves whole transactions. The content address is the key, so that a job counts once, whoever made it.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from rtec.errors import FileFormatError, OutputError
from rtec.verify.campaign.job import Job, Record

FORMAT = 1
"""Of the tables; another one is refused."""
_APPLICATION = 0x52544543
"""Marks the file as a store of rtec, in the header of SQLite."""
_WAIT_S = 120.0
"""For another coordinator's transaction."""
_AT_ONCE = 500
_TABLES = (
    "CREATE TABLE codes (id INTEGER PRIMARY KEY, code TEXT NOT NULL UNIQUE)",
    "CREATE TABLE records (address TEXT PRIMARY KEY, function TEXT NOT NULL, parameters TEXT NOT NULL, "
    "seed INTEGER NOT NULL, run INTEGER NOT NULL, code INTEGER NOT NULL REFERENCES codes, record TEXT NOT NULL, "
    "seconds REAL NOT NULL, worker TEXT NOT NULL) WITHOUT ROWID",
)


@dataclass(frozen=True, slots=True)
class Done:
    """A job with its record."""

    address: str
    job: Job
    record: Record
    seconds: float
    """That it took."""
    worker: str
    """Host and process that carried it out."""


class Store:
    """A file of records, opened or made; a context.

    Parameters
    ----------
    path
        Of the file; beside it SQLite keeps two more while it is open. Not on a network file system.

    Raises
    ------
    FileFormatError
        The file is something else, or a store of another version.
    OutputError
        It cannot be opened or written.

    Examples
    --------
    >>> job = Job("package.module:function", {"design": "c"}, seed=1, run=0)
    >>> done = Done(job.address("code"), job, {"result": "passed"}, 0.5, "here")
    >>> with Store(":memory:") as store:
    ...     store.put([done, done], code="code"), list(store.records([done.address])) == [done]
    (1, True)
    """

    def __init__(self, path: Path | str) -> None:
        self.path = path
        try:
            self._connection = sqlite3.connect(path, timeout=_WAIT_S, isolation_level=None)
        except sqlite3.OperationalError as error:
            raise OutputError(f"{path}: {error}; name a file in a folder that exists and can be written") from error
        try:
            with self._said():
                self._open()
        except BaseException:
            self._connection.close()
            raise

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._connection.close()

    def _open(self) -> None:
        run = self._connection.execute
        if run("PRAGMA journal_mode = WAL").fetchone()[0] not in ("wal", "memory"):
            raise OutputError(
                f"{self.path}: the file system does not allow SQLite's write-ahead mode; use a local one"
            )
        run("PRAGMA synchronous = NORMAL")
        with self._transaction():
            found = run("PRAGMA application_id").fetchone()[0], run("PRAGMA user_version").fetchone()[0]
            if found == (0, 0) and run("SELECT count(*) FROM sqlite_master").fetchone()[0] == 0:
                for table in _TABLES:
                    run(table)
                run(f"PRAGMA application_id = {_APPLICATION}")
                run(f"PRAGMA user_version = {FORMAT}")
                return
        if found[0] != _APPLICATION:
            raise FileFormatError(
                self.path, None, "a database of another program", "a store of rtec campaign, or a new file"
            )
        if found[1] != FORMAT:
            raise FileFormatError(
                self.path, None, f"a store of format {found[1]}, made by another version of rtec",
                f"format {FORMAT}; name another file with --store",
            )  # fmt: skip

    @contextmanager
    def _said(self) -> Iterator[None]:
        """Say what SQLite refuses, in the words of rtec."""
        try:
            yield
        except sqlite3.DatabaseError as error:
            if "not a database" in str(error) or "malformed" in str(error):
                raise FileFormatError(
                    self.path, None, str(error), "a store of rtec campaign, or a new file"
                ) from error
            raise OutputError(
                f"{self.path}: {error}; what was stored before is whole, the same command resumes"
            ) from error

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._connection.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            if self._connection.in_transaction:  # a full disk has rolled it back already
                self._connection.execute("ROLLBACK")
            raise
        self._connection.execute("COMMIT")

    def put(self, done: Iterable[Done], *, code: str) -> int:
        """Store records in one transaction; those that are there already stay. Return how many are new.

        Raises
        ------
        OutputError
            They cannot be written: the disk is full.
        """
        with self._said(), self._transaction():
            run, before = self._connection.execute, self._connection.total_changes
            run("INSERT OR IGNORE INTO codes (code) VALUES (?)", (code,))
            number = run("SELECT id FROM codes WHERE code = ?", (code,)).fetchone()[0]
            before = self._connection.total_changes
            self._connection.executemany(
                "INSERT OR IGNORE INTO records VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    (
                        one.address, one.job.function, json.dumps(one.job.parameters), one.job.seed, one.job.run,
                        number, json.dumps(one.record), one.seconds, one.worker,
                    )
                    for one in done
                ),
            )  # fmt: skip
            return self._connection.total_changes - before

    def known(self, addresses: Sequence[str]) -> set[str]:
        """Return which of these are there."""
        with self._said():
            return {row[0] for row in self._of("address", addresses)}

    def records(self, addresses: Sequence[str]) -> Iterator[Done]:
        """Yield the records of these, in their order as far as they are there."""
        columns = "address, function, parameters, seed, run, record, seconds, worker"
        for begin in range(0, len(addresses), _AT_ONCE):
            some = addresses[begin : begin + _AT_ONCE]
            with self._said():
                rows = {row[0]: row for row in self._of(columns, some)}
            for address in some:
                if address in rows:
                    _, function, parameters, seed, run, record, seconds, worker = rows[address]
                    job = Job(function, json.loads(parameters), seed, run)
                    yield Done(address, job, json.loads(record), seconds, worker)

    def _of(self, columns: str, addresses: Sequence[str]) -> Iterator[tuple[Any, ...]]:
        for begin in range(0, len(addresses), _AT_ONCE):
            some = addresses[begin : begin + _AT_ONCE]
            marks = ",".join("?" * len(some))
            # columns are our own words, values are bound
            yield from self._connection.execute(f"SELECT {columns} FROM records WHERE address IN ({marks})", some)  # noqa: S608 - as said

    def of_other_code(self, code: str) -> int:
        """Return how many records other code made: another version, other kernels, another processor."""
        with self._said():
            row = self._connection.execute(
                "SELECT count(*) FROM records JOIN codes ON records.code = codes.id WHERE codes.code != ?", (code,)
            ).fetchone()
        return int(row[0])

    def merge(self, other: Path) -> int:
        """Take over the records of another store; return how many are new.

        Raises
        ------
        FileFormatError
            The other file is no store of this format.
        """
        with Store(other) as theirs:
            added = 0
            for number, code in theirs._connection.execute("SELECT id, code FROM codes").fetchall():
                rows = theirs._connection.execute("SELECT address FROM records WHERE code = ?", (number,)).fetchall()
                added += self.put(theirs.records([row[0] for row in rows]), code=code)
        return added
