"""What is told of a machine that warmed over a shift: rows for page, terminal, files and programs."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from rich.box import SIMPLE
from rich.table import Table
from rich.text import Text

from rtec.report.appearance import MISSING, Scale, scale_of
from rtec.report.rendering import csv_text
from rtec.study.results import Shift, ShiftRow, StudyResult

HEADS = ("RMS", "worst", "RMS at first", "RMS at last")


class ShiftLine(NamedTuple):
    """A row of the table, as text."""

    title: str
    lengths: tuple[str, ...]
    """In the order of ``HEADS``."""
    remark: str


def shift_lines(result: StudyResult, scale: Scale) -> list[ShiftLine]:
    """Return the rows of a shift, lengths in the unit of results; none for a cold machine."""
    rows = () if result.shift is None else result.shift.rows
    return [ShiftLine(row.title, tuple(map(scale.text, _lengths_mm(row))), _remark(row)) for row in rows]


def _lengths_mm(row: ShiftRow) -> tuple[float | None, ...]:
    taken = row.deviation_mm[np.isfinite(row.deviation_mm).all(axis=1)]
    if not taken.size:
        return (None,) * len(HEADS)
    first, last = (float(np.sqrt(np.mean(taken[k] ** 2))) for k in (0, -1))
    return row.rms_mm, row.worst_mm, first, last


def _remark(row: ShiftRow) -> str:
    if row.reason or not row.run.outside_s:
        return row.reason or ("" if row.run.audit else "counts are not accounted for")
    return f"{row.run.outside_s / 60.0:.0f} min outside, first {row.run.outside_input}"


def shift_table(result: StudyResult) -> Table:
    """Return the table of a shift for the terminal; it fits 80 columns."""
    scale = scale_of(result.study.unit)
    table = Table(box=SIMPLE, padding=(0, 1), title="Over the shift", title_justify="left", title_style="bold")
    table.add_column(f"{scale.symbol}")
    for head in HEADS:
        table.add_column(head, justify="right")
    table.add_column("", overflow="fold")
    for line in shift_lines(result, scale):
        table.add_row(line.title, *line.lengths, Text(line.remark))
    return table


def shift_csv(shift: Shift, scale: Scale) -> str:
    """Return the calibrations of a shift as CSV, a row for each of them; empty fields where the machine was held."""
    head = ["name", "time_s", *(f"{name}_{scale.unit}" for name in ("mean", "least", "largest", "rms"))]
    rows: list[list[str]] = [head]
    for row in shift.rows:
        for time_s, deviation in zip(row.time_s, row.deviation_mm * scale.per_mm, strict=True):
            figures = (deviation.mean(), deviation.min(), deviation.max(), np.sqrt(np.mean(deviation**2)))
            rows.append([row.name, f"{time_s:.3f}", *("" if np.isnan(one) else repr(float(one)) for one in figures)])
    return csv_text(rows)


def shift_document(shift: Shift | None) -> list[dict[str, Any]] | None:
    """Return the rows of a shift for programs, lengths in um; None for a cold machine."""
    if shift is None:
        return None
    return [
        {
            "name": row.name,
            "rms_um": row.rms_mm * 1000.0,
            "worst_um": row.worst_mm * 1000.0,
            "calibrations": [
                {"time_s": float(time_s), "mean_um": float(of.mean()) * 1000.0, "rms_um": _rms(of) * 1000.0}
                for time_s, of in zip(row.time_s, row.deviation_mm, strict=True)
            ],
            "outside_s": row.run.outside_s,
            "outside_input": row.run.outside_input or None,
            "audit": row.run.audit,
            "reason": row.reason or None,
        }
        for row in shift.rows
    ]


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(values**2)))


def shift_caption(result: StudyResult, scale: Scale) -> str:
    """Return what to see in the figure of a shift."""
    if result.shift is None:
        return MISSING
    heat = result.shift.heat
    sees = "all thermometers" if not heat.thermometers else f"{len(heat.thermometers)} thermometers"
    how = "read from a file" if heat.models else f"fitted by {heat.fit} to the same machine in another duty cycle"
    return (
        f"Axis {heat.axis} of a simulated machine that warms, calibrated every {heat.every_s / 60.0:g} min in closed "
        f"loop: mean of the readings at all targets (markers) and their range (band). At the beginning nothing has "
        f"grown; then the cold table was measured. Corrected by the temperatures is by the cold table and a "
        f"predictor that sees {sees}, {how}. Below, the temperatures that changed most; where it is shaded, the "
        "spindle turns."
    )
