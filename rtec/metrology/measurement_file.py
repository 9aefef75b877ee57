"""From a file to a measurement: our own CSV, tables as people write them, workbooks, files of laser systems.

What a file is shows in what it holds, not in its name. Everything is turned into the internal units when it is
read: mm, s, mm/s, degC, N, A, V, Nm, degrees for angles; revolutions and counts stay what they are. What had to be
guessed stands in the notes of the measurement.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from rtec.errors import ArgumentError
from rtec.io import read_any_text, write_lines
from rtec.metrology.columns import quantity_of_heading
from rtec.metrology.controller_logs.recognised import table_of_log
from rtec.metrology.laser_file import is_laser_file, readings_of_text
from rtec.metrology.measurement import Cells, Column, Measurement, measurement_of_readings
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.axes import of_one_axis
from rtec.metrology.tables.cell_units import without_units
from rtec.metrology.tables.choices import NO_CHOICES, ColumnChoices
from rtec.metrology.tables.frame import table_of_columns
from rtec.metrology.tables.headings import Meaning, Strength, meaning_of
from rtec.metrology.tables.layout import tables_of_text
from rtec.metrology.tables.placing import place
from rtec.metrology.tables.renishaw import is_renishaw_file, read_renishaw_text
from rtec.metrology.tables.several import one_table
from rtec.metrology.tables.table import Table
from rtec.metrology.tables.unfolding import unfolded
from rtec.metrology.tables.values import Values, counts_runs
from rtec.metrology.tables.wide import Pass, passes_of, turned
from rtec.metrology.tables.words import AXIS, plain_words
from rtec.metrology.tables.workbook import is_workbook, tables_of_workbook

_OF_LONG_TABLES = ("time", "velocity", "feed", "force", "current", "torque", "voltage")
_FEWEST_COMPARED = 3
_CLOSE = 0.05
_SLIPS = (
    (-1.0, "target less actual"),
    (1e3, "1000 times actual less target"),
    (1e-3, "a thousandth of actual less target"),
)


def read_measurement(path: str | Path, choices: ColumnChoices = NO_CHOICES) -> Measurement:
    r"""Read a measurement.

    Parameters
    ----------
    path
        A text file with a table in it (gzip, too), an .xlsx workbook, a file of the thesis's laser system or of
        Renishaw's, a log as a controller writes it.
    choices
        What the user says of its columns.

    Raises
    ------
    FileFormatError
        With the line: a number that is not finite or no number, a row of another length, a heading twice or two for
        the same quantity, a quantity without unit (but a time of dates), no header, no rows, binary data; or what
        cannot be told without asking.
    ArgumentError
        A choice for a column or a sheet that the file does not have.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> _ = file.write_text("# screw_pitch: 0.25 inch\ntarget_inch,deviation_um,pulse_v\n1,2,0\n2,3,0\n")
    >>> m = read_measurement(file)
    >>> m.columns["target"].values.tolist(), list(m.unknown), m.facts["screw_pitch"]
    ([25.4, 50.8], ['pulse_v'], '0.25 inch')

    >>> _ = file.write_text("Soll;Abweichung (µm)\nmm;\n0,0;1,5\n10,0;2,5\n", encoding="latin-1")
    >>> m = read_measurement(file)
    >>> m.columns["deviation"].values.tolist(), m.notes[-1]
    ([0.0015, 0.0025], "took column 'Abweichung (µm)' for the deviation")
    """
    if is_workbook(path):
        return _of_table(one_table(tables_of_workbook(path, choices.sheet), choices), choices, ())
    if choices.sheet is not None:
        raise ArgumentError("--sheet", "", "it for a workbook", problem=f"means nothing for {path}")
    text, encoding = read_any_text(path)
    notes = () if encoding == "utf-8" else (f"read as {encoding}",)
    if choices.table is not None and (is_laser_file(text) or is_renishaw_file(text)):
        raise _of_a_laser_system("--table", path)
    if is_laser_file(text):
        if choices.columns:
            raise _of_a_laser_system("--map", path)
        readings = measurement_of_readings(readings_of_text(path, text), {})
        return Measurement(source=str(path), facts={}, columns=readings.columns, unknown={})
    if is_renishaw_file(text):
        return read_renishaw_text(path, text, choices)
    if (log := table_of_log(path, text, choices)) is not None:
        if choices.table is not None:
            raise ArgumentError(
                "--table", "", "it for a table", problem=f"means nothing for {path}, a controller's log"
            )
        return _of_table(log, choices, notes)
    return _of_table(one_table(tables_of_text(path, text), choices), choices, notes)


def measurement_of_columns(
    source: object, choices: ColumnChoices = NO_CHOICES, facts: Mapping[str, str] | None = None
) -> Measurement:
    """Return a mapping of columns, or a data frame of any library, as a measurement.

    Headings are those of files (``target_mm``, ``deviation_um``, ``run``, ...); a row in which a value is missing is
    left out. ``facts`` are its ``# key: value`` lines.

    Raises
    ------
    ArgumentError, FileFormatError
        As `rtec.metrology.tables.frame.table_of_columns` and `read_measurement`.

    Examples
    --------
    >>> m = measurement_of_columns({"target_mm": [0.0, 5.0, 9.0], "deviation_um": [1.0, None, 3.0]})
    >>> m.columns["deviation"].values.tolist(), m.notes
    ([0.001, 0.003], ('1 of 3 rows are left out, because a cell is empty: line 2 (deviation_um is empty)',))
    """
    table = table_of_columns(source)
    if choices.sheet is not None or choices.table is not None:
        raise ArgumentError("sheet, table", "", "them for a file", problem="mean nothing for columns")
    return _of_table(replace(table, facts=dict(facts or {})), choices, ())


def _of_a_laser_system(option: str, path: str | Path) -> ArgumentError:
    problem = f"means nothing for {path}, a file of a laser system"
    return ArgumentError(option, "", "it for a table", problem=problem)


def _of_table(table: Table, choices: ColumnChoices, notes: tuple[str, ...]) -> Measurement:
    choices = of_one_axis(table.headings, choices)
    table = without_units(_one_target_a_row(table), choices)
    passes = _passes(table, choices)
    placed = place(table, choices, frozenset(one.column for one in passes))
    values = Values(table, placed, choices.decimal, [one.column for one in passes], gaps=choices.gaps)
    lines: Sequence[int] = values.lines
    unfolding: list[str] = []
    headings: list[str] = []
    unknown: dict[str, Cells] = {}
    if passes:
        columns, lines, headings, unfolding = unfolded(table, values, passes)
    else:
        columns, unknown = _columns(table, values)
        _refuse_disagreement(table, values, columns)
    if not columns and not unknown:
        raise table.refused("no column is left", "at least one that is not ignored")
    return Measurement(
        source=table.source,
        facts=MappingProxyType(table.facts),
        columns=columns,
        unknown=unknown,
        lines=lines,
        notes=(*notes, *table.notes, *placed.notes, *values.notes, *unfolding),
        headings={
            quantity: table.headings[index]
            for index, (quantity, _) in placed.columns.items()
            if quantity_of_heading(table.headings[index]) is None
        },
        passes=headings,
    )


def _columns(table: Table, values: Values) -> tuple[dict[str, Column], dict[str, Cells]]:
    """Return the known columns by quantity, and the others by heading."""
    columns: dict[str, Column] = {}
    unknown: dict[str, Cells] = {}
    placed = values.placed.columns
    times = [index for index, (quantity, unit) in placed.items() if quantity == "time" and unit is None]
    seen: dict[str, str] = {}
    for index, heading in enumerate(table.headings):
        if not heading or index in values.left_out or index in times[1:]:
            continue
        if index not in placed:
            if (first := seen.setdefault(heading.lower(), heading)) is not heading:
                problem = f"columns {shown(first)} and {shown(heading)} both hold {shown(heading.lower())}"
                raise table.refused(problem, "one column for each quantity")
            unknown[heading] = values.unknown(index)
            _refuse_several_axes(table, index, unknown[heading])
            continue
        quantity, unit = placed[index]
        if unit is None:
            columns[quantity] = Column(quantity, "s", values.time(times))
        else:
            columns[quantity] = Column(quantity, unit.inside, values.column(index))
    _find_runs(columns, unknown, values)
    return columns, unknown


def _refuse_several_axes(table: Table, index: int, cells: Cells) -> None:
    names = list(dict.fromkeys(cells.tolist())) if set(plain_words(table.headings[index])) <= AXIS else []
    if len(names) > 1:
        problem = f"column {shown(table.headings[index])} names several axes: {', '.join(map(str, names[:3]))}"
        allowed = f"one axis a file; {table.as_choice(index, 'ignore')} takes them for one"
        raise table.refused(problem, allowed)


def _find_runs(columns: dict[str, Column], unknown: dict[str, Cells], values: Values) -> None:
    """Take a column called a number, such as 'Nr.', for that of the run where it counts runs."""
    target = columns.get("target", columns.get("actual"))
    if "run" in columns or target is None:
        return
    for heading, found in unknown.items():
        if found.dtype.kind == "f" and counts_runs(heading, numbers := found.astype(np.float64), target.values):
            columns["run"] = Column("run", "", numbers)
            values.notes.append(
                f"took column {shown(heading)} for the number of the run: it counts up from run to run"
            )
            del unknown[heading]
            return


def _refuse_disagreement(table: Table, values: Values, columns: dict[str, Column]) -> None:
    """Refuse a deviation of the other sign or in another unit than the positions beside it tell."""
    if (what := disagreement(columns)) is not None:
        index = next(index for index, (quantity, _) in values.placed.columns.items() if quantity == "deviation")
        problem = f"column {shown(table.headings[index])} is {what}, by the positions beside it"
        allowed = f"a deviation is actual less target; {table.as_choice(index, 'ignore')} takes it from the positions"
        raise table.refused(problem, allowed)


def disagreement(columns: Mapping[str, Column]) -> str | None:
    """Return what a deviation is where it is not actual less target but has its shape; None where nothing is wrong.

    A datum that only one of the two has makes no difference, and columns that have little to do with each other (the
    position of an encoder beside the error that a laser saw) are no contradiction.

    Examples
    --------
    >>> target, error = np.array([0.0, 100, 200]), np.array([0.001, -0.002, 0.004])
    >>> named = {"target": target, "actual": target + error, "deviation": -error}
    >>> disagreement({name: Column(name, "mm", values) for name, values in named.items()})
    'target less actual'
    """
    if not {"target", "actual", "deviation"} <= columns.keys():
        return None
    target, actual, deviation = (columns[name] for name in ("target", "actual", "deviation"))
    if len({target.unit, actual.unit, deviation.unit}) > 1 or target.values.size < _FEWEST_COMPARED:
        return None
    away = actual.values - target.values
    said, seen = deviation.values - deviation.values.mean(), away - away.mean()
    size = float(np.abs(said).max())
    slips = (what for factor, what in _SLIPS if size > 0.0 and np.abs(said - factor * seen).max() <= _CLOSE * size)
    return next(slips, None)


def _one_target_a_row(table: Table) -> Table:
    """Return a table with a target a column as one with a target a row; any other as it is."""
    if not all(heading.replace(".", "").replace(",", "").lstrip("+-").isdigit() for heading in table.headings[1:]):
        return table
    rows, _ = table.cells()
    if (found := turned(table.headings, rows)) is None:
        return table
    headings, cells = found
    return replace(
        table,
        headings=tuple(headings),
        units=(table.units[0], *[""] * (len(headings) - 1)),
        above=("",) * len(headings),
        rows=cells,
        lines=[table.heading_line] * len(cells),
        notes=(*table.notes, "took each row for a pass, and each column for a target"),
    )


def _passes(table: Table, choices: ColumnChoices) -> list[Pass]:
    """Return the columns of a wide table, or nothing where the table has a row for each reading."""
    meanings = [meaning_of(heading, below) for heading, below in zip(table.headings, table.units, strict=True)]
    taken = {
        index
        for index, meaning in enumerate(meanings)
        if (meaning is not None and meaning.strength is Strength.EXACT)
        or choices.of_column(index + 1, table.headings[index]) is not None
    }
    found = passes_of(table.headings, table.above, frozenset(taken))
    columns = {one.column for one in found}
    said = [choices.of_column(index, heading) for index, heading in enumerate(table.headings, 1)]
    others = {text.partition("_")[0].replace("command", "target") for text in said if text is not None}
    for index, meaning in enumerate(meanings):
        if meaning is not None and said[index] is None and index not in columns:
            others.add(meaning.quantity)
            _refuse_both(table, index, meaning, found)
    if others & {"deviation", "actual", *_OF_LONG_TABLES} or not others & {"target", "position"}:
        return []
    if "run" in others and any(one.run is not None for one in found):
        return []
    return found


def _refuse_both(table: Table, index: int, meaning: Meaning, passes: list[Pass]) -> None:
    """Refuse a deviation beside passes in both directions: it may be their difference."""
    guessed = meaning.quantity == "deviation" and meaning.strength < Strength.EXACT
    if guessed and {one.direction for one in passes} >= {1, -1}:
        names = " and ".join(shown(table.headings[one.column]) for one in passes[:2])
        problem = f"column {shown(table.headings[index])} may be the deviation, and {names} passes of deviations"
        allowed = f"{table.as_choice(index, 'ignore')} reads the passes; {table.as_choice(index, 'deviation_um')} it"
        raise table.refused(problem, allowed)


def write_measurement(path: str | Path, measurement: Measurement) -> None:
    """Write a measurement in the internal units, the known columns first; it reads back to the same numbers.

    Raises
    ------
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from rtec.metrology import Column
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> write_measurement(file, Measurement(source="", facts={"axis": "z"}, unknown={}, columns={
    ...     "target": Column("target", "mm", np.array([25.4]))}))
    >>> print(file.read_text().strip())
    # axis: z
    target_mm
    25.4
    """
    facts = [f"# {key}: {line}" for key, value in measurement.facts.items() for line in value.split("\n")]
    header = [column.heading for column in measurement.columns.values()] + [
        _quoted(name) for name in measurement.unknown
    ]
    columns = [_written(column.values) for column in measurement.columns.values()]
    columns += [_written(values) for values in measurement.unknown.values()]
    write_lines(path, [*facts, ",".join(header), *(",".join(row) for row in zip(*columns, strict=True))])


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if any(sign in text for sign in '",') else text


def _written(values: Cells) -> list[str]:
    if values.dtype.kind == "U":
        return [_quoted(str(value)) for value in values]
    return [str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value) for value in values.tolist()]
