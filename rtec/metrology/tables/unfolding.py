"""A wide table as readings, one under the other: each column of it is a run in one direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rtec.metrology.columns import ColumnUnit, column_unit
from rtec.metrology.measurement import Column
from rtec.metrology.plain_numbers import shown
from rtec.metrology.readings import Floats
from rtec.metrology.tables.headings import named_and_unit, unit_below
from rtec.metrology.tables.table import Table
from rtec.metrology.tables.values import Values
from rtec.metrology.tables.wide import Pass

_NEAR = 0.1
_STATED = ("run", "direction")
_ASK = "the unit in the headings, such as 'Run 1 [µm]', or in a row below them"


def unfolded(
    table: Table, values: Values, passes: Sequence[Pass]
) -> tuple[dict[str, Column], list[int], list[str], list[str]]:
    """Return the readings of a wide table in the order in which the axis took them.

    Returns
    -------
    columns
        ``run``, ``direction`` (where it is known), ``target`` and ``deviation`` or ``actual``, shape (readings,).
    lines, headings
        Line and column of each reading.
    notes
        What was taken for what.

    Raises
    ------
    FileFormatError
        No unit, several of them, or nothing that tells deviations from positions.
    """
    target_index = next((index for index, (name, _) in values.placed.columns.items() if name == "target"), None)
    if target_index is None:
        problem = f"no target beside the runs {shown(table.headings[passes[0].column])}, ..."
        raise table.refused(problem, "a column of targets with its unit, target_mm")
    target = values.column(target_index)
    target_unit = values.placed.columns[target_index][1]
    assert target_unit is not None  # noqa: S101 - a target without unit is not placed
    unit = _unit(table, passes)
    stated = {name: values.column(index) for index, (name, _) in values.placed.columns.items() if name in _STATED}
    ordered = _numbered(passes)
    parts = [_one_pass(values, one, unit.factor, target, stated) for one in ordered]
    order = np.concatenate([rows for rows, *_ in parts])
    readings = np.concatenate([found for _, found, *_ in parts])
    headings = [table.headings[one.column] for one, (rows, *_) in zip(ordered, parts, strict=True) for _ in rows]
    runs = np.concatenate([run for *_, run, _ in parts])
    quantity, notes = _quantity(passes, readings, target[order], same_unit=unit == target_unit)
    column = {
        "run": Column("run", "", runs),
        "target": Column("target", target_unit.inside, target[order]),
        quantity: Column(quantity, unit.inside, readings),
    }
    if "direction" in stated or all(one.direction for one in passes):
        column["direction"] = Column("direction", "", np.concatenate([way for *_, way in parts]))
    elif any(one.direction for one in passes):
        problem = "some of the runs state a direction, others none"
        raise table.refused(problem, "a direction in each heading, such as 'Run 1 +'")
    if "run" in stated:  # run by run, as the axis took them
        taken = np.argsort(runs, kind="stable")
        column = {name: Column(name, one.unit, one.values[taken]) for name, one in column.items()}
        order, headings = order[taken], [headings[row] for row in taken]
    names = f"{shown(table.headings[passes[0].column])} to {shown(table.headings[passes[-1].column])}"
    notes.insert(0, f"took columns {names} for {len(passes)} passes of {quantity}s")
    return column, [values.lines[row] for row in order], headings, notes


def _numbered(passes: Sequence[Pass]) -> list[Pass]:
    """Return the passes in the order in which they were taken, each with the number of its run."""
    counted: dict[int | None, int] = {}
    found = []
    for one in passes:
        counted[one.direction] = counted.get(one.direction, 0) + 1
        found.append(
            Pass(one.column, one.run if one.run is not None else counted[one.direction], one.direction, one.quantity)
        )
    return sorted(found, key=lambda one: (one.run or 0, -(one.direction or 0)))


def _one_pass(
    values: Values, one: Pass, factor: float, target: Floats, columns: Mapping[str, Floats]
) -> tuple[np.ndarray, Floats, Floats, Floats]:
    """Return the rows of a pass in the order of its direction, with readings, run and direction of each."""
    found, there = values.pass_column(one.column, factor)
    rows = np.flatnonzero(there)
    stated = columns.get("direction", np.full(target.size, float(one.direction or 0)))
    runs = columns.get("run", np.full(target.size, float(one.run or 1)))
    # forward from the lowest target up, then backward from the highest down; as the rows stand if nothing is stated
    rows = rows[np.lexsort((stated[rows] * target[rows], -stated[rows], runs[rows]))]
    return rows, found[rows], runs[rows], stated[rows]


def _unit(table: Table, passes: Sequence[Pass]) -> ColumnUnit:
    found: dict[str, int] = {}
    for one in passes:
        for text in (table.headings[one.column], table.above[one.column]):
            if (unit := named_and_unit(text)[1]) is not None:
                found.setdefault(unit, one.column)
        if (unit := unit_below(table.units[one.column])) is not None:
            found.setdefault(unit, one.column)
    first = shown(table.headings[passes[0].column])
    if not found:
        problem = f"the runs {first}, ... state no unit"
        raise table.refused(problem, _ASK)
    units = [column_unit("deviation", unit) for unit in found]
    if len(set(units)) > 1 or units[0] is None:
        problem = f"the runs {first}, ... are in {' and '.join(found)}"
        raise table.refused(problem, "one unit of length or angle for all of them")
    return units[0]


def _quantity(passes: Sequence[Pass], readings: Floats, target: Floats, *, same_unit: bool) -> tuple[str, list[str]]:
    """Return whether the readings are deviations or positions: by words, else by how near they are to the targets."""
    said = {one.quantity for one in passes} - {None}
    if len(said) == 1:
        return str(said.pop()), []
    span = float(np.ptp(target)) or 1.0
    near = bool(np.abs(readings - target).max(initial=0.0) < _NEAR * span)
    if near and same_unit:
        return "actual", ["took the readings for actual positions: they are near their targets"]
    return "deviation", ["took the readings for deviations"]
