"""How ``rtec check`` tells its verdict on the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from rtec.conformance.results import Verdict

_RESULTS = {True: Text("passed", style="green"), False: Text("FAILED", style="bold red"), None: Text("not tried")}


def show(verdict: Verdict, worst: str | None, note: str) -> None:
    """Print checks, data sheet, worst case and verdict.

    Parameters
    ----------
    verdict
        Of the suite.
    worst
        The command that plays the worst case again.
    note
        On how the algorithm runs, or "".
    """
    console = Console(highlight=False)
    table = Table(title=verdict.algorithm, show_header=False, title_justify="left")
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for check in verdict.checks:
        table.add_row(check.name, _RESULTS[check.passed], Text(check.reason))
    console.print(table)
    sheet = Table(title="Data sheet", show_header=False, title_justify="left")
    sheet.add_column(no_wrap=True)
    sheet.add_column(overflow="fold")
    for name, value in verdict.data_sheet():
        sheet.add_row(name, Text(value))
    console.print(sheet)
    if note:
        console.print(Text(note), soft_wrap=True)
    if worst is not None and verdict.worst is not None:
        violation = verdict.worst.judgement.violation
        what = "narrowest that is right" if violation is None else f"worst case: {violation}"
        console.print(Text(what), soft_wrap=True)
        console.print(Text(f"play it again: {worst}"), soft_wrap=True)
    failed = sum(check.passed is not True for check in verdict.checks)
    said = f"{len(verdict.checks)} checks hold in {verdict.runs} runs"
    if failed:
        said = f"{failed} of {len(verdict.checks)} checks do not hold, {verdict.runs} runs"
    style = "green" if verdict.passed else "bold red"
    console.print(f"{'passed' if verdict.passed else 'FAILED'}: {said}", style=style)
