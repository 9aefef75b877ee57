"""The tables of a report: rows as the contract names them, what limits which design, and both as CSV."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from rtec.machine import Ending
from rtec.report.appearance import MISSING, Look, Scale, is_design, look_of, number
from rtec.report.rendering import csv_text
from rtec.study.results import Limit, StudyResult, StudyRow

_ENDINGS = {Ending.HELD: "held by the PC", Ending.FAULTED: "servo fault"}


class Mark(enum.Enum):
    """How a cell stands out; the value is its class on the page."""

    NONE = ""
    GOOD = "ok"
    MIND = "mind"
    """Worth knowing, no mistake."""
    ALARM = "alarm"
    """Counts were lost or made."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A cell of a table."""

    text: str
    mark: Mark = Mark.NONE


class LengthColumn(NamedTuple):
    """A length of each row."""

    key: str
    """Its name in files and in `PositioningFigures.lengths`, without the unit."""
    head: str
    """For a table on the page."""
    words: str
    """For a table with room."""

    def of(self, row: StudyRow) -> float | None:
        """Return the length of a row; None where it is not defined, or the row is empty."""
        return None if row.figures is None else row.figures.lengths[self.key]


THESIS_COLUMNS = (
    LengthColumn("max_average_error", "max average", "maximum average error"),
    LengthColumn("max_reversal_error", "max reversal", "maximum reversal error"),
    LengthColumn("max_repeat", "max repeat", "maximum repeat"),
    LengthColumn("cyclic_pp", "cyclic p‑p", "cyclic, peak to peak"),
)
ISO_COLUMNS = (
    LengthColumn("A", "A", "ISO 230-2  A"),
    LengthColumn("R", "R", "ISO 230-2  R"),
    LengthColumn("E", "E", "ISO 230-2  E"),
    LengthColumn("M", "M", "ISO 230-2  M"),
    LengthColumn("B", "B", "ISO 230-2  B"),
)
READING_COLUMNS = (
    LengthColumn("rms", "RMS", "RMS of all readings"),
    LengthColumn("pp", "p‑p", "peak to peak"),
)
LENGTH_COLUMNS = THESIS_COLUMNS + ISO_COLUMNS + READING_COLUMNS


class CountColumn(NamedTuple):
    """A number of events of each row."""

    key: str
    head: str
    words: str
    mark: Mark
    """Of a number other than zero."""
    value: Callable[[StudyRow], int]


