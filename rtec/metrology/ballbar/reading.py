"""Files of circle tests: a table of angle and radius, or the log of two axes that drive circles.

======================  ==========================================================================================
column                  holds
======================  ==========================================================================================
``angle_deg``           from +X towards +Y; or ``angle_rad``
``deviation_um``        radius less nominal radius, any unit of length; or...
``radius_mm``           ...the radius itself
``sense``               +1, ``ccw`` or -1, ``cw``
``run``                 number of the pass (may be left out)
======================  ==========================================================================================

Lines ``# radius: 150 mm`` and ``# feed: 1000 mm/min`` state the nominal radius and the feed. A log has ``target_x_mm,
actual_x_mm, target_y_mm, actual_y_mm`` and ``time_s``; logs of controllers are read as well.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtec.errors import ArgumentError, FileFormatError
from rtec.io import read_any_text
from rtec.metrology.ballbar.circle_test import CircleTest, Floats, circle_test
from rtec.metrology.ballbar.positions import circles_of_positions
from rtec.metrology.columns import ColumnUnit, column_unit, spelled_unit
from rtec.metrology.measurement import Cells, Measurement
from rtec.metrology.measurement_file import read_measurement
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.choices import ColumnChoices
from rtec.metrology.tables.layout import tables_of_text
from rtec.metrology.tables.placing import Placed
from rtec.metrology.tables.several import one_table
from rtec.metrology.tables.table import Table
from rtec.metrology.tables.values import Values
from rtec.metrology.tables.workbook import is_workbook, tables_of_workbook
from rtec.units import LENGTH, SPEED, Kind, parse_quantity

_NAMES = {
    "angle": r"angle|theta|phi|winkel",
    "deviation": r"(?:(?:radial|radius|circular)[ _]*)?(?:deviation|dev|error)|radial|(?:radius)?abweichung",
    "radius": r"radius|radial[ _]*distance",
    "sense": r"sense|direction|dir|drehsinn",
    "run": r"run|pass|lauf",
}
_HEADING = re.compile(r"\s*(?P<name>[^\[(/]*?)[ _]*(?:[\[(/]\s*)?(?P<unit>[^\[\]()/ _]*)\s*[\])]?\s*")
_SENSES = {
    "+1": 1.0, "1": 1.0, "+": 1.0, "ccw": 1.0, "counter-clockwise": 1.0, "counterclockwise": 1.0, "anticlockwise":
    1.0, "-1": -1.0, "-": -1.0, "cw": -1.0, "clockwise": -1.0,
}  # fmt: skip
_COLUMNS = (
    "angle_deg, deviation_um (or radius_mm) and sense; or a log with target_x_mm, actual_x_mm, target_y_mm, ..."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stated:
    """What the user states beside a file, which goes before what stands in it."""

    radius_mm: float | None = None
    feed_mm_s: float | None = None
    axes: str = "xy"
    """Letters of the axes of a log."""


def read_circle_test(
    path: str | Path, stated: Stated | None = None, choices: ColumnChoices | None = None
) -> CircleTest:
    r"""Read a circle test.

    Raises
    ------
    FileFormatError
        No such columns, one without a unit, a value that is none, one sense only, an arc below a revolution.
    ArgumentError
        No nominal radius, a stated one outside its range or beside a log, axes that are not two letters.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> rows = [f"{k},{np.sin(k):.3f},{s}" for s in (1, -1) for k in range(360)]
    >>> _ = file.write_text("# radius: 150 mm\nangle_deg,deviation_um,sense\n" + "\n".join(rows))
    >>> test = read_circle_test(file)
    >>> test.radius_mm, test.points_a_revolution
    (150.0, 360)
    """
    stated, choices = stated or Stated(), choices or ColumnChoices()
    table = _table(path, choices)
    found = {} if table is None else _placed(table)
    try:
        if table is None or "angle" not in found:
            return _of_log(path, stated, choices)
        return _of_table(table, found, stated, choices)
    except ArgumentError as error:
        if error.name == "radius" and stated.radius_mm is not None:
            raise error.of("--radius") from None
        if error.name.startswith("--"):
            raise
        raise FileFormatError(path, None, _problem(error), error.allowed) from None


def _problem(error: ArgumentError) -> str:
    said = (
        f"{error.name} {error.problem}"
        if error.value in ("", None)
        else f"{error.name}: {error.value} {error.problem}"
    )
    return said.strip()


def _table(path: str | Path, choices: ColumnChoices) -> Table | None:
    """Return the table in a file, or None where it holds none with an angle."""
    try:
        if is_workbook(path):
            return one_table(tables_of_workbook(path, choices.sheet), choices)
        text, _ = read_any_text(path)
        few = text[:20_000].lower()
        return one_table(tables_of_text(path, text), choices) if re.search(_NAMES["angle"], few) else None
    except FileFormatError as error:
        if error.line is None and not Path(path).is_file():
            raise
        raise FileFormatError(path, error.line, error.problem, error.allowed) from None


def _placed(table: Table) -> dict[str, tuple[int, ColumnUnit]]:
    """Return index and unit of each column of a circle test."""
    found: dict[str, tuple[int, ColumnUnit]] = {}
    for index, heading in enumerate(table.headings):
        match = _HEADING.fullmatch(heading.lower())
        if match is None:
            continue
        named = {heading.lower().strip(): "", match["name"].strip(): match["unit"] or table.units[index]}
        for name, unit in named.items():
            what = next((key for key, words in _NAMES.items() if re.fullmatch(words, name)), None)
            if what is None or what in found:
                continue
            found[what] = index, _unit(table, index, what, unit or table.units[index])
            break
    return found


def _unit(table: Table, index: int, what: str, unit: str) -> ColumnUnit:
    if what in ("sense", "run"):
        return ColumnUnit("", 1.0)
    inside = "deg" if what == "angle" else "mm"
    spelled = spelled_unit(unit) if unit else None
    known = column_unit("target", spelled) if spelled is not None else None
    if known is None or known.inside != inside:
        example = {"angle": "angle_deg or angle_rad", "deviation": "deviation_um", "radius": "radius_mm"}[what]
        problem = (
            f"column {shown(table.headings[index])} has no unit"
            if not unit
            else f"{shown(unit)} is no unit of {what}"
        )
        raise table.refused(problem, example)
    return known


def _of_table(
    table: Table, found: dict[str, tuple[int, ColumnUnit]], stated: Stated, choices: ColumnChoices
) -> CircleTest:
    if "deviation" not in found and "radius" not in found:
        raise table.refused("no column deviation_um or radius_mm", _COLUMNS)
    if "sense" not in found:
        raise table.refused("no column sense", "one with +1 (counter-clockwise) or -1 (clockwise)")
    columns = {index: (name, unit) for name, (index, unit) in found.items() if name != "sense"}
    others = frozenset(range(len(table.headings))) - set(columns) - {found["sense"][0]}
    values = Values(table, Placed(dict(columns), others, ()), choices.decimal)
    known: dict[str, Floats] = {name: values.column(found[name][0]) for name in found if name != "sense"}
    for name, numbers in known.items():
        if not np.isfinite(numbers).all():
            line = list(values.lines)[int(np.flatnonzero(~np.isfinite(numbers))[0])]
            problem = f"{table.called(found[name][0])} is not a finite number"
            raise FileFormatError(table.source, line, problem, "finite numbers")
    sense = _sense(table, values, found["sense"][0])
    nominal = _stated(stated.radius_mm, table.facts, "radius", LENGTH)
    feed = _stated(stated.feed_mm_s, table.facts, "feed", SPEED)
    notes = [*table.notes, *values.notes]
    if "deviation" in known:
        if nominal is None:
            raise ArgumentError("--radius", None, "the nominal radius, or a line '# radius: 150 mm' in the file")
        deviation, radius = known["deviation"], nominal
    else:
        radius = float(np.mean(known["radius"])) if nominal is None else nominal
        deviation = known["radius"] - radius
        if nominal is None:
            notes.append(f"no nominal radius is stated: the mean of {radius:.6g} mm is taken; D says nothing then")
    return circle_test(
        known["angle"], 1e3 * deviation, sense, radius_mm=radius, radius_known=nominal is not None, feed_mm_s=feed,
        run=known.get("run"), notes=notes,
    )  # fmt: skip


def _sense(table: Table, values: Values, index: int) -> Floats:
    cells: Cells = values.unknown(index)
    texts = [f"{cell:g}" for cell in cells.tolist()] if cells.dtype.kind == "f" else [str(cell) for cell in cells]
    found = [_SENSES.get(text.strip().lower()) for text in texts]
    if None in found:
        row = found.index(None)
        problem = f"{table.called(index)} {shown(texts[row])} is no sense"
        raise FileFormatError(table.source, list(values.lines)[row], problem, "+1 or ccw, -1 or cw")
    return np.array(found, dtype=np.float64)


def _stated(said: float | None, facts: Mapping[str, str], key: str, kind: Kind) -> float | None:
    """Return what an option or else a line of the file states."""
    return parse_quantity(facts[key], kind, name=key) if said is None and key in facts else said


def _of_log(path: str | Path, stated: Stated, choices: ColumnChoices) -> CircleTest:
    letters = stated.axes.lower()
    if len(letters) != 2 or letters[0] == letters[1] or not letters.isalpha():
        raise ArgumentError("--axes", repr(stated.axes)[:20], "two letters, such as xy")
    if stated.radius_mm is not None:
        raise ArgumentError("--radius", "", "it for a table of angles", problem=f"means nothing for {path}, a log")
    logs = [_log(path, letter, choices) for letter in letters]
    target, actual = (
        np.column_stack([log.columns[quantity].values for log in logs]) for quantity in ("target", "actual")
    )
    time_s = logs[0].columns["time"].values if "time" in logs[0].columns else None
    notes = [note for note in logs[0].notes if "left out" not in note]
    return circles_of_positions(target, actual, time_s=time_s, notes=notes)


def _log(path: str | Path, letter: str, choices: ColumnChoices) -> Measurement:
    """Return the columns of one axis of a log, which has to have target and actual position in mm."""
    try:
        found = read_measurement(path, ColumnChoices(columns=choices.columns, decimal=choices.decimal, axis=letter))
    except ArgumentError as error:
        if error.name != "--axis":
            raise
        raise FileFormatError(path, None, f"no axis {letter} and no angle", _COLUMNS) from None
    for quantity in ("target", "actual"):
        if quantity not in found.columns:
            raise FileFormatError(path, None, f"no column {quantity}_{letter}_mm", _COLUMNS)
        if found.columns[quantity].unit != "mm":
            raise FileFormatError(path, None, f"{quantity} of {letter} in {found.columns[quantity].unit}", "lengths")
    return found
