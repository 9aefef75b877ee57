"""What ``rtec train`` shows: a row for each predictor, as a document and on the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.box import SIMPLE
from rich.table import Table

from rtec.report.appearance import MISSING, joined, printable
from rtec.training.results import Kind

if TYPE_CHECKING:
    from rtec.training import PredictorComparison, Row

_LEAST_FIRST = (8, 7, 6, 1, 3)
"""Columns in the order in which a narrow terminal does without."""
_TIMES = 10.0
"""Beyond which share an error is said to be so many times another one."""


def training_document(result: PredictorComparison) -> dict[str, object]:
    """Return a comparison as it stands in JSON."""
    return {
        "source": result.source,
        "heldout_by": result.parts.heldout_by,
        "readings": {part: getattr(result.parts, part).rows for part in ("train", "choose", "sure", "heldout")},
        "repeatability_um": _um(result.noise_mm),
        "screw_pitch_mm": result.pitch_mm,
        "best": None if result.best is None else result.best.name,
        "chosen": None if result.chosen is None else result.chosen.name,
        "interrupted": result.interrupted,
        "notes": list(result.notes),
        "rows": [_row(row) for row in result.ranked],
    }


def _row(row: Row) -> dict[str, object]:
    return {
        "name": row.name,
        "kind": row.kind.value,
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


def training_table(result: PredictorComparison, width: int | None = None) -> Table:
    """Return the rows, the lowest held-out error first.

    Parameters
    ----------
    result
        The comparison.
    width
        Of the terminal. Where it is too narrow for all columns, those that say least are left out, and the caption
        names them. None: all columns.
    """
    judge = "held\nout, µm" if result.parts.heldout_by == "places" else "other\nfile, µm"
    headings = ("predictor", "fitted\nµm", judge, "worst\nµm", "90 %\n± µm", "held", "numbers", "fit", "ns")
    styles = ["bold green" if row is result.best else "" if row.works else "dim" for row in result.ranked]
    return figures_table(headings, [_cells(row) for row in result.ranked], styles, _LEAST_FIRST, width)


def figures_table(
    headings: Sequence[str],
    cells: Sequence[Sequence[str]],
    styles: Sequence[str],
    least_first: Sequence[int],
    width: int | None,
) -> Table:
    """Return a table of names and figures that does without what says least on a narrow terminal.

    Parameters
    ----------
    headings
        Of the columns, in one line or two.
    cells, styles
        What stands in each row, and how it looks.
    least_first
        Columns in the order in which a narrow terminal does without; the caption names them.
    width
        Of the terminal; None: all columns.
    """
    wide = [max(_length(heading), *(len(row[column]) for row in cells)) for column, heading in enumerate(headings)]
    shown = list(range(len(headings)))
    for least in least_first:
        if width is not None and sum(wide[column] + 1 for column in shown) > width + 1:
            shown.remove(least)
    left_out = [headings[column].replace("\n", " ") for column in range(len(headings)) if column not in shown]
    loose = width is None or sum(wide[column] + 2 for column in shown) <= width + 1
    table = Table(box=SIMPLE, show_edge=False, pad_edge=False, padding=(0, int(loose), 0, 0), caption_justify="left")
    table.caption = f"a wider terminal also shows: {', '.join(left_out)}" if left_out else None
    for column in shown:
        table.add_column(
            headings[column], justify="right" if column else "left", no_wrap=True, min_width=wide[column]
        )
    for text, style in zip(cells, styles, strict=True):
        table.add_row(*(text[column] for column in shown), style=style)
    return table


def _length(heading: str) -> int:
    return max(map(len, heading.split("\n")))


def _cells(row: Row) -> list[str]:
    """Return what stands in a row; nothing beside the name where it has no figure."""
    if row.rms_heldout_mm is None:
        return [row.name, *[""] * 8]
    interval = row.interval_mm if row.interval_mm is not None else math.inf
    sure = math.isfinite(interval) and row.coverage is not None
    return [
        row.name,
        _three(row.rms_train_mm),
        _three(row.rms_heldout_mm),
        _three(row.worst_heldout_mm),
        _three(interval) if sure else MISSING,
        f"{100.0 * (row.coverage or 0.0):.0f} %" if sure else MISSING,
        str(row.parameters),
        f"{row.train_s:.1f} s",
        f"{row.eval_ns:.0f}",
    ]


def _three(value_mm: float | None) -> str:
    return "" if value_mm is None else f"{1e3 * value_mm:.3g}"


def training_sentence(result: PredictorComparison) -> str:
    """Return what the comparison says, in sentences."""
    lines = []
    best = result.best
    if best is None:
        lines.append("No predictor has a figure.")
    else:
        lines.append(f"Best: {best.name}, {_three(best.rms_heldout_mm)} µm on {_judges(result)}.")
        lines += _beside(result, best)
        lines += _beside_nothing(result)
    if result.noise_mm is not None:
        lines.append(f"Repeated readings differ by {_three(result.noise_mm)} µm (standard deviation): no predictor "
                     "can do better than that.")  # fmt: skip
    lines += _reasons(result)
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
    kinds = {Kind.TABLE: "the best table", Kind.GEOMETRY: "the best geometry of all axes"}
    kinds |= {Kind.MODEL: "the effects that were found", Kind.NETWORK: "the best network"}
    for kind, words in kinds.items():
        row = result.best_of(kind)
        if row is None or row is best or row.rms_heldout_mm is None or best.rms_heldout_mm is None:
            continue
        more = row.rms_heldout_mm / best.rms_heldout_mm - 1.0
        figure = f"{_three(row.rms_heldout_mm)} µm with {row.parameters} numbers"
        verdict = f"{100.0 * more:.0f} % more" if more < _TIMES else f"{1.0 + more:.3g} times as much"
        verdict = "as good" if result.is_as_good(row) else verdict
        lines.append(f"{words[0].upper()}{words[1:]} ({row.name}): {figure}, {verdict}.")
        if kind is Kind.GEOMETRY:
            lines += [f"  {note}" for note in row.notes]
    model = result.best_of(Kind.MODEL)
    gone = () if model is None else (note for note in model.notes if " is left out" in note)
    return [*lines, *(f"Of {model.name}, {note}." for note in gone if model is not None)]


def _beside_nothing(result: PredictorComparison) -> list[str]:
    bare = result.best_of(Kind.NONE)
    if bare is None or result.is_worth_it:
        return []
    return [f"Without any correction it is {_three(bare.rms_heldout_mm)} µm: no predictor is worth its place here."]


def _reasons(result: PredictorComparison) -> list[str]:
    """Return why rows have no figure, those of one design that say the same in one line."""
    said: dict[tuple[str, str], list[str]] = {}
    for row in result.rows:
        if row.reason:
            design, _, last = row.name.rpartition(" ")
            said.setdefault((design, row.reason), []).append(last)
    lines = []
    for (design, reason), lasts in said.items():
        name = joined(lasts)
        lines.append(f"{design} {name}: {printable(reason)}" if design else f"{name}: {printable(reason)}")
    return lines