COUNT_COLUMNS = (
    CountColumn(
        "corrections_inserted", "inserted", "corrections inserted", Mark.NONE, lambda row: row.run.insertions.inserted
    ),
    CountColumn(
        "corrections_pending", "pending", "corrections pending", Mark.MIND, lambda row: abs(row.run.pending_steps)
    ),
    CountColumn(
        "illegal_transitions", "illegal", "illegal transitions", Mark.ALARM,
        lambda row: row.run.received.illegal_transitions,
    ),
    CountColumn("refused", "refused", "messages refused", Mark.MIND, lambda row: row.run.refused),
    CountColumn(
        "refused_too_fast", "gated", "put off by the gate", Mark.NONE, lambda row: row.run.insertions.refused
    ),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRow:
    """A row of the page's table."""

    look: Look
    title: str
    cells: tuple[Cell, ...]
    good: bool


def audit_text(row: StudyRow) -> str:
    """Return the outcome of the audit in a few words.

    A row whose counts agree and whose audit fails had illegal transitions.
    """
    if not row.run.audit:
        if row.run.audit_counts:
            plural = "" if abs(row.run.audit_counts) == 1 else "s"
            return f"off by {row.run.audit_counts:+d} count{plural}".replace("-", "−")
        return "illegal transitions"
    if row.run.ending is not Ending.FINISHED:
        return _ENDINGS.get(row.run.ending, row.run.ending.name.lower())
    return "OK"


def _count_cell(column: CountColumn, row: StudyRow) -> Cell:
    if not is_design(row.name) and column.key != "illegal_transitions":
        return Cell(text=MISSING)
    value = column.value(row)
    return Cell(text=number(value), mark=column.mark if value else Mark.NONE)


def table_rows(result: StudyResult, scale: Scale) -> list[TableRow]:
    """Return the main table, its cells in the order of the columns, the audit last."""
    rows = []
    for row in result.rows:
        cells = [Cell(text=scale.text(column.of(row))) for column in LENGTH_COLUMNS]
        cells += [_count_cell(column, row) for column in COUNT_COLUMNS]
        cells.append(Cell(text=audit_text(row), mark=Mark.GOOD if row.good else Mark.ALARM))
        rows.append(TableRow(look=look_of(row.name), title=row.title, cells=tuple(cells), good=row.good))
    return rows


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitRow:
    """What limits a design, in words."""

    look: Look
    follows: Cell
    gate: Cell
    word: Cell
    verdict: str


def limit_rows(result: StudyResult, scale: Scale) -> list[LimitRow]:
    """Return the table of limits."""
    by_name = {row.name: row for row in result.rows}
    return [_limit_row(limit, by_name.get(limit.name), result.study.plan.feed_mm_s, scale) for limit in result.limits]


def _limit_row(limit: Limit, row: StudyRow | None, feed_mm_s: float, scale: Scale) -> LimitRow:
    late = limit.follows_up_to_mm_s < feed_mm_s
    gated = limit.gate_refuses_above_mm_s < feed_mm_s
    beyond_steps = 0 if row is None else row.run.beyond_word_steps
    narrow = limit.word_holds_mm < limit.largest_error_mm or beyond_steps > 0
    reasons = []
    if late:
        reasons.append("in motion the window and the update rate: the correction is late on steep stretches")
    if gated:
        reasons.append("the speed gate: in motion nothing is inserted, corrections wait for slower stretches")
    if narrow:
        beyond = (
            "" if row is None or not row.run.beyond_word_steps else f" by {row.run.beyond_word_steps} steps at most"
        )
        reasons.append(f"the word: the request cannot ask for the largest error{beyond}")
    return LimitRow(
        look=look_of(limit.name),
        follows=Cell(text=scale.feed(limit.follows_up_to_mm_s), mark=_mind(late)),
        gate=Cell(text=scale.feed(limit.gate_refuses_above_mm_s), mark=_mind(gated)),
        word=Cell(text=_length(limit.word_holds_mm, scale), mark=_mind(narrow)),
        verdict="; ".join(reasons) or "nothing at this feed",
    )


def _mind(limited: bool) -> Mark:
    return Mark.MIND if limited else Mark.NONE


def _length(value_mm: float, scale: Scale) -> str:
    """Return a length with its unit, without digits that a step does not have."""
    return f"{value_mm * scale.per_mm:.4g} {scale.symbol}" if math.isfinite(value_mm) else MISSING


def rows_csv(result: StudyResult, scale: Scale) -> str:
    """Return the main table as CSV, lengths with all their digits in the study's unit."""
    lengths = [f"{column.key}_{scale.unit}" for column in LENGTH_COLUMNS]
    counts = [column.key for column in COUNT_COLUMNS]
    head = ["name", *lengths, *counts, "beyond_word_steps", "audit", "audit_counts", "ending"]
    rows = (
        (
            row.name,
            *(_exact(column.of(row), scale) for column in LENGTH_COLUMNS),
            *(column.value(row) for column in COUNT_COLUMNS),
            row.run.beyond_word_steps,
            "true" if row.run.audit else "false",
            row.run.audit_counts,
            row.run.ending.name,
        )
        for row in result.rows
    )
    return csv_text([head, *rows])


def _exact(value_mm: float | None, scale: Scale) -> str:
    return "" if value_mm is None or not math.isfinite(value_mm) else repr(float(value_mm * scale.per_mm))


def curves_csv(result: StudyResult, scale: Scale) -> str:
    """Return the errors in motion as CSV, a row a design and feed; empty fields where nothing was measured."""
    names = ("forward_pp", "reverse_pp", "forward_rms", "reverse_rms")
    rows: list[list[str]] = [["name", "feed_mm_s", *(f"{name}_{scale.unit}" for name in names)]]
    for curve in result.feed_curves:
        columns = (getattr(curve, f"{name}_mm") for name in names)
        for feed, *values in zip(curve.feed_mm_s, *columns, strict=True):
            rows.append([curve.name, repr(float(feed)), *(_exact(value, scale) for value in values)])
    return csv_text(rows)
