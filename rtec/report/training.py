"""What ``rtec train`` shows: a row for each predictor, as a document and on the terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.box import SIMPLE
from rich.table import Table

from rtec.report.appearance import printable

if TYPE_CHECKING:
    from rtec.training import PredictorComparison, Row

ALIKE = 0.1
"""Two held-out errors that differ by no more than this share are as good as each other."""


def training_document(result: PredictorComparison) -> dict[str, object]:
    """Return a comparison as it stands in JSON.

    Parameters
    ----------
    result
        The comparison.
    """
    return {
        "source": result.source,
        "heldout_by": result.parts.heldout_by,
        "readings": {part: getattr(result.parts, part).rows for part in ("train", "choose", "sure", "heldout")},
        "repeatability_um": _um(result.noise_mm),
        "screw_pitch_mm": result.pitch_mm,
        "best": None if result.best is None else result.best.name,
        "interrupted": result.interrupted,
        "notes": list(result.notes),
        "rows": [_row(row) for row in result.ranked],
    }


def _row(row: Row) -> dict[str, object]:
    return {
        "name": row.name,
        "kind": row.kind,
        "rms_train_um": _um(row.rms_train_mm),
        "rms_heldout_um": _um(row.rms_heldout_mm),
        "worst_heldout_um": _um(row.worst_heldout_mm),
        "train_s": row.train_s,
        "eval_ns": row.eval_ns,
        "parameters": row.parameters,
        "interval_um": _um(row.interval_mm),
        "coverage": row.coverage,
        "notes": list(row.notes),
        "reason": row.reason,
        "networks": [
            {"epochs": course.epochs, "sse_mm2": course.squares_mm2, "seconds": course.seconds}
            for course in row.courses
        ],
    }


def _um(value_mm: float | None) -> float | None:
    return None if value_mm is None or not math.isfinite(value_mm) else 1e3 * value_mm


def training_table(result: PredictorComparison) -> Table:
    """Return the rows, the lowest held-out error first; it fits 100 columns.

    Parameters
    ----------
    result
        The comparison.
    """
    judge = "held out" if result.parts.heldout_by == "places" else "other file"
    table = Table(box=SIMPLE, pad_edge=False)
    table.add_column("predictor", no_wrap=True)
    for heading in ("fitted, µm", f"{judge}, µm", "worst, µm", "90 % within, µm", "held", "numbers", "fit", "ns"):
        table.add_column(heading, justify="right")
    best = result.best
    for row in result.ranked:
        if row.rms_heldout_mm is None:
            table.add_row(row.name, *[""] * 8)
            continue
        style = "bold green" if row is best else "dim" if not row.works else ""
        interval = row.interval_mm if row.interval_mm is not None else math.inf
        held = "–" if not math.isfinite(interval) or row.coverage is None else f"{100.0 * row.coverage:.0f} %"
        table.add_row(
            row.name,
            _three(row.rms_train_mm),
            _three(row.rms_heldout_mm),
            _three(row.worst_heldout_mm),
            f"±{_three(interval)}" if math.isfinite(interval) else "–",
            held,
            str(row.parameters),
            f"{row.train_s:.1f} s",
            f"{row.eval_ns:.0f}",
            style=style,
        )
    return table


def _three(value_mm: float | None) -> str:
    return "" if value_mm is None else f"{1e3 * value_mm:.3g}"


def training_sentence(result: PredictorComparison) -> str:
    """Return what the comparison says, in sentences.

    Parameters
    ----------
    result
        The comparison.
    """
    lines = []
    best = result.best
    if best is None:
        lines.append("No predictor has a figure.")
    else:
        lines.append(f"Best: {best.name}, {_three(best.rms_heldout_mm)} µm on {_judges(result)}.")
        lines += _beside(result, best)
    if result.noise_mm is not None:
        lines.append(f"Repeated readings differ by {_three(result.noise_mm)} µm (standard deviation): no predictor "
                     "can do better than that.")  # fmt: skip
    lines += [f"{row.name}: {printable(row.reason)}" for row in result.rows if row.reason]
    if result.parts.heldout_by == "places":
        lines.append(
            "Held-out places leave gaps, and a table needs its neighbours: --heldout with a measurement at other "
            "targets shows what each predictor is worth between the targets."
        )
    if result.interrupted:
        lines.append("Ended early; every network is the best so far.")
    return "\n".join(lines)


def _judges(result: PredictorComparison) -> str:
    rows = result.parts.heldout.rows
    return f"{rows} readings at places held out" if result.parts.heldout_by == "places" else f"{rows} other readings"


def _beside(result: PredictorComparison, best: Row) -> list[str]:
    """Return what a network buys over a table, over the geometry of several axes and over named physics."""
    lines = []
    kinds = {"table": "the best table", "geometry": "the best geometry of all axes"}
    kinds |= {"model": "the effects that were found", "network": "the best network"}
    for kind, words in kinds.items():
        row = next((r for r in result.ranked if r.kind == kind and r.rms_heldout_mm is not None), None)
        if row is None or row is best or row.rms_heldout_mm is None or best.rms_heldout_mm is None:
            continue
        more = row.rms_heldout_mm / best.rms_heldout_mm - 1.0
        figure = f"{_three(row.rms_heldout_mm)} µm with {row.parameters} numbers"
        verdict = "as good" if more <= ALIKE else f"{100.0 * more:.0f} % more"
        lines.append(f"{words[0].upper()}{words[1:]} ({row.name}): {figure}, {verdict}.")
        if kind == "geometry":
            lines += [f"  {note}" for note in row.notes]
    return lines
