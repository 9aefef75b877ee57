"""What ``rtec diagnose`` and ``rtec add`` show on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.box import SIMPLE
from rich.console import Group
from rich.table import Table
from rich.text import Text

from rtec.inference.fit import values_of
from rtec.inference.model import Model
from rtec.inference.results import Diagnosis
from rtec.report.diagnosis.chapters import CandidateRow, SearchText, search_text, where_rows
from rtec.report.diagnosis.quantities import parameter_texts, shown_for
from rtec.report.diagnosis.sentence import heldout_words, row_by_row_words, term_words

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison

_STYLES = {"good": "bold green", "mind": "bold yellow", "bad": "bold red"}
_MOST_PARAMETERS = 6
_MOST_CANDIDATES = 8


def diagnosis_table(diagnosis: Diagnosis) -> Group:
    """Return what a search found, the way to it, the candidates that were not taken, and what could not be tested.

    It fits 80 columns. The sentence of the verdict is not part of it.
    """
    said = search_text(diagnosis, shown_for(diagnosis.dataset))
    parts: list[Table | Text] = [Text(said.verdict, style=_STYLES[said.tone])]
    if diagnosis.model.terms:
        parts.append(found_table(diagnosis.model))
    parts.append(_steps(said))
    others = [row for row in said.candidates if not row.accepted]
    if others:
        parts.append(_candidates(others, said.unit))
    if said.not_testable:
        parts.append(_pairs("not testable", [(name, why) for name, why, _ in said.not_testable]))
    if said.experiment:
        parts.append(Text.assemble(("Measure next: ", "bold"), said.experiment))
    return Group(*parts)


def comparison_table(comparison: Comparison) -> Group:
    """Return with what the residual goes and where it is worst; the sentence is not part of it.

    It fits 80 columns.
    """
    shown = shown_for(comparison.dataset)
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("what is left goes with", overflow="fold")
    table.add_column("share", justify="right", no_wrap=True)
    table.add_column("worst at", overflow="fold")
    table.add_column(f"mean there ({shown.symbol})", justify="right")
    for row in where_rows(comparison, shown):
        table.add_row(Text(row.quantity), row.share, Text(row.place), row.mean)
    rows = row_by_row_words(comparison.rms_heldout_rows, shown)
    by = Text(f"held out {heldout_words(comparison.heldout_by)}{rows}", style="dim")
    return Group(table, by) if comparison.where else Group(by)


def found_table(model: Model) -> Table:
    """Return the parameters of a model with their standard errors: those at the end of a search, not on the way."""
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("found", no_wrap=True)
    table.add_column("parameters", overflow="fold")
    for term in model.terms:
        words = parameter_texts(values_of(term, model), _MOST_PARAMETERS)
        table.add_row(Text(term_words(term)), Text("\n".join(words)))
    return table


def _steps(said: SearchText) -> Table:
    caption = Text(f"{said.floor}; held out: {said.heldout}")
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0), caption=caption, caption_justify="left", caption_style="dim")
    table.add_column("step", no_wrap=True)
    for head in (f"RMS ({said.unit})", "held out", "adjusted p"):
        table.add_column(head, justify="right", no_wrap=True)
    for row in said.steps:
        table.add_row(Text(row.label), row.train, row.heldout, row.p)
    return table


def _candidates(others: list[CandidateRow], unit: str) -> Table:
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("not added", no_wrap=True)
    table.add_column(f"RMS with it ({unit})", justify="right")
    table.add_column("adjusted p", justify="right", no_wrap=True)
    table.add_column("why not", overflow="fold")
    for row in others[:_MOST_CANDIDATES]:
        table.add_row(Text(row.name), row.predicted, row.p, Text(row.reason))
    if len(others) > _MOST_CANDIDATES:
        table.caption = Text(f"and {len(others) - _MOST_CANDIDATES} more")
    return table


def _pairs(head: str, rows: list[tuple[str, str]]) -> Table:
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column(head, no_wrap=True)
    table.add_column("why", overflow="fold")
    for name, words in rows:
        table.add_row(Text(name), Text(words))
    return table
