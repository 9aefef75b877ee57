"""Tables that a script prints, or writes into a page between two comments."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path


def marks(script: str) -> tuple[str, str]:
    """Return the comments between which the tables of a script stand."""
    return f"<!-- tables of benchmarks/{script}.py -->\n", f"<!-- end of the tables of benchmarks/{script}.py -->\n"


def print_or_write(
    parser: argparse.ArgumentParser, output: Path | None, script: str, tables: Callable[[], str]
) -> None:
    """Print tables, or write them into a page, which is looked at before they are made."""
    begin, end = marks(script)
    page = "" if output is None else output.read_text(encoding="utf-8")
    if output is not None and not 0 <= page.find(begin) < page.find(end):
        parser.error(f"argument -o: {output} lacks the lines {begin.strip()} and {end.strip()}")
    text = tables()
    if output is None:
        sys.stdout.write(text)
        return
    before, _, rest = page.partition(begin)
    _, _, after = rest.partition(end)
    output.write_text(f"{before}{begin}\n{text}{end}{after}", encoding="utf-8")
