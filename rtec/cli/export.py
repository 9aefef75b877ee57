"""``rtec export``: a model or a trained predictor as compensation of another program."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json
from rtec.cli._export_known import EVERYWHERE_MM, SPINDLE, Known, known_of, range_of, warmth_of
from rtec.cli._parameters import force, member, needs, option, quantity, word, written
from rtec.errors import ArgumentError
from rtec.units import LENGTH, TIME, UNITS, parse_quantity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rtec.predictors import KnownPredictor, Narx
    from rtec.study.c_source import Precision

_WARMTH, _PROGRAM = "How warm the machine is", "A program of G-code"
_FINEST_MM, _COARSEST_MM = 1e-6, 0.01


def _tolerance(said: str) -> float:
    tolerance_mm = parse_quantity(said, LENGTH, name="--within")
    if tolerance_mm < 0.0:
        raise ArgumentError("--within", said, "a length of 0 or more")
    return tolerance_mm


def _resolution(said: str) -> float:
    steps_mm = parse_quantity(said, LENGTH, name="--resolution")
    if not _FINEST_MM <= steps_mm <= _COARSEST_MM:
        raise ArgumentError("--resolution", said, "0.001 um to 10 um")
    return steps_mm


def export(
    model: Path = typer.Argument(
        ..., metavar="MODEL.toml", help="Model of an axis or trained predictor.", show_default=False
    ),
    linuxcnc: Path | None = written(
        "--linuxcnc", "F.comp", "For LinuxCNC: nominal, forward and reverse position (COMP_FILE_TYPE = 0)."
    ),
    sinumerik: Path | None = written("--sinumerik", "F", "For Sinumerik: $AA_ENC_COMP, or the thermal shift."),
    heidenhain: Path | None = written("--heidenhain", "F.COM", "For Heidenhain: table of compensation values."),
    csv: Path | None = written("--csv", "F.csv", "Position, error forward and reverse."),
    c: Path | None = written("--c", "F.c", "A function in C99: a trained predictor itself, else the table."),
    precision: Precision = member(
        "--precision", "rtec.study.c_source:Precision", "double|single", "Of the numbers in C.", default="double"
    ),
    start_mm: float | None = quantity("--from", LENGTH, "'0 mm'", "Begin of the table; where the measurement began."),
    end_mm: float | None = quantity("--to", LENGTH, "'300 mm'", "Its end; where the measurement ended."),
    within_mm: float = option(
        "--within",
        "'0.1 um'",
        "Difference that straight lines between its nodes may leave.",
        read=_tolerance,
        default="0.1 um",
    ),
    unit: str = word("--unit", "mm|inch", "Machine unit of LinuxCNC and of a program.", default="mm"),
    axis: str | None = option("--axis", "X", "Axis of a control or a program; that of the model, else X."),
    since_on_s: float | None = quantity("--at", TIME, "'60 min'", "Since it was switched on.", panel=_WARMTH),
    temperatures: list[str] | None = option(
        "--temperature", "NAME=22degC", "Of a thermometer; once for each.", panel=_WARMTH
    ),
    spindle_rpm: float | None = quantity("--spindle", SPINDLE, "3000rpm", "Speed of the spindle.", panel=_WARMTH),
    gcode: Path | None = option("--gcode", "PART.nc", "Correct the words of an axis in it.", panel=_PROGRAM),
    output: Path | None = written("-o --output", "OUT.nc", "The corrected program.", panel=_PROGRAM),
    zero_mm: float = quantity(
        "--zero", LENGTH, "'0 mm'", "Where the program's zero lies on the axis.", panel=_PROGRAM, default="0 mm"
    ),
    resolution_mm: float = option(
        "--resolution", "'0.1 um'", "Steps of its numbers.", read=_resolution, panel=_PROGRAM, default="0.1 um"
    ),
    effects: Path | None = _measured.EFFECTS,
    force: bool = force("Write over a file that exists."),
    json: bool = _measured.JSON,
) -> None:
    """Write what a model or a trained predictor says of position and direction, for another program.

    A table says how far its straight lines are from the model. Effects of heat are in it at the temperature or the
    time that is given, and a model that has some is not exported without. Other effects of time or speed have no
    place in a table; they are named. A trained predictor leaves as C whole: constants and one function. So does a
    NARX network, with a struct for its memory.

    Example: rtec export warm.toml --sinumerik z_eec.spf --axis z --temperature screw=26degC
    Example: rtec export found.toml --gcode part.nc -o part_x.nc --axis x --zero "120 mm" --at "60 min"
    Example: rtec export best.toml --c z.c --precision single
    """
    given = {"linuxcnc": linuxcnc, "sinumerik": sinumerik, "heidenhain": heidenhain, "csv": csv, "c": c}
    files = {name: file for name, file in given.items() if file is not None}
    if gcode is not None and output is None:
        raise needs("--gcode", "-o OUT.nc")
    if gcode is None and output is not None:
        raise needs("-o", "--gcode PART.nc")
    if not files and gcode is None:
        allowed = "--linuxcnc, --sinumerik, --heidenhain, --csv or --c with a file, or --gcode PART.nc -o OUT.nc"
        raise ArgumentError("a file to write", None, allowed)
    from rtec.predictors.narx import Narx
    from rtec.predictors.predictor_file import is_predictor_file, read_predictor

    trained = read_predictor(model) if is_predictor_file(model) else None
    warmth = warmth_of(since_on_s, temperatures or (), spindle_rpm)
    if trained is not None and isinstance(trained.predictor, Narx):
        others = {"--gcode": gcode, "--temperature": warmth, "--from": start_mm, "--to": end_mm}
        _narx(trained, trained.predictor, files, [name for name, value in others.items() if value is not None],
              precision, model if json else None)  # fmt: skip
        return
    known = known_of(model, trained, warmth, effects)
    documents = [
        _written(name, file, known, (start_mm, end_mm), within_mm, UNITS[unit].factor, precision, axis)
        for name, file in files.items()
    ]
    if gcode is not None and output is not None:
        documents.append(
            _program(known, gcode, output, axis, (start_mm, end_mm), within_mm, resolution_mm, zero_mm,
                     UNITS[unit].factor)
        )  # fmt: skip
    if json:
        print_json({"model": str(model), "warmth": None if known.warmth is None else str(known.warmth),
                    "tables": documents})  # fmt: skip
        return
    _show(documents, known)


def _show(documents: list[dict[str, Any]], known: Known) -> None:
    from rtec.cli._export_gcode import show_program

    for document in documents:
        if document["format"] == "gcode":
            show_program(document, known)
        else:
            typer.echo(_sentence(document, known))
    if known.shift_mm is not None:
        note(f"{known.name} knows no positions: {1e3 * known.shift_mm:.3g} µm everywhere")
    for left in documents[-1]["left_out"]:
        note(f"{left['effect']} is not in the table: {left['why']}")


def _written(
    name: str,
    file: Path,
    known: Known,
    ends_mm: tuple[float | None, float | None],
    within_mm: float,
    per_unit_mm: float,
    precision: Precision,
    axis: str | None,
) -> dict[str, Any]:
    """Write a table and return what is said of it."""
    from rtec.io import write_lines
    from rtec.study.c_source import name_in_c

    if name == "sinumerik" and known.shift_mm is not None:
        return _shift(file, known, known.shift_mm, axis)
    low_mm, high_mm = range_of(known, *ends_mm)
    if name == "c" and known.trained is not None and known.shift_mm is None:
        # of its own ends, which the directions may have at different places
        held_mm = -math.inf if ends_mm[0] is None else low_mm, math.inf if ends_mm[1] is None else high_mm
        lines, document = _predictor(known.trained, file, held_mm, precision)
    elif name in ("sinumerik", "heidenhain"):
        lines, document = _control(name, file, known, (low_mm, high_mm), within_mm, axis)
    else:
        lines, document = _compensation(name, file, known, (low_mm, high_mm), within_mm, per_unit_mm, precision)
    document |= {"from_mm": low_mm, "to_mm": high_mm}
    if name == "c":
        document |= {"function": f"{name_in_c(file)}_error_mm", "precision": precision.value}
    write_lines(file, lines)
    return {"format": name, "file": str(file)} | document


def _program(
    known: Known,
    program: Path,
    target: Path,
    axis: str | None,
    ends_mm: tuple[float | None, float | None],
    within_mm: float,
    resolution_mm: float,
    zero_mm: float,
    unit_mm: float,
) -> dict[str, Any]:
    from rtec.cli._export_gcode import gcode_axis, write_program

    letter = gcode_axis(axis, None if known.trained is None else known.trained.axis)
    range_mm = EVERYWHERE_MM if known.shift_mm is not None else range_of(known, *ends_mm)
    document = write_program(
        known, program, target, letter, range_mm=range_mm, within_mm=within_mm, resolution_mm=resolution_mm,
        zero_mm=zero_mm, unit_mm=unit_mm,
    )  # fmt: skip
    return {"format": "gcode", "file": str(target)} | document | {"from_mm": range_mm[0], "to_mm": range_mm[1]}


def _narx(
    trained: KnownPredictor,
    narx: Narx,
    files: dict[str, Path],
    others: list[str],
    precision: Precision,
    shown: Path | None,
) -> None:
    """Write a NARX network, which has a C source and no table; ``shown``: the model of the JSON document."""
    from rtec.io import write_lines
    from rtec.study.c_source import name_in_c
    from rtec.study.narx_source import narx_lines

    others = [*(f"--{other}" for other in files if other != "c"), *others]
    if others:
        why = "it predicts from motion, and has no table over position"
        raise ArgumentError(others[0], "", "--c F.c alone", why, problem="means nothing for a NARX network")
    file = files["c"]
    write_lines(file, narx_lines(trained, narx, name_in_c(file), precision=precision))
    function = f"{name_in_c(file)}_step"
    if shown is not None:
        document = {"format": "c", "file": str(file), "function": function, "precision": precision.value}
        print_json({"model": str(shown), "tables": [document]})
    else:
        typer.echo(f"{file}: {function}(), the network itself, in {precision.value} precision")


def _predictor(
    trained: KnownPredictor, file: Path, held_mm: tuple[float, float], precision: Precision
) -> tuple[Iterator[str], dict[str, Any]]:
    """Return the lines of a trained predictor in C, and what is said of them."""
    from rtec.study.c_source import name_in_c, predictor_lines

    lines = predictor_lines(trained, name_in_c(file), held_mm=held_mm, precision=precision)
    return lines, {"nodes": None, "interpolation_error_um": 0.0, "left_out": []}


def _compensation(
    name: str,
    file: Path,
    known: Known,
    range_mm: tuple[float, float],
    within_mm: float,
    per_unit_mm: float,
    precision: Precision,
) -> tuple[Iterator[str], dict[str, Any]]:
    """Return the lines of a table, and what is said of them."""
    from rtec.study.c_source import compensation_lines, name_in_c
    from rtec.study.compensation import LINUXCNC_TRIPLETS, MOST_NODES, compensation_of, csv_lines, linuxcnc_lines

    most = LINUXCNC_TRIPLETS if name == "linuxcnc" else MOST_NODES
    table = compensation_of(known.predictor, *range_mm, within_mm=within_mm, most=most, warmth=known.warmth)
    if name == "linuxcnc":
        lines = linuxcnc_lines(table, per_unit_mm=per_unit_mm)
    elif name == "csv":
        lines = csv_lines(table)
    else:
        lines = compensation_lines(table, name_in_c(file), precision=precision)
    return lines, {
        "nodes": int(table.position_mm.size),
        "interpolation_error_um": 1e3 * table.interpolation_mm,
        "left_out": [{"effect": one.effect, "why": one.why} for one in table.left_out],
    }


def _control(
    name: str, file: Path, known: Known, range_mm: tuple[float, float], within_mm: float, axis: str | None
) -> tuple[Iterator[str], dict[str, Any]]:
    """Return the lines of a table of a control, and what is said of them."""
    from rtec.study import controls

    both_ways = name == "heidenhain"
    most = controls.HEIDENHAIN_POINTS if both_ways else controls.SINUMERIK_POINTS
    table = controls.even_table(
        known.predictor, *range_mm, within_mm=within_mm, most=most, both_ways=both_ways, warmth=known.warmth
    )
    document = {
        "nodes": int(table.forward_mm.size),
        "left_max_um": 1e3 * table.left_max_mm,
        "left_rms_um": 1e3 * table.left_rms_mm,
        "reversal_um": 1e3 * table.reversal_mm,
        "left_out": [{"effect": one.effect, "why": one.why} for one in table.left_out],
    }
    if both_ways:
        letter = controls.heidenhain_axis(_axis_of(known, axis))
        return controls.heidenhain_lines(table, letter, file.name), document | {"axis": letter}
    machine_axis = controls.sinumerik_axis(_axis_of(known, axis))
    left = f"Error left: {1e3 * table.left_max_mm:.3g} um at most, {1e3 * table.left_rms_mm:.3g} um RMS"
    said = (f"Errors of {machine_axis}: {known.name}{known.at}", left)
    return controls.sinumerik_lines(table, machine_axis, said), document | {"axis": machine_axis}


def _axis_of(known: Known, axis: str | None) -> str:
    number = None if known.trained is None else known.trained.axis
    return axis or ("X" if number is None else "XYZ"[number - 1] if number <= len("XYZ") else f"AX{number}")


def _shift(file: Path, known: Known, shift_mm: float, axis: str | None) -> dict[str, Any]:
    """Write the thermal shift of a Sinumerik."""
    from rtec.io import write_lines
    from rtec.study.controls import sinumerik_axis, sinumerik_shift_lines

    machine_axis = sinumerik_axis(_axis_of(known, axis))
    write_lines(file, sinumerik_shift_lines(shift_mm, machine_axis, (f"{known.name}{known.at}",)))
    document: dict[str, Any] = {"format": "sinumerik", "file": str(file), "axis": machine_axis, "nodes": 1}
    return document | {"shift_um": 1e3 * shift_mm, "left_max_um": 0.0, "left_out": []}


def _sentence(document: dict[str, Any], known: Known) -> str:
    if "shift_um" in document:
        return f"{document['file']}: thermal shift of {document['axis']}{known.at}: {document['shift_um']:.3g} µm"
    reach = f"from {document['from_mm']:g} to {document['to_mm']:g} mm"
    if document["nodes"] is None:
        return (
            f"{document['file']}: {document['function']}(), the predictor itself {reach}, "
            f"in {document['precision']} precision"
        )
    if "left_max_um" in document:
        return (
            f"{document['file']}: {document['axis']}, {document['nodes']} points {reach}{known.at}; error left "
            f"{document['left_max_um']:.3g} µm at most, {document['left_rms_um']:.3g} µm RMS"
        )
    what = f"{document['function']}(), " if "function" in document else ""
    return (
        f"{document['file']}: {what}{document['nodes']} nodes {reach}{known.at}; straight lines between them "
        f"differ from the model by {document['interpolation_error_um']:.3g} µm at most"
    )
