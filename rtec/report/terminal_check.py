"""How ``rtec check`` tells its verdict on the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from rtec.verify.contract.results import Verdict

RESULTS = {True: Text("passed", style="green"), False: Text("FAILED", style="bold red"), None: Text("not tried")}

_LONGEST_COMMAND = 8_000
_MOST_EVENTS = 40
"""Of a stream that breaks nothing, to be printed."""


def show(verdict: Verdict, worst: str | None, note: str) -> None:
    """Print checks, data sheet, worst case with the command that plays it again, a note, and the verdict."""
    console = Console(highlight=False)
    table = Table(title=verdict.algorithm, show_header=False, title_justify="left")
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for check in verdict.checks:
        table.add_row(check.name, RESULTS[check.passed], Text(check.reason))
    console.print(table)
    show_sheet(console, verdict)
    if note:
        console.print(Text(note), soft_wrap=True)
    if worst is not None:
        show_worst(console, verdict, worst)
    failed = sum(check.passed is not True for check in verdict.checks)
    said = f"{len(verdict.checks)} checks hold in {verdict.runs} runs"
    if failed:
        said = f"{failed} of {len(verdict.checks)} checks do not hold, {verdict.runs} runs"
    style = "green" if verdict.passed else "bold red"
    console.print(f"{'passed' if verdict.passed else 'FAILED'}: {said}", style=style)


def show_sheet(console: Console, verdict: Verdict) -> None:
    """Print what was measured."""
    sheet = Table(title="Data sheet", show_header=False, title_justify="left")
    sheet.add_column(no_wrap=True)
    sheet.add_column(overflow="fold")
    for name, value in verdict.data_sheet():
        sheet.add_row(name, Text(value))
    console.print(sheet)


def show_worst(console: Console, verdict: Verdict, worst: str) -> None:
    """Print what the worst case is, and the command that plays it again; a long one of many edges is in --json."""
    if verdict.worst is None:
        return
    violation = verdict.worst.judgement.violation
    long = len(verdict.worst.case.stream) > _MOST_EVENTS
    what = f"narrowest that is right: {verdict.worst.case.title}" if violation is None else f"worst case: {violation}"
    console.print(Text(what), soft_wrap=True)
    if len(worst) > _LONGEST_COMMAND:
        events = len(verdict.worst.case.stream)
        text = f"its stream has {events} events: write worst_stream of --json to a file, and --stream FILE plays it"
        console.print(Text(text), soft_wrap=True)
    elif violation is not None or not long:
        console.print(Text(f"play it again: {worst}"), soft_wrap=True)
