"""``rtec export``: a model as the compensation table of somebody else's program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json
from rtec.errors import ArgumentError

if TYPE_CHECKING:
    from rtec.inference.model import Model
    from rtec.inference.static_predictor import LeftOut

_UNITS = {"mm": 1.0, "inch": 25.4}


def _file(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text)


def export(
    model: Annotated[Path, typer.Argument(metavar="MODEL.toml", help="Model of an axis.", show_default=False)],
    linuxcnc: Annotated[
        Path | None, _file("F.comp", "For LinuxCNC: nominal, forward and reverse position (COMP_FILE_TYPE = 0).")
    ] = None,
    csv: Annotated[Path | None, _file("F.csv", "Position, error forward and reverse.")] = None,
    c: Annotated[Path | None, _file("F.c", "A function in C99.")] = None,
    start: Annotated[
        str | None, typer.Option("--from", metavar="'0 mm'", help="Begin of the table; where the measurement began.")
    ] = None,
    end: Annotated[
        str | None, typer.Option("--to", metavar="'300 mm'", help="Its end; where the measurement ended.")
    ] = None,
    within: Annotated[
        str, typer.Option(metavar="'0.1 um'", help="Difference that straight lines between its nodes may leave.")
    ] = "0.1 um",
    unit: Annotated[str, typer.Option(metavar="mm|inch", help="Machine unit of LinuxCNC.")] = "mm",
    force: Annotated[bool, typer.Option("--force", help="Write over a file that exists.")] = False,
    json: _measured.Json = False,
) -> None:
    """Write what a model says of position and direction as a table, and say what its straight lines leave.

    Effects of time, temperature or speed have no place in such a table; they are named.

    Example: rtec export found.toml --linuxcnc z.comp
    """
    given = {"linuxcnc": linuxcnc, "csv": csv, "c": c}
    files = {name: file for name, file in given.items() if file is not None}
    if not files:
        raise ArgumentError("output", "none", "--linuxcnc F.comp, --csv F.csv or --c F.c")
    if unit not in _UNITS:
        raise ArgumentError("--unit", repr(unit[:20]), "mm or inch")
    for name, file in files.items():
        _measured.check_new_file(f"--{name}", file, force=force)
    from rtec.metrology.text_file import write_lines
    from rtec.study.compensation import (
        LINUXCNC_TRIPLETS,
        MOST_NODES,
        c_lines,
        compensation_of,
        csv_lines,
        linuxcnc_lines,
    )
    from rtec.units import LENGTH, parse_quantity

    known = _error_model(model)
    low_mm, high_mm = _range(known, start, end)
    tolerance_mm = parse_quantity(within, LENGTH, name="--within")
    if tolerance_mm < 0.0:
        raise ArgumentError("--within", within, "a length from 0")
    documents: list[dict[str, object]] = []
    left_out: tuple[LeftOut, ...] = ()
    for name, file in files.items():
        most = LINUXCNC_TRIPLETS if name == "linuxcnc" else MOST_NODES
        table = compensation_of(known, low_mm, high_mm, within_mm=tolerance_mm, most=most)
        write = {"linuxcnc": lambda t: linuxcnc_lines(t, per_unit_mm=_UNITS[unit]), "csv": csv_lines, "c": c_lines}
        left_out = table.left_out
        write_lines(file, write[name](table))
        documents.append(
            {
                "format": name,
                "file": str(file),
                "nodes": int(table.position_mm.size),
                "from_mm": low_mm,
                "to_mm": high_mm,
                "interpolation_error_um": 1e3 * table.interpolation_mm,
                "left_out": [{"effect": one.effect, "why": one.why} for one in table.left_out],
            }
        )
    if json:
        print_json({"model": str(model), "tables": documents})
        return
    for one in documents:
        typer.echo(
            f"{one['file']}: {one['nodes']} nodes from {low_mm:g} to {high_mm:g} mm; straight lines between them "
            f"differ from the model by {one['interpolation_error_um']:.3g} µm at most"
        )
    for left in left_out:
        note(f"{left.effect} is not in the table: {left.why}")


def _error_model(path: Path) -> Model:
    """Return the model of an error of position that a file holds; in mm where it does not say otherwise."""
    from rtec.effects import Units
    from rtec.errors import FileFormatError
    from rtec.inference.model_file import read_model, read_observe
    from rtec.inference.static_predictor import check_of_positions

    observe = read_observe(path)
    if observe != "deviation":
        allowed = "a model of a deviation: a table corrects positions, and no force, torque or current"
        raise ArgumentError(f"{path}: observe", repr(observe)[:60], allowed)
    try:
        model = read_model(path)  # one that was written by rtec states its units
    except FileFormatError:
        model = read_model(path, Units("mm", "mm", "s"))
    check_of_positions(model)  # before a range of positions is asked for, which a model over time has not
    return model


def _range(model: Model, start: str | None, end: str | None) -> tuple[float, float]:
    """Return the range of the table in mm: as given, else where the model was measured, else that of its maps."""
    from rtec.units import LENGTH, parse_quantity

    nodes = [x for term in model.terms for x in getattr(term.shape, "nodes", ())]
    low, high = model.range or ((min(nodes), max(nodes)) if nodes else (None, None))
    low = low if start is None else parse_quantity(start, LENGTH, name="--from")
    high = high if end is None else parse_quantity(end, LENGTH, name="--to")
    if low is None or high is None:
        what = "--from" if low is None else "--to"
        raise ArgumentError(
            what, "nothing", "a position such as '0 mm'", "the model does not say where it was measured"
        )
    if not low < high:
        raise ArgumentError("--to", f"{high:g} mm", f"a position beyond {low:g} mm")
    return low, high
