"""What ``rtec iso230`` shows on the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from rtec.report.iso230.sheet import Sheet


def show(sheet: Sheet) -> None:
    """Print the figures as a table on stdout, and what their uncertainty contains."""
    tests, unit, listed = sheet.tests, sheet.units.name, sheet.table
    sizes = [f"{test.document['targets']} targets, {test.document['runs']} runs" for test in tests]
    title = f"{tests[0].name}: {sizes[0]}, in {unit}" if len(tests) == 1 else f"in {unit}"
    table = Table(title=escape(title))
    for heading in ("figure", ""):
        table.add_column(heading)
    for heading in listed.headings if len(tests) == 1 else map("\n".join, zip(listed.headings, sizes, strict=True)):
        table.add_column(escape(heading), justify="right", no_wrap=True)
    for group in listed.groups:
        table.add_row(group.title, style="italic")
        for row in group.rows:
            table.add_row(row.words, row.symbol, *row.cells)
        table.add_section()
    console = Console(highlight=False)
    console.print(table)
    said: dict[str, list[str]] = {}
    for test in tests:
        document = test.document
        note = [f"cyclic error: {document['cyclic_note']}"] if document["cyclic_pp"] is None else []
        for sentence in (*note, *test.judged.uncertainty.statement(unit, sheet.units.factor)):
            said.setdefault(sentence, []).append(test.name)
    for sentence, names in said.items():
        where = "" if len(names) == len(tests) else f"{', '.join(names)}: "
        console.print(f"{where}{sentence}", markup=False, soft_wrap=True)
