"""The report as one page of HTML that needs nothing else: style and figures are part of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rtec.report.appearance import Scale, is_design, joined, look_of, number, printable
from rtec.report.iso230.figure_table import ISO_FIGURES, READING_FIGURES
from rtec.report.search import search_of
from rtec.report.shift import HEADS, shift_lines
from rtec.report.tables import (
    COUNT_COLUMNS,
    ISO_COLUMNS,
    READING_COLUMNS,
    THESIS_COLUMNS,
    audit_text,
    limit_rows,
    table_rows,
)
from rtec.study.results import StudyResult, StudyRow

DEFINITIONS = (
    ("deviation", "Actual position less target (ISO 230-2), as the laser reads it."),
    ("mean, s", "Mean and standard deviation (with n − 1) of the readings at one target from one direction."),
    *(
        (", ".join(filter(None, (figure.symbol, figure.words))), figure.definition)
        for figure in (*ISO_FIGURES, *READING_FIGURES)
        if figure.key != "B_mean"
    ),
    (
        "inserted, pending",
        "Insertions made, of either sign; steps that the prediction asks for and that are not inserted at the end.",
    ),
    (
        "illegal",
        "Illegal transitions: changes of A and B at once at the controller, which cannot tell their direction.",
    ),
    (
        "refused",
        "Messages refused: Requests outside the box's window, because they changed by more than the window.",
    ),
    ("gated", "Moments at which the speed gate put an insertion off to a slower stretch."),
    (
        "audit",
        "At the end and at rest, the controller's count less the true encoder's count must be the completed "
        "corrections times the step. If it is not, counts were lost or made.",
    ),
)
"""Terms of the page and what they mean."""

NOT_MODELLED = (
    "The error of the axis is a function of position and direction that stays the same from run to run; the noise of "
    "a reading is normal and independent. Wear and load are left out, and warming up where it is not asked for.",
    "Lost motion is a play between the forward and the reverse curve; the screw does not wind up, and nothing sticks "
    "and slips.",
    "The drive is a proportional position loop over a first-order velocity loop, without resonances.",
    "A and B are ideal levels: no cable, no rise time. The receiver's sampling filter is modelled.",
    "The timing of the Original is the report's. That of A, B and C, which the report proposes, follows from its "
    "words, not from a measurement.",
    "Messages between PC and box take their time and are never lost or changed.",
    "The laser has no error of its own: no air, no dead path, no cosine.",
)
"""What a reader must not take for proven."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What came out, in a sentence."""

    text: str
    good: bool


def verdict(result: StudyResult, scale: Scale) -> Verdict:
    """Return what the best design leaves of the error, and whether every count is accounted for."""
    bad = [row for row in result.rows if not row.good]
    if bad:
        named = "; ".join(f"{look_of(row.name).label} {_failure(row)}" for row in bad)
        return Verdict(text=f"Not every count is accounted for: {named}.", good=False)
    before = next((row for row in result.rows if row.name == "uncompensated"), None)
    designs = [
        (row, row.figures)
        for row in result.rows
        if is_design(row.name) and row.figures is not None and row.figures.max_average_error is not None
    ]
    if before is None or before.figures is None or before.figures.max_average_error is None or not designs:
        return Verdict(text="Every count is accounted for.", good=True)
    best, figures = min(designs, key=lambda design: (design[1].max_average_error or 0.0, design[1].rms))
    left, whole = (scale.with_unit(of.max_average_error) for of in (figures, before.figures))
    pending = joined(look_of(row.name).label for row, _ in designs if row.run.pending_steps)
    tail = f" Corrections are pending at the end in {pending}." if pending else ""
    return Verdict(
        text=f"{look_of(best.name).label} leaves {left} of {whole} maximum average error; "
        f"every count is accounted for.{tail}",
        good=True,
    )


def _failure(row: StudyRow) -> str:
    text = audit_text(row)
    if row.run.audit:
        return f"was {text}" if text.startswith("held") else f"ended with a {text}"
    return f"is {text}" if text.startswith("off") else f"had {text}"


def page_values(result: StudyResult, scale: Scale) -> dict[str, Any]:
    """Return what the template of the page names; name, title, facts and warnings are text of a user."""
    return {
        "title": printable(result.study.title),
        "study": printable(result.study.name),
        "verdict": verdict(result, scale),
        "search": search_of(result),
        "scale": scale,
        "rows": table_rows(result, scale),
        "columns": (THESIS_COLUMNS, ISO_COLUMNS, READING_COLUMNS, COUNT_COLUMNS),
        "shift": shift_lines(result, scale),
        "shift_heads": HEADS,
        "limits": limit_rows(result, scale),
        "largest_error": scale.with_unit(max((limit.largest_error_mm for limit in result.limits), default=None)),
        "program_feed": scale.feed(result.study.plan.feed_mm_s),
        "facts": [(printable(label), printable(value)) for label, value in result.facts],
        "warnings": [printable(warning) for warning in result.warnings],
        "definitions": DEFINITIONS,
        "not_modelled": NOT_MODELLED,
        "seed": result.study.seed,
        "repeatability": f"{result.study.repeatability_mm * 1000:g} µm",
        "noisy": result.study.repeatability_mm > 0.0,
        "command": result.command,
        "simulated": number(round(sum(row.run.simulated_s for row in result.rows) / 3600.0, 1)),
    }
