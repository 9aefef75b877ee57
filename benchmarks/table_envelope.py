"""The tables of docs/envelope.md: each design on each processor, and without a processor's limits.

Example::

    python benchmarks/table_envelope.py
    python benchmarks/table_envelope.py -o docs/envelope.md
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import sys
from collections.abc import Iterator
from pathlib import Path

from into_page import print_or_write

from rtec.board import MICROCONTROLLERS
from rtec.cli import main as rtec
from rtec.injector import Design
from rtec.readable import hertz_text
from rtec.verify.envelope.rows import EnvelopePlan, EnvelopeRow, find_envelope

HEADINGS = (
    "processor",
    "design",
    "500 kHz",
    "inserts to",
    "passes to",
    "safe to",
    "limited by",
    "jitter",
    "from steady motion",
)
WITHOUT_PROCESSOR = (["original"], ["a"], ["b"], ["c"], ["c", "--real-edges", "merge"])


def hertz(value: float) -> str:
    return hertz_text(value, 4) if value else "none"


def cells(row: EnvelopeRow) -> list[str]:
    """Return the cells of a row of `rtec envelope`; accelerations are those at counts of 1 µm."""
    found, jitter_ps = row.speeds.frequencies, row.speeds.max_jitter_ps
    ramp = row.max_acceleration_counts_s2
    beyond = "beyond " if found.max_passing_hz >= found.searched_to_hz else ""
    return [
        row.processor.name,
        row.design.short,
        row.speeds.at_top.value,
        hertz(found.max_inserting_hz),
        beyond + hertz(found.max_passing_hz),
        hertz(row.max_safe_hz),
        row.limited_by.value,
        "–" if jitter_ps is None else f"{jitter_ps * 1e-3:.3g} ns",
        "–" if ramp is None else f"{float(f'{ramp * 1e-6:.3g}'):.10g} m/s²",
    ]


def table(headings: tuple[str, ...], rows: list[list[str]]) -> str:
    """Return a table in Markdown."""
    head = f"| {' | '.join(headings)} |\n|{'---|' * len(headings)}\n"
    return head + "".join(f"| {' | '.join(row)} |\n" for row in rows)


def without_processor(words: list[str]) -> list[str]:
    """Return what the data sheet of `rtec check` says of a design: frequency, jitter, acceleration."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        rtec(["check", *words, "--json"])
    sheet = json.loads(out.getvalue())["data_sheet"]
    jitter = sheet["jitter"].rpartition("(")[2].rstrip(")")
    return [" ".join(words), sheet["frequency"], jitter, sheet["acceleration"].partition(" (")[0]]


def tables() -> Iterator[str]:
    """Yield the two tables."""
    plan = EnvelopePlan(designs=tuple(Design), processors=tuple(MICROCONTROLLERS.values()))
    yield table(HEADINGS, [cells(row) for row in find_envelope(plan)])
    yield "\nThe designs without a processor's limits, as in an FPGA:\n\n"
    yield table(("`rtec check`", "frequency", "jitter", "acceleration"), [*map(without_processor, WITHOUT_PROCESSOR)])
    yield "\n"


def main() -> int:
    """Print the tables, or put them into a page."""
    parser = argparse.ArgumentParser(description="Write the tables of the envelope.")
    parser.add_argument("-o", "--output", type=Path, help="page in which they stand between two comments")
    print_or_write(parser, parser.parse_args().output, "table_envelope", lambda: "".join(tables()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
