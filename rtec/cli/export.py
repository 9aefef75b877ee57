"""``rtec export``: a model or a trained predictor as compensation of another program."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtec.checks import number_within
from rtec.cli import _measured
from rtec.cli._arguments import option
from rtec.cli._console import note, print_json
from rtec.errors import ArgumentError
from rtec.io import check_file

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rtec.inference.model import Model
    from rtec.predictors import Predictor
    from rtec.study.c_source import Precision
    from rtec.study.compensation import Compensation

_MACHINE_UNITS = ("mm", "inch")
_SHORTEST_MM = 1e-3
_FARTHEST_MM = 1e6


def _file(metavar: str, text: str) -> Any:
    return option(metavar=metavar, help=text)


def export(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL.toml", help="Model of an axis or trained predictor.", show_default=False)
    ],
    linuxcnc: Annotated[
        Path | None, _file("F.comp", "For LinuxCNC: nominal, forward and reverse position (COMP_FILE_TYPE = 0).")
    ] = None,
    csv: Annotated[Path | None, _file("F.csv", "Position, error forward and reverse.")] = None,
    c: Annotated[Path | None, _file("F.c", "A function in C99: a trained predictor itself, else the table.")] = None,
    precision: Annotated[str, option(metavar="double|single", help="Of the numbers in C.")] = "double",
    start: Annotated[
        str | None, option("--from", metavar="'0 mm'", help="Begin of the table; where the measurement began.")
    ] = None,
    end: Annotated[
        str | None, option("--to", metavar="'300 mm'", help="Its end; where the measurement ended.")
    ] = None,
    within: Annotated[
        str, option(metavar="'0.1 um'", help="Difference that straight lines between its nodes may leave.")
    ] = "0.1 um",
    unit: Annotated[str, option(metavar="mm|inch", help="Machine unit of LinuxCNC.")] = "mm",
    force: Annotated[bool, typer.Option("--force", help="Write over a file that exists.")] = False,
    json: _measured.Json = False,
) -> None:
    """Write what a model or a trained predictor says of position and direction, for another program.

    A table says how far its straight lines are from the model. Effects of time, temperature or speed have no place in
    it; they are named. A trained predictor leaves as C whole: constants and one function.

    Example: rtec export found.toml --linuxcnc z.comp
    Example: rtec export best.toml --c z.c --precision single
    Example: rtec export found.toml --csv z.csv --from "0 mm" --to "300 mm" --within "0.5 um"
    """
    given = {"linuxcnc": linuxcnc, "csv": csv, "c": c}
    files = {name: file for name, file in given.items() if file is not None}
    if not files:
        raise ArgumentError("output", "none", "--linuxcnc F.comp, --csv F.csv or --c F.c")
    if unit not in _MACHINE_UNITS:
        raise ArgumentError("--unit", repr(unit[:20]), "mm or inch")
    for name, file in files.items():
        check_file(f"--{name}", file, force=force)
    from rtec.io import choice, write_lines
    from rtec.predictors.predictor_file import is_predictor_file, read_predictor
    from rtec.study.c_source import Precision, name_in_c, predictor_lines
    from rtec.units import LENGTH, UNITS, parse_quantity

    digits = choice("--precision", precision, Precision)
    trained = read_predictor(model) if is_predictor_file(model) else None
    known = _error_model(model) if trained is None else trained.predictor
    low_mm, high_mm = _range(known, start, end)
    tolerance_mm = parse_quantity(within, LENGTH, name="--within")
    if tolerance_mm < 0.0:
        raise ArgumentError("--within", within, "a length from 0")
    documents: list[dict[str, Any]] = []
    for name, file in files.items():
        document: dict[str, Any] = {"format": name, "file": str(file)}
        if name == "c" and trained is not None:  # of its own ends, which the directions may have at different places
            held_mm = -math.inf if start is None else low_mm, math.inf if end is None else high_mm
            lines = predictor_lines(trained, name_in_c(file), held_mm=held_mm, precision=digits)
            document |= {"nodes": None, "interpolation_error_um": 0.0, "left_out": []}
        else:
            table = _table(name, known, (low_mm, high_mm), tolerance_mm)
            lines = _lines(name, file, table, UNITS[unit].factor, digits)
            document |= {
                "nodes": int(table.position_mm.size),
                "interpolation_error_um": 1e3 * table.interpolation_mm,
                "left_out": [{"effect": one.effect, "why": one.why} for one in table.left_out],
            }
        document |= {"from_mm": low_mm, "to_mm": high_mm}
        if name == "c":
            document |= {"function": f"{name_in_c(file)}_error_mm", "precision": precision}
        write_lines(file, lines)
        documents.append(document)
    if json:
        print_json({"model": str(model), "tables": documents})
        return
    for document in documents:
        typer.echo(_sentence(document))
    for left in documents[-1]["left_out"]:
        note(f"{left['effect']} is not in the table: {left['why']}")


def _table(name: str, known: Model | Predictor, range_mm: tuple[float, float], within_mm: float) -> Compensation:
    from rtec.study.compensation import LINUXCNC_TRIPLETS, MOST_NODES, compensation_of

    most = LINUXCNC_TRIPLETS if name == "linuxcnc" else MOST_NODES
    return compensation_of(known, *range_mm, within_mm=within_mm, most=most)


def _lines(name: str, file: Path, table: Compensation, per_unit_mm: float, precision: Precision) -> Iterator[str]:
    from rtec.study.c_source import compensation_lines, name_in_c
    from rtec.study.compensation import csv_lines, linuxcnc_lines

    if name == "linuxcnc":
        return linuxcnc_lines(table, per_unit_mm=per_unit_mm)
    return csv_lines(table) if name == "csv" else compensation_lines(table, name_in_c(file), precision=precision)


def _sentence(document: dict[str, Any]) -> str:
    """Return what a file holds, in words."""
    reach = f"from {document['from_mm']:g} to {document['to_mm']:g} mm"
    if document["nodes"] is None:
        return (
            f"{document['file']}: {document['function']}(), the predictor itself {reach}, "
            f"in {document['precision']} precision"
        )
    what = f"{document['function']}(), " if "function" in document else ""
    return (
        f"{document['file']}: {what}{document['nodes']} nodes {reach}; straight lines between them "
        f"differ from the model by {document['interpolation_error_um']:.3g} µm at most"
    )


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


def _range(known: Model | Predictor, start: str | None, end: str | None) -> tuple[float, float]:
    """Return the range of the table in mm: as given, else where the model was measured, else that of its maps."""
    from rtec.inference.model import Model
    from rtec.units import LENGTH, parse_quantity

    low: float | None
    high: float | None
    if isinstance(known, Model):
        nodes = [x for term in known.terms for x in getattr(term.shape, "nodes", ())]
        low, high = known.range or ((min(nodes), max(nodes)) if nodes else (None, None))
    else:
        low, high = known.range_mm
    low = low if start is None else parse_quantity(start, LENGTH, name="--from")
    high = high if end is None else parse_quantity(end, LENGTH, name="--to")
    if low is None or high is None:
        what = "--from" if low is None else "--to"
        raise ArgumentError(
            what, "nothing", "a position such as '0 mm'", "the model does not say where it was measured"
        )
    for name, place_mm in (("--from", low), ("--to", high)):
        number_within(name, place_mm, -_FARTHEST_MM, _FARTHEST_MM, unit="mm")
    if not high >= low + _SHORTEST_MM:
        if end is None:
            raise ArgumentError("--from", f"{low:g} mm", f"a position before {high:g} mm, by a micrometre or more")
        raise ArgumentError("--to", f"{high:g} mm", f"a position beyond {low:g} mm, by a micrometre or more")
    return low, high
