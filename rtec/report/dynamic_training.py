"""What ``rtec train --dynamic`` shows: a row for each model of motion, as a document and on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from rtec.report.appearance import MISSING, printable
from rtec.report.training import figures_table
from rtec.training.dynamic_results import DynamicKind
from rtec.units import symbol

if TYPE_CHECKING:
    from rtec.training.dynamic_results import DynamicComparison, DynamicRow

_LEAST_FIRST = (9, 5, 6, 8, 7, 3, 4, 1)
"""Columns in the order in which a narrow terminal does without."""
_CLEARLY = 1.05
"""Times another error that is worth a sentence."""


def dynamic_document(result: DynamicComparison) -> dict[str, object]:
    """Return a comparison as it stands in JSON.

    Errors are in ``unit``, which each row repeats: um for positions, also where a key ends in ``_um``.
    """
    head = result.log.head
    return {
        "source": result.log.measurement.source,
        "observe": result.log.observe,
        "inputs": list(head.names),
        "period_s": head.period_s,
        "unit": result.unit,
        "heldout_by": result.heldout_by,
        "samples": result.samples,
        "chosen": result.chosen,
        "interrupted": result.interrupted,
        "notes": [*result.log.notes, *result.notes],
        "rows": [_row(row, result.unit) for row in result.ranked],
    }


def _row(row: DynamicRow, unit: str) -> dict[str, object]:
    return {
        "name": row.name,
        "kind": row.kind.value,
        "unit": unit,
        "rms_train_um": row.rms_train,
        "rms_validation": row.rms_validation,
        "rms_heldout_um": row.rms_heldout,
        "free_run_rms": row.rms_heldout,
        "rms_first_tenth": row.rms_first_tenth,
        "rms_last_tenth": row.rms_last_tenth,
        "stable": row.stable,
        "train_s": row.train_s,
        "eval_ns": row.eval_ns,
        "parameters": row.parameters,
        "interval": row.interval,
        "coverage": row.coverage,
        "notes": list(row.notes),
        "reason": row.reason,
    }


def dynamic_table(result: DynamicComparison, width: int | None = None) -> Table:
    """Return the rows, the lowest held-out error first; all columns without a width of the terminal."""
    unit = symbol(result.unit)
    judge = f"unseen\n{unit}" if result.heldout_by == "the second half" else f"other\nlog, {unit}"
    headings = (
        "model", f"fitted\n{unit}", judge, "first\ntenth", "last\ntenth", f"90 %\n± {unit}", "held", "numbers", "fit",
        "ns",
    )  # fmt: skip
    styles = ["bold green" if row.name == result.chosen else "" if row.works else "dim" for row in result.ranked]
    return figures_table(headings, [_cells(row) for row in result.ranked], styles, _LEAST_FIRST, width)


def _cells(row: DynamicRow) -> list[str]:
    """Return what stands in a row; nothing beside the name where it has no figure."""
    if row.rms_heldout is None:
        return [row.name, *[""] * 9]
    errors = (row.rms_train, row.rms_heldout, row.rms_first_tenth, row.rms_last_tenth)
    sure = row.interval is not None and row.coverage is not None
    return [
        row.name,
        *(f"{error:.3g}" for error in errors if error is not None),
        f"{row.interval:.3g}" if sure else MISSING,
        f"{100.0 * (row.coverage or 0.0):.0f} %" if sure else MISSING,
        str(row.parameters),
        f"{row.train_s:.1f} s",
        f"{row.eval_ns:.0f}",
    ]


def dynamic_sentence(result: DynamicComparison) -> str:
    """Return what the comparison says, in sentences."""
    unit = symbol(result.unit)
    lines = []
    chosen = result.named(result.chosen)
    if chosen is None:
        lines.append("No model has a figure.")
    elif chosen.rms_heldout is None:
        lines.append(f"Chosen by the training part: {chosen.name}, but {chosen.reason}.")
    else:
        where = result.heldout_by if result.heldout_by != "the second half" else "the unseen second half"
        lines.append(
            f"Chosen by the training part: {chosen.name}, {chosen.rms_heldout:.3g} {unit} in free run over {where}."
        )
        lines += [f"  {note}" for note in chosen.notes]
        lines += _beside(result, chosen, unit)
    lines += [f"{printable(note[:1].upper() + note[1:])}." for note in result.notes]
    lines += [f"{row.name}: {printable(row.reason)}" for row in result.rows if row.reason]
    if result.interrupted:
        lines.append("Ended early: what was found so far.")
    return "\n".join(lines)


def _beside(result: DynamicComparison, chosen: DynamicRow, unit: str) -> list[str]:
    """Return how physics and the network do beside each other, and where a row does better than the chosen one."""
    lines = []
    best = {
        kind: row
        for kind in (DynamicKind.PHYSICAL, DynamicKind.NETWORK)
        for row in result.rows
        if row.kind is kind and row.rms_heldout is not None
    }
    if len(best) == 2:
        physical, network = (best[kind].rms_heldout or 0.0 for kind in (DynamicKind.PHYSICAL, DynamicKind.NETWORK))
        if network > _CLEARLY * physical:
            verdict = "physics beats the network"
        elif physical > _CLEARLY * network:
            verdict = "the network beats physics"
        else:
            verdict = "the network does as well as physics"
        numbers = [best[kind].parameters for kind in (DynamicKind.PHYSICAL, DynamicKind.NETWORK)]
        lines.append(
            f"On this log {verdict}: {network:.3g} {unit} with {numbers[1]} numbers, {physical:.3g} {unit} with "
            f"{numbers[0]}."
        )
    top = result.ranked[0]
    if top is not chosen and top.works and (chosen.rms_heldout or 0.0) > _CLEARLY * (top.rms_heldout or 0.0):
        lines.append(f"The unseen part would have chosen {top.name}: {top.rms_heldout:.3g} {unit}.")
    return lines
