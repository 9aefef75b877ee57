"""``rtec iso230``: the positioning figures of a measurement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from rtec.cli import _measured
from rtec.cli._console import note

if TYPE_CHECKING:
    from rtec.metrology import PositioningFigures

_ROWS = (
    ("accuracy", "A"),
    ("repeatability", "R"),
    ("systematic error", "E"),
    ("mean bidirectional error", "M"),
    ("reversal error", "B"),
    ("mean reversal error", "B_mean"),
    ("maximum average error (thesis)", "max_average_error"),
    ("maximum reversal error (thesis)", "max_reversal_error"),
    ("maximum repeat, max - min at a target", "max_repeat"),
    ("cyclic error, peak to peak", "cyclic_pp"),
    ("root mean square of all", "rms"),
    ("peak to peak of all", "pp"),
)


def iso230(
    data: _measured.Data,
    json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout, nothing else.")] = False,
    period: Annotated[
        str | None, typer.Option(help="Period of the cyclic error, such as '0.25 inch'; else the file's screw_pitch.")
    ] = None,
    unit: Annotated[
        str | None, typer.Option(help="um (default), mm, nm, inch; for a rotary axis arcsec (default), deg, urad.")
    ] = None,
    maps: _measured.Maps = None,
    sheet: _measured.Sheet = None,
    decimal: _measured.Decimal = None,
) -> None:
    """Judge a positioning test: the figures of ISO 230-2 and the thesis's.

    Example: rtec iso230 z_axis.csv --period "0.25 inch"
    """
    from rtec.metrology import positioning_figures, read_positioning_test

    test = read_positioning_test(data, _measured.choices_of(maps, sheet, decimal))
    figures = positioning_figures(test.readings, period=test.period(period))
    document = figures.to_dict(unit)
    unused = f"columns not used: {', '.join(test.unknown)}" if test.unknown else None
    if json:
        import json as json_text

        document |= {"unknown_columns": list(test.unknown), "notes": list(test.notes)}
        typer.echo(json_text.dumps(document, allow_nan=False))
        return
    for sentence in test.notes:
        note(sentence)
    for warning in (*figures.warnings, *([unused] if unused else [])):
        typer.echo(f"warning: {warning}", err=True)
    _show(figures, document, data.name)


def _show(figures: PositioningFigures, document: dict[str, object], name: str) -> None:
    """Print the figures as a table on stdout."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    count = figures.at_targets.target.size
    table = Table(title=escape(f"{name}: {count} targets, {figures.runs} runs, in {document['unit']}"))
    for heading in ("figure", "", "both", "forward", "backward"):
        table.add_column(heading, justify="left" if heading in ("figure", "") else "right")
    for text, key in _ROWS:
        values = [document.get(f"{key}{suffix}") for suffix in ("", "_forward", "_backward")]
        cells = [f"{value:.5g}" if isinstance(value, float) else "" for value in values]
        table.add_row(text, key if len(key) <= 6 else "", *cells)
    console = Console()
    console.print(table)
    if document["cyclic_pp"] is None:
        console.print(f"cyclic error: {escape(str(document['cyclic_note']))}", highlight=False)
