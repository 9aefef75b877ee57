"""The log of a machine with several axes: ``target_x_mm, actual_x_mm, current_x_a, ...``, of which one is chosen."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from rtec.errors import ArgumentError
from rtec.metrology.columns import quantity_of_heading
from rtec.metrology.tables.choices import IGNORE, ColumnChoices

_OF_AN_AXIS = re.compile(r"([a-z]+)_([a-z])_(.+)", re.ASCII)
_NAMED = {"temperature", "load"}
"""What carries names of its own, which are no axes."""


def of_one_axis(headings: Sequence[str], choices: ColumnChoices) -> ColumnChoices:
    """Return the choices by which the columns of one axis are read, and those of the others left out.

    Parameters
    ----------
    headings
        Of the table.
    choices
        With the axis, where one is chosen; what they say of a column goes first.

    Raises
    ------
    ArgumentError
        An axis that has no columns, or several axes and none chosen.

    Examples
    --------
    >>> found = of_one_axis(["time_s", "target_x_mm", "target_y_mm"], ColumnChoices(axis="x"))
    >>> dict(found.columns)
    {'target_x_mm': 'target_mm', 'target_y_mm': 'ignore'}
    """
    parts = {heading: _parts(heading) for heading in (text.strip().lower() for text in headings)}
    axes = sorted({axis for axis, _ in filter(None, parts.values())})
    if choices.axis is not None and choices.axis not in axes:
        names = f"one of {', '.join(axes)}" if axes else "it for a log whose columns name axes, such as target_x_mm"
        raise ArgumentError("--axis", repr(choices.axis)[:60], names)
    if choices.axis is None:
        if len(axes) < 2:
            return choices
        raise ArgumentError("--axis", "", f"one of {', '.join(axes)}", problem="is needed: the log has several axes")
    said = {
        heading: of[1] if of[0] == choices.axis else IGNORE
        for heading, of in parts.items()
        if of is not None and heading not in choices.columns
    }
    return replace(choices, columns={**said, **choices.columns})


def _parts(heading: str) -> tuple[str, str] | None:
    """Return the axis that a heading names, and the heading without it; None where it names none."""
    found = _OF_AN_AXIS.fullmatch(heading)
    if found is None or found[1] in _NAMED:
        return None
    bare = f"{found[1]}_{found[3]}"
    return None if quantity_of_heading(bare) is None else (found[2], bare)
