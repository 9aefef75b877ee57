"""``rtec export``: a model or a trained predictor as compensation of another program."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.checks import number_within
from rtec.cli import _measured
from rtec.cli._console import note, print_json
from rtec.cli._parameters import force, member, option, quantity, word, written
from rtec.errors import ArgumentError
from rtec.units import LENGTH, UNITS, parse_quantity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rtec.inference.model import Model
    from rtec.predictors import KnownPredictor, Narx, Predictor
    from rtec.study.c_source import Precision

_SHORTEST_MM = 1e-3
_FARTHEST_MM = 1e6


def _tolerance(said: str) -> float:
    tolerance_mm = parse_quantity(said, LENGTH, name="--within")
    if tolerance_mm < 0.0:
        raise ArgumentError("--within", said, "a length of 0 or more")
    return tolerance_mm


def export(
    model: Path = typer.Argument(
        ..., metavar="MODEL.toml", help="Model of an axis or trained predictor.", show_default=False
    ),
    linuxcnc: Path | None = written(
        "--linuxcnc", "F.comp", "For LinuxCNC: nominal, forward and reverse position (COMP_FILE_TYPE = 0)."
    ),
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
    unit: str = word("--unit", "mm|inch", "Machine unit of LinuxCNC.", default="mm"),
    effects: Path | None = _measured.EFFECTS,
    force: bool = force("Write over a file that exists."),
    json: bool = _measured.JSON,
) -> None:
    """Write what a model or a trained predictor says of position and direction, for another program.

    A table says how far its straight lines are from the model. Effects of time, temperature or speed have no place in
    it; they are named. A trained predictor leaves as C whole: constants and one function. So does a NARX network,
    with a struct for its memory.

    Example: rtec export found.toml --linuxcnc z.comp
    Example: rtec export best.toml --c z.c --precision single
    Example: rtec export found.toml --csv z.csv --from "0 mm" --to "300 mm" --within "0.5 um"
    """
    given = {"linuxcnc": linuxcnc, "csv": csv, "c": c}
    files = {name: file for name, file in given.items() if file is not None}
    if not files:
        raise ArgumentError("a file to write", None, "--linuxcnc F.comp, --csv F.csv or --c F.c")
    from rtec.io import write_lines
    from rtec.predictors.narx import Narx
    from rtec.predictors.predictor_file import is_predictor_file, read_predictor
    from rtec.study.c_source import name_in_c

    trained = read_predictor(model) if is_predictor_file(model) else None
    if trained is not None and isinstance(trained.predictor, Narx):
        _narx(trained, trained.predictor, files, (start_mm, end_mm), precision, model if json else None)
        return
    known = _error_model(model, effects) if trained is None else trained.of_position
    low_mm, high_mm = _range(known, start_mm, end_mm)
    documents: list[dict[str, Any]] = []
    for name, file in files.items():
        if name == "c" and trained is not None:  # of its own ends, which the directions may have at different places
            held_mm = -math.inf if start_mm is None else low_mm, math.inf if end_mm is None else high_mm
            lines, document = _predictor(trained, file, held_mm, precision)
        else:
            lines, document = _compensation(
                name, file, known, (low_mm, high_mm), within_mm, UNITS[unit].factor, precision
            )
        document |= {"from_mm": low_mm, "to_mm": high_mm}
        if name == "c":
            document |= {"function": f"{name_in_c(file)}_error_mm", "precision": precision.value}
        write_lines(file, lines)
        documents.append({"format": name, "file": str(file)} | document)
    if json:
        print_json({"model": str(model), "tables": documents})
        return
    for document in documents:
        typer.echo(_sentence(document))
    for left in documents[-1]["left_out"]:
        note(f"{left['effect']} is not in the table: {left['why']}")


def _narx(
    trained: KnownPredictor,
    narx: Narx,
    files: dict[str, Path],
    ends_mm: tuple[float | None, float | None],
    precision: Precision,
    shown: Path | None,
) -> None:
    """Write a NARX network, which has a C source and no table; ``shown``: the model of the JSON document."""
    from rtec.io import write_lines
    from rtec.study.c_source import name_in_c
    from rtec.study.narx_source import narx_lines

    others = [f"--{other}" for other in files if other != "c"]
    others += [end for end, given in zip(("--from", "--to"), ends_mm, strict=True) if given is not None]
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
    known: Model | Predictor,
    range_mm: tuple[float, float],
    within_mm: float,
    per_unit_mm: float,
    precision: Precision,
) -> tuple[Iterator[str], dict[str, Any]]:
    """Return the lines of a table, and what is said of them."""
    from rtec.study.c_source import compensation_lines, name_in_c
    from rtec.study.compensation import LINUXCNC_TRIPLETS, MOST_NODES, compensation_of, csv_lines, linuxcnc_lines

    most = LINUXCNC_TRIPLETS if name == "linuxcnc" else MOST_NODES
    table = compensation_of(known, *range_mm, within_mm=within_mm, most=most)
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


def _sentence(document: dict[str, Any]) -> str:
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


def _error_model(path: Path, effects: Path | None) -> Model:
    """Return the model of an error of position that a file holds; in mm where it does not say otherwise."""
    from rtec.effects import Units
    from rtec.effects.own_file import library_of_file
    from rtec.errors import FileFormatError
    from rtec.inference.model_file import read_model, read_observe
    from rtec.inference.static_predictor import check_of_positions

    observe = read_observe(path)
    if observe != "deviation":
        why = "a table corrects positions, and no force, torque or current"
        raise ArgumentError(f"{path}: observe", repr(observe)[:60], "a model of a deviation", why)
    library = library_of_file(effects)
    try:
        model = read_model(path, None, library)  # one that was written by rtec states its units
    except FileFormatError:
        model = read_model(path, Units("mm", "mm", "s"), library)
    check_of_positions(model)  # before a range of positions is asked for, which a model over time has not
    return model


def _range(known: Model | Predictor, start_mm: float | None, end_mm: float | None) -> tuple[float, float]:
    """Return the range of the table in mm: as given, else where the model was measured, else that of its maps."""
    from rtec.inference.model import Model

    low: float | None
    high: float | None
    if isinstance(known, Model):
        nodes = [x for term in known.terms for x in getattr(term.shape, "nodes", ())]
        low, high = known.range or ((min(nodes), max(nodes)) if nodes else (None, None))
    else:
        low, high = known.range_mm
    low = low if start_mm is None else start_mm
    high = high if end_mm is None else end_mm
    if low is None or high is None:
        what = "--from" if low is None else "--to"
        raise ArgumentError(what, None, "a position such as '0 mm'", "the model does not say where it was measured")
    for name, place_mm in (("--from", low), ("--to", high)):
        number_within(name, place_mm, -_FARTHEST_MM, _FARTHEST_MM, unit="mm")
    if not high >= low + _SHORTEST_MM:
        if end_mm is None:
            raise ArgumentError("--from", f"{low:g} mm", f"a position at least a micrometre before {high:g} mm")
        raise ArgumentError("--to", f"{high:g} mm", f"a position at least a micrometre beyond {low:g} mm")
    return low, high
