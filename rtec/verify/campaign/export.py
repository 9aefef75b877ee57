"""The records of a campaign for other programs: CSV, JUnit XML and Parquet, one row a job."""

from __future__ import annotations

import csv
import html
import io
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rtec.errors import RtecError
from rtec.io import write_lines
from rtec.verify.campaign.code import code_of
from rtec.verify.campaign.job import FAILED, NOT_ACTIVATED, Value
from rtec.verify.campaign.plan import Plan
from rtec.verify.campaign.store import Done

_NO_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
Records = Callable[[], Iterator[Done]]
"""Gives the records, as often as they are needed: there may be more than fit into memory as a table."""


def again_of(done: Done, again: str) -> str:
    """Return the command that runs one job of a campaign again."""
    return f"{again} --job {done.address}"


def _row(done: Done, again: str, plan: Plan) -> dict[str, Value]:
    """Return a record with all that is needed to repeat its job."""
    return {
        "job": done.address,
        "plan": plan.name,
        "version": code_of(done.job.function),
        "requirement": " ".join(plan.requirement_ids(done.job.parameters)),
        **done.job.parameters,
        "seed": done.job.seed,
        "run": done.job.run,
        **done.record,
        "seconds": done.seconds,
        "worker": done.worker,
        "again": again_of(done, again),
    }


def write_csv(file: Path, records: Records, again: str, plan: Plan) -> None:
    """Write a row for each job.

    Parameters
    ----------
    file
        One that exists is replaced once the new one is complete.
    records
        Of the campaign.
    again
        The command of the campaign, to which ``--job`` and the address of one job are added.
    plan
        That the records are of; it knows their requirements.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    write_rows(file, lambda: (_row(done, again, plan) for done in records()))


def write_rows(file: Path, rows: Callable[[], Iterator[Mapping[str, object]]]) -> None:
    """Write rows that need not have the same columns as CSV, with all columns of any of them.

    Parameters
    ----------
    file
        One that exists is replaced once the new one is complete.
    rows
        Gives the rows, twice.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(name for row in rows() for name in row)), lineterminator="")

    def lines() -> Iterator[str]:
        writer.writeheader()
        for row in rows():
            yield text.getvalue()
            text.seek(0)
            text.truncate()
            writer.writerow(row)
        yield text.getvalue()

    write_lines(file, lines())


def write_junit(file: Path, records: Records, again: str, plan: Plan) -> None:
    """Write JUnit XML: a test case for each job, with its parameters, its record and its command as properties.

    A job whose fault did not take effect is skipped, one that failed is a failure.

    Parameters
    ----------
    file, records, again, plan
        As of `write_csv`; the suite has the name of the plan.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    counts, seconds = {FAILED: 0, NOT_ACTIVATED: 0, "": 0}, 0.0
    for done in records():
        result = str(done.record["result"])
        counts[result if result in counts else ""] += 1
        seconds += done.seconds
    head = (
        f'tests="{sum(counts.values())}" failures="{counts[FAILED]}" errors="0" skipped="{counts[NOT_ACTIVATED]}" '
        f'time="{seconds:.3f}"'
    )

    def lines() -> Iterator[str]:
        yield '<?xml version="1.0" encoding="UTF-8"?>'
        yield f"<testsuites {head}>"
        yield f'<testsuite name="{_xml(plan.name)}" {head}>'
        for done in records():
            yield from _case(done, again, plan)
        yield "</testsuite>"
        yield "</testsuites>"

    write_lines(file, lines())


def _case(done: Done, again: str, plan: Plan) -> Iterator[str]:
    name = ", ".join([*(f"{key}={value}" for key, value in done.job.parameters.items()), f"run={done.job.run}"])
    yield f'<testcase classname="{_xml(plan.name)}" name="{_xml(name)}" time="{done.seconds:.6f}">'
    yield "<properties>"
    for key, value in _row(done, again, plan).items():
        if value not in (None, ""):
            yield f'<property name="{_xml(key)}" value="{_xml(value)}"/>'
    yield "</properties>"
    if done.record["result"] == FAILED:
        what, whole = _xml(done.record.get("outcome", FAILED)), _xml(json.dumps(done.record))
        yield f'<failure message="{what}">{whole}</failure>'
    elif done.record["result"] == NOT_ACTIVATED:
        yield f'<skipped message="{NOT_ACTIVATED}"/>'
    yield "</testcase>"


def _xml(value: object) -> str:
    return html.escape(_NO_XML.sub("?", str(value)))


def write_parquet(file: Path, records: Records, again: str, plan: Plan) -> None:
    """Write a row for each job as Parquet.

    Raises
    ------
    RtecError
        pyarrow is not installed.
    """
    try:
        import pyarrow as pa  # noqa: PLC0415 - an extra
        import pyarrow.parquet as pq  # noqa: PLC0415 - the same
    except ImportError as error:
        raise RtecError("--parquet needs pyarrow; python -m pip install 'rtec[parquet]' brings it") from error
    rows: Sequence[dict[str, Any]] = [_row(done, again, plan) for done in records()]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    pq.write_table(pa.Table.from_pylist([{name: row.get(name) for name in columns} for row in rows]), file)
