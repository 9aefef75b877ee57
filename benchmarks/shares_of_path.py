"""Models of motion that saw 5, 20 and 100 % of the training half of a log, in free run over its other half.

Example::

    python benchmarks/shares_of_path.py emps_train.csv
    python benchmarks/shares_of_path.py emps_train.csv -o docs/predictors.md
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from into_page import print_or_write

from rtec.dataset.dynamic_log import dynamic_log
from rtec.training.compare_dynamic import compare_dynamic
from rtec.training.dynamic_results import DynamicKind, DynamicRow
from rtec.units import symbol

SHARES = (0.05, 0.2, 1.0)


def rows_of(path: Path, share: float, budget_s: float) -> tuple[dict[str, DynamicRow], str, str | None]:
    """Return the rows of a comparison that trains on the first part of the first half, by name, unit and choice."""
    log = dynamic_log(path)
    data = log.sequences
    half = len(data) // 2
    seen = replace(log, sequences=data.part(0, round(share * half)))
    unseen = replace(log, sequences=data.part(half, len(data)))
    result = compare_dynamic(seen, unseen, budget_s=budget_s)
    return {row.name: row for row in result.rows}, result.unit, result.chosen


def table(path: Path, budget_s: float) -> str:
    """Return a row for each model and a column for each share."""
    found = [rows_of(path, share, budget_s) for share in SHARES]
    unit = symbol(found[0][1])
    lines = [
        f"| model | {' | '.join(f'{100.0 * share:.0f} %' for share in SHARES)} | numbers |",
        f"|---|{'---|' * len(SHARES)}---|",
    ]
    for name, last in found[-1][0].items():
        cells = [_cell(rows[name], name == chosen) for rows, _, chosen in found]
        numbers = "" if last.parameters is None or last.kind is DynamicKind.NONE else str(last.parameters)
        lines.append(f"| {name} | {' | '.join(cells)} | {numbers} |")
    return "\n".join(
        [f"Root mean square error in {unit}, **bold** what the training part chose:", "", *lines, "", ""]
    )


def _cell(row: DynamicRow, chosen: bool) -> str:
    if row.rms_heldout is None:
        return "diverges" if row.model is not None else "-"
    text = f"{row.rms_heldout:.3g}"
    return f"**{text}**" if chosen else text


def main() -> None:
    """Print the table, or write it into a page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path, metavar="LOG.csv", help="log of a drive")
    parser.add_argument("--budget", type=float, default=60.0, metavar="S", help="time of the networks, a share each")
    parser.add_argument("-o", "--output", type=Path, metavar="PAGE.md", help="page that has the marks of this script")
    given = parser.parse_args()
    print_or_write(parser, given.output, "shares_of_path", lambda: table(given.log, given.budget))


if __name__ == "__main__":
    main()
