"""What ``rtec train`` shows of a warm machine: methods, and which thermometers to buy, as a document and in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from rtec.report.appearance import MISSING, printable
from rtec.report.training import figures_table
from rtec.training.warm_results import SensorRow, WarmKind

if TYPE_CHECKING:
    from rtec.training.warm_results import WarmComparison, WarmRow

_LEAST_FIRST = (10, 8, 1, 9, 5, 7, 6, 4)
"""Columns in the order in which a narrow terminal does without."""
_SENSORS_LEAST_FIRST = (4, 5)
_COVERED = 90.0
_DIFFERS = 1.5
"""Times the error by rows that the held-out one has to be to be worth a sentence."""
_MOST_NAMED = 6
_STABLE = 0.5
_ASKED = 3
"""Thermometers that people ask for."""
_PREFIX = "temperature_"


def warm_document(result: WarmComparison) -> dict[str, object]:
    """Return a comparison as it stands in JSON; all errors are in um."""
    parts = result.parts
    return {
        "source": parts.log.source,
        "observe": list(parts.log.outputs),
        "inputs": list(parts.log.inputs),
        "unit": "um",
        "blocks": {"by": parts.log.blocks.by, "train": parts.blocks, "names": list(parts.log.blocks.names)},
        "heldout_by": parts.heldout_by,
        "samples": {"train": int(parts.rows.size), "heldout": int(parts.judging.size)},
        "chosen": result.chosen,
        "interrupted": result.interrupted,
        "notes": [*parts.log.notes, *result.notes],
        "rows": [_row(row) for row in result.ranked],
        "sensors": [_sensor_row(row) for row in result.sensors],
    }


def _row(row: WarmRow) -> dict[str, object]:
    return {
        "name": row.name,
        "kind": row.kind.value,
        "rms_train_um": row.rms_train_um,
        "rms_blocks_um": row.rms_blocks_um,
        "rms_heldout_um": row.rms_heldout_um,
        "rms_rows_um": row.rms_rows_um,
        "rms_hourly_um": row.rms_hourly_um,
        "train_s": row.train_s,
        "eval_ns": row.eval_ns,
        "parameters": row.parameters,
        "interval_um": row.interval_um,
        "coverage": row.coverage,
        "needs_probe": row.needs_probe,
        "channels": {
            name: {
                "rms_train_um": one.rms_train_um,
                "rms_blocks_um": one.rms_blocks_um,
                "rms_heldout_um": one.rms_heldout_um,
                "rms_rows_um": one.rms_rows_um,
            }
            for name, one in row.channels.items()
        },
        "notes": list(row.notes),
        "reason": row.reason,
    }


def _sensor_row(row: SensorRow) -> dict[str, object]:
    return {
        "number": len(row.sensors),
        "sensors": list(row.sensors),
        "rms_blocks_um": row.rms_blocks_um,
        "rms_heldout_um": row.rms_heldout_um,
        "rms_hourly_um": row.rms_hourly_um,
        "share": dict(row.share),
        "same": row.same,
    }


def warm_table(result: WarmComparison, width: int | None = None) -> Table:
    """Return the rows, the lowest held-out error first; all columns without a width of the terminal."""
    judge = "held\nout, µm" if result.parts.judge is result.parts.log else "other\nfile, µm"
    headings = (
        "model", "fitted\nµm", "left-out\nblocks", judge, "with hourly\nprobe", "left-out\nrows", "90 %\n± µm",
        "held", "numbers", "fit", "ns",
    )  # fmt: skip
    ranked = result.ranked
    styles = ["bold green" if row.name == result.chosen else "" if row.works else "dim" for row in ranked]
    return figures_table(headings, [_cells(row) for row in ranked], styles, _LEAST_FIRST, width)


def _cells(row: WarmRow) -> list[str]:
    """Return what stands in a row; nothing beside the name where it has no figure."""
    if row.rms_heldout_um is None:
        return [row.name, *[""] * 10]
    errors = (row.rms_train_um, row.rms_blocks_um, row.rms_heldout_um, row.rms_hourly_um, row.rms_rows_um)
    sure = row.interval_um is not None and row.coverage is not None
    return [
        row.name,
        *(MISSING if error is None else f"{error:.3g}" for error in errors),
        f"{row.interval_um:.3g}" if sure else MISSING,
        f"{100.0 * (row.coverage or 0.0):.0f} %" if sure else MISSING,
        str(row.parameters),
        f"{row.train_s:.1f} s",
        f"{row.eval_ns:.0f}",
    ]


def sensor_table(result: WarmComparison, width: int | None = None) -> Table:
    """Return a row for each number of thermometers."""
    headings = (
        "number", "thermometers", "left-out\nblocks, µm", "held\nout, µm", "with hourly\nprobe", "chosen\nagain",
    )  # fmt: skip
    cells = [
        [
            str(len(row.sensors)),
            "all" if row.is_all and len(row.sensors) > _MOST_NAMED else ", ".join(map(short_name, row.sensors)),
            f"{row.rms_blocks_um:.3g}",
            f"{row.rms_heldout_um:.3g}",
            f"{row.rms_hourly_um:.3g}",
            MISSING if row.is_all else f"{100.0 * row.same:.0f} %",
        ]
        for row in result.sensors
    ]
    return figures_table(headings, cells, [""] * len(cells), _SENSORS_LEAST_FIRST, width)


def short_name(sensor: str) -> str:
    """Return the name of a thermometer as people call it.

    Examples
    --------
    >>> short_name("temperature_front_bearing")
    'front_bearing'
    """
    return sensor.removeprefix(_PREFIX)


def warm_sentence(result: WarmComparison) -> str:
    """Return what the comparison says, in sentences."""
    lines = []
    chosen = result.named(result.chosen)
    if chosen is None:
        why = "no model has a figure by left-out blocks"
        if any(row.works for row in result.rows):
            why = "none is better than the mean on left-out blocks"
        lines.append(f"No model is chosen: {why}.")
    else:
        lines += _of_chosen(result, chosen)
    lines += [f"{printable(note[:1].upper() + note[1:])}." for note in result.notes]
    lines += _flags(result)
    lines += [f"{row.name}: {printable(row.reason)}" for row in result.rows if row.reason]
    if result.interrupted:
        lines.append("Ended early: the rows that were finished.")
    return "\n".join(lines)


def _of_chosen(result: WarmComparison, row: WarmRow) -> list[str]:
    """Return what is to be said of the chosen row."""
    mean = next((one for one in result.rows if one.kind is WarmKind.NONE and not one.needs_probe), None)
    lines = []
    if row.rms_heldout_um is not None:
        left = None if mean is None else mean.rms_heldout_um
        beside = "" if left is None else f"; the mean leaves {left:.3g} µm"
        where = result.parts.heldout_by
        lines.append(f"Chosen by left-out blocks: {row.name}, {row.rms_heldout_um:.3g} µm on {where}{beside}.")
    lines += [f"  {printable(note)}" for note in row.notes]
    if len(row.channels) > 1:
        each = ", ".join(f"{name} {one.rms_heldout_um:.3g}" for name, one in row.channels.items())
        lines.append(f"Each channel, held out: {each} µm.")
    if row.coverage is not None and row.interval_um is not None:
        lines.append(
            f"Its intervals for {_COVERED:.0f} % hold {100.0 * row.coverage:.0f} % of these readings, "
            f"± {row.interval_um:.3g} µm."
        )
    if row.rms_hourly_um is not None and row.rms_heldout_um is not None:
        lines.append(
            f"With a probe that reads once an hour, and an offset that follows it: {row.rms_hourly_um:.3g} µm."
        )
    if row.rms_rows_um is not None and (row.rms_heldout_um or 0.0) > _DIFFERS * row.rms_rows_um:
        lines.append(
            f"With random rows left out, as others report, it would be {row.rms_rows_um:.3g} µm: neighbours in time "
            "tell each other, so that this figure does not hold at another duty cycle."
        )
    return lines


def _flags(result: WarmComparison) -> list[str]:
    """Return rows that are worse than the mean, and what makes others no choice."""
    return [
        f"{row.name}: {printable(note)}"
        for row in result.rows
        for note in row.notes
        if note.startswith("Worse than") or (row.needs_probe and row.name != result.chosen)
    ]


def sensor_sentence(result: WarmComparison) -> str:
    """Return which thermometers to buy, and how sure that is."""
    some = [row for row in result.sensors if not row.is_all]
    if not some:
        return ""
    lowest = min(row.rms_blocks_um for row in result.sensors)
    enough = next((row for row in result.sensors if row.rms_blocks_um <= 1.1 * lowest), some[-1])
    names = ", ".join(f"{short_name(name)} ({100.0 * row_share:.0f} %)" for name, row_share in enough.share.items())
    lines = []
    if (three := next((row for row in some if len(row.sensors) == _ASKED), None)) is not None:
        best = ", ".join(map(short_name, three.sensors))
        every = result.sensors[-1].rms_heldout_um
        lines.append(f"Three thermometers: {best}, {three.rms_heldout_um:.3g} µm held out ({every:.3g} µm with all).")
    if enough.is_all:
        lines.append("No set of fewer thermometers comes within a tenth of all of them on left-out blocks.")
        return "\n".join(lines)
    sure = (
        "without one of the blocks mostly the same are chosen."
        if enough.same >= _STABLE
        else "without one of the blocks others are chosen: thermometers that warm together replace each other."
    )
    how_many = "1 thermometer comes" if len(enough.sensors) == 1 else f"{len(enough.sensors)} thermometers come"
    lines.append(
        f"{how_many} within a tenth of the lowest error on left-out blocks: {names}. In brackets, how often each is "
        f"chosen again; {sure}"
    )
    return "\n".join(lines)
