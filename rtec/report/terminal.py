"""The tables that ``rtec run`` shows on the terminal."""

from __future__ import annotations

from rich.box import SIMPLE
from rich.table import Table
from rich.text import Text

from rtec.injector import Design
from rtec.report.appearance import look_of, printable, scale_of
from rtec.report.diagnosis.chapters import step_rows
from rtec.report.diagnosis.quantities import shown_of
from rtec.report.diagnosis.sentence import floor_words, heldout_words
from rtec.report.tables import COUNT_COLUMNS, LENGTH_COLUMNS, Mark, table_rows
from rtec.study.results import Learned, StudyResult

_TWIN = {"E": "max_average_error", "B": "max_reversal_error"}
_STYLES = {Mark.NONE: "", Mark.GOOD: "green", Mark.MIND: "yellow", Mark.ALARM: "bold red"}
_SHORT = {"uncompensated": "none", "table": "table"} | {design.value: design.short for design in Design}


def terminal_table(result: StudyResult) -> Table:
    """Return the rows of a study side by side, a line for each figure, failing audits in red.

    It fits 80 columns in any unit. E and B of ISO 230-2 are the thesis's maximum average and reversal error and
    share their lines.

    Raises
    ------
    ArgumentError
        A unit that is not known.
    """
    scale = scale_of(result.study.unit)
    rows = table_rows(result, scale)
    title = Text(printable(result.study.title))
    table = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE, padding=(0, 0))
    table.add_column(f"{scale.symbol}; corrected by", no_wrap=True)
    for row in result.rows:
        table.add_column(Text(_SHORT.get(row.name) or look_of(row.name).label), justify="right", overflow="fold")
    for index, length in enumerate(LENGTH_COLUMNS):
        if length.key in _TWIN:
            continue
        twin = next((f" ({iso})" for iso, key in _TWIN.items() if key == length.key), "")
        table.add_row(length.words.replace("maximum", "max") + twin, *(row.cells[index].text for row in rows))
    table.add_section()
    for index, count in enumerate(COUNT_COLUMNS, len(LENGTH_COLUMNS)):
        cells = [row.cells[index] for row in rows]
        table.add_row(count.words, *(Text(cell.text, style=_STYLES[cell.mark]) for cell in cells))
    table.add_section()
    audits = [row.cells[-1] for row in rows]
    table.add_row("audit", *(Text(_narrow(cell.text), style=_STYLES[cell.mark]) for cell in audits))
    return table


def staircase_table(learned: Learned) -> Table:
    """Return the steps of the search that made the predictor: what each effect leaves of the calibration.

    It fits 80 columns. The sentence of the verdict is not part of it.
    """
    d = learned.diagnosis
    shown = shown_of(d.dataset.units)
    table = Table(
        box=SIMPLE,
        padding=(0, 0),
        caption=Text(
            f"{floor_words(d.noise, shown)}; held out {heldout_words(d.heldout_by)};\n"
            "true error less model: at the same targets, without noise"
        ),
        caption_justify="left",
        caption_style="dim",
    )
    table.add_column(f"{shown.symbol} RMS; step", no_wrap=True)
    for head in ("training", "held out", "true error\nless model", "adjusted p"):
        table.add_column(head, justify="right", no_wrap=True)
    for row, score in zip(step_rows(d, shown), learned.scores, strict=True):
        name = row.label if table.rows else "perfect axis"
        table.add_row(Text(name), row.train, row.heldout, shown.text(score.rms_mm), row.p)
    return table


def _narrow(audit: str) -> str:
    return audit.replace(" by ", " by\n").replace(" count", "\ncount")
