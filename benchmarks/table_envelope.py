"""A table of docs/envelope.md: the designs without a processor's limits.

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
from pathlib import Path

from into_page import print_or_write

from rtec.cli import main as rtec

WITHOUT_PROCESSOR = (["original"], ["a"], ["b"], ["c"], ["c", "--real-edges", "merge"])


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


def tables() -> str:
    """Return the table."""
    rows = [*map(without_processor, WITHOUT_PROCESSOR)]
    return table(("`rtec check`", "frequency", "jitter", "acceleration"), rows) + "\n"


def main() -> int:
    """Print the table, or put it into a page."""
    parser = argparse.ArgumentParser(description="Write the table of the designs.")
    parser.add_argument("-o", "--output", type=Path, help="page in which it stands between two comments")
    print_or_write(parser, parser.parse_args().output, "table_envelope", tables)
    return 0


if __name__ == "__main__":
    sys.exit(main())
