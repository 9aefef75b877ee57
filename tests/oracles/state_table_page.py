"""The tables of docs/state-tables.md, as they stand there."""

from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "state-tables.md"


def tables():
    """Return the tables of the page: (heading, list of rows as dicts)."""
    found, heading, header = [], "", None
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            heading = line.strip("# ")
        if not line.startswith("|"):
            header = None
            continue
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if header is None:
            header = cells
            found.append((heading, []))
        elif not set(cells[0]) == {"-"}:
            found[-1][1].append(dict(zip(header, cells, strict=True)))
    return found


def insertion_rows():
    """Return what the page says of insertions: (design, row as a dict)."""
    return [
        (heading.split(":")[0], row) for heading, rows in tables() for row in rows if "Output, step by step" in row
    ]
