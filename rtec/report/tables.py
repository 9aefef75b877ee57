"""The tables of a report: rows as the contract names them, what limits which design, and both as CSV."""

from __future__ import annotations

import csv
import enum
import io
import math
from collections.abc import Callable
from dataclasses import dataclass

from rtec.machine import Ending
from rtec.metrology import PositioningFigures
from rtec.report.appearance import MISSING, Look, Scale, is_design, look_of, number
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


@dataclass(frozen=True, slots=True, kw_only=True)
class LengthColumn:
    """A length of each row.

    Parameters
    ----------
    key
        Its name in files, without the unit.
    head
        For a table on the page.
    words
        For a table with room.
    value_mm
        Takes it from the figures of a row.
    """

    key: str
    head: str
    words: str
    value_mm: Callable[[PositioningFigures], float | None]

    def of(self, row: StudyRow) -> float | None:
        """Return the length of a row; None where it is not defined, or the row is empty."""
        return None if row.figures is None else self.value_mm(row.figures)


THESIS_COLUMNS = (
    LengthColumn(
        key="max_average_error",
        head="max average",
        words="maximum average error",
        value_mm=lambda figures: figures.max_average_error,
    ),
    LengthColumn(
        key="max_reversal_error",
        head="max reversal",
        words="maximum reversal error",
        value_mm=lambda figures: figures.max_reversal_error,
    ),
    LengthColumn(
        key="max_repeat", head="max repeat", words="maximum repeat", value_mm=lambda figures: figures.max_repeat
    ),
    LengthColumn(
        key="cyclic_pp", head="cyclic p‑p", words="cyclic, peak to peak", value_mm=lambda figures: figures.cyclic_pp
    ),
)
ISO_COLUMNS = (
    LengthColumn(key="A", head="A", words="ISO 230-2  A", value_mm=lambda figures: figures.accuracy),
    LengthColumn(key="R", head="R", words="ISO 230-2  R", value_mm=lambda figures: figures.repeatability),
    LengthColumn(key="E", head="E", words="ISO 230-2  E", value_mm=lambda figures: figures.systematic),
    LengthColumn(key="M", head="M", words="ISO 230-2  M", value_mm=lambda figures: figures.mean_bidirectional),
    LengthColumn(key="B", head="B", words="ISO 230-2  B", value_mm=lambda figures: figures.reversal),
)
READING_COLUMNS = (
    LengthColumn(key="rms", head="RMS", words="RMS of all readings", value_mm=lambda figures: figures.rms),
    LengthColumn(key="pp", head="p‑p", words="peak to peak", value_mm=lambda figures: figures.peak_to_peak),
)
LENGTH_COLUMNS = THESIS_COLUMNS + ISO_COLUMNS + READING_COLUMNS


@dataclass(frozen=True, slots=True, kw_only=True)
class CountColumn:
    """A number of events of each row."""

    key: str
    head: str
    words: str
    value: Callable[[StudyRow], int]
    mark: Mark
    """Of a number other than zero."""


COUNT_COLUMNS = (
    CountColumn(
        key="corrections_inserted",
        head="inserted",
        words="corrections inserted",
        value=lambda row: row.run.insertions.inserted,
        mark=Mark.NONE,
    ),
    CountColumn(
        key="corrections_pending",
        head="pending",
        words="corrections pending",
        value=lambda row: abs(row.run.pending_steps),
        mark=Mark.MIND,
    ),
    CountColumn(
        key="illegal_transitions",
        head="illegal",
        words="illegal transitions",
        value=lambda row: row.run.received.illegal_transitions,
        mark=Mark.ALARM,
    ),
    CountColumn(
        key="refused", head="refused", words="messages refused", value=lambda row: row.run.refused, mark=Mark.MIND
    ),
    CountColumn(
        key="refused_too_fast",
        head="gated",
        words="put off by the gate",
        value=lambda row: row.run.insertions.refused,
        mark=Mark.NONE,
    ),
)


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
    return [_limit_row(limit, by_name.get(limit.name), result.program_feed_mm_s, scale) for limit in result.limits]


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
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    lengths = [f"{column.key}_{scale.unit}" for column in LENGTH_COLUMNS]
    counts = [column.key for column in COUNT_COLUMNS]
    writer.writerow(["name", *lengths, *counts, "beyond_word_steps", "audit", "audit_counts", "ending"])
    for row in result.rows:
        values = (column.of(row) for column in LENGTH_COLUMNS)
        writer.writerow(
            [
                row.name,
                *("" if value is None or not math.isfinite(value) else repr(float(value * scale.per_mm))
                  for value in values),
                *(column.value(row) for column in COUNT_COLUMNS),
                row.run.beyond_word_steps,
                "true" if row.run.audit else "false",
                row.run.audit_counts,
                row.run.ending.name,
            ]
        )  # fmt: skip
    return file.getvalue()


def curves_csv(result: StudyResult, scale: Scale) -> str:
    """Return the errors in motion as CSV, a row a design and feed; empty fields where nothing was measured."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    names = ("forward_pp", "reverse_pp", "forward_rms", "reverse_rms")
    writer.writerow(["name", "feed_mm_s", *(f"{name}_{scale.unit}" for name in names)])
    for curve in result.feed_curves:
        columns = (curve.forward_pp_mm, curve.reverse_pp_mm, curve.forward_rms_mm, curve.reverse_rms_mm)
        for feed, *values in zip(curve.feed_mm_s, *columns, strict=True):
            texts = [repr(float(value * scale.per_mm)) if math.isfinite(value) else "" for value in values]
            writer.writerow([curve.name, repr(float(feed)), *texts])
    return file.getvalue()
