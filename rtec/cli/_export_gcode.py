"""``rtec export MODEL.toml --gcode PART.nc -o OUT.nc``: a program whose axis words are corrected."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli._console import note, progress
from rtec.errors import ArgumentError

if TYPE_CHECKING:
    from rtec.cli._export_known import Known

_LETTERS = "XYZUVW"


def gcode_axis(axis: str | None, number: int | None) -> str:
    """Return the letter of the axis: as given, else that of the model's number, else X.

    Raises
    ------
    ArgumentError
        No letter of a linear axis.
    """
    if axis is None:
        return "XYZ"[number - 1] if number is not None and number <= len("XYZ") else "X"
    letter = axis.upper()
    if len(letter) != 1 or letter not in _LETTERS:
        raise ArgumentError("--axis", axis[:40], f"one of {', '.join(_LETTERS)}")
    return letter


def write_program(
    known: Known,
    program: Path,
    target: Path,
    axis: str,
    *,
    range_mm: tuple[float, float],
    within_mm: float,
    resolution_mm: float,
    zero_mm: float,
    unit_mm: float,
) -> dict[str, Any]:
    """Write the program and return what is said of it.

    Raises
    ------
    RtecError
        As `rtec.study.gcode.program.correct_program`.
    """
    from rtec.inference.model import Model
    from rtec.inference.static_predictor import predictor_of_model
    from rtec.study.compensation import MOST_NODES, compensation_of
    from rtec.study.gcode.program import correct_program

    table = compensation_of(known.predictor, *range_mm, within_mm=within_mm, most=MOST_NODES, warmth=known.warmth)
    errors = known.predictor
    if isinstance(errors, Model):
        errors = predictor_of_model(errors, *range_mm, known.warmth)[0]
    head = (
        f"Positions of {axis} corrected by rtec for the errors of {known.name}{known.at}",
        f"For a machine that does not correct {axis} itself. Numbers of {axis} are commands, not places",
    )
    with progress(f"correcting {program.name}"[:60]) as show:
        done = correct_program(
            program, target, table=table, predictor=errors, axis=axis, head=head, zero_mm=zero_mm, unit_mm=unit_mm,
            resolution_mm=resolution_mm, within_mm=within_mm, progress=show,
        )  # fmt: skip
    return {
        "axis": axis,
        "lines": done.lines,
        "lines_written": done.lines_written,
        "moves": done.moves,
        "moves_outside": done.outside,
        "left_max_um": 1e3 * max(done.points_max_mm, done.between_max_mm),
        "points_max_um": 1e3 * done.points_max_mm,
        "points_rms_um": 1e3 * done.points_rms_mm,
        "between_max_um": 1e3 * done.between_max_mm,
        "between_rms_um": 1e3 * done.between_rms_mm,
        "before_max_um": 1e3 * done.before_max_mm,
        "before_rms_um": 1e3 * done.before_rms_mm,
        "left_out": [{"effect": one.effect, "why": one.why} for one in table.left_out],
        "notes": [{"line": line, "note": sentence} for sentence, line in done.notes],
    }


def show_program(document: dict[str, Any], known: Known) -> None:
    """Say what became of a program."""
    typer.echo(
        f"{document['file']}: {document['moves']} moves of {document['axis']} corrected for {known.name}{known.at}; "
        f"{document['lines_written']} lines of {document['lines']}"
    )
    typer.echo(
        f"Error left where moves end: {document['points_max_um']:.3g} µm at most, {document['points_rms_um']:.3g} µm "
        f"RMS; along feed moves {document['between_max_um']:.3g} µm and {document['between_rms_um']:.3g} µm; without "
        f"a correction {document['before_max_um']:.3g} µm and {document['before_rms_um']:.3g} µm"
    )
    if document["moves_outside"]:
        low_mm, high_mm = document["from_mm"], document["to_mm"]
        outside = f"{document['moves_outside']} moves end outside of {low_mm:g} to {high_mm:g} mm"
        note(f"{outside}: the error of the end is held")
    for one in document["notes"]:
        note(f"line {one['line']}: {one['note']}")
