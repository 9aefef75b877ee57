"""The readings of a file on their way to a data set."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.observed import DRIVE
from rtec.dataset.standstill import Ints, group_means
from rtec.effects.conditions import Floats
from rtec.metrology import AxisFacts, Measurement
from rtec.metrology.columns import axis_of_heading

_NAMES = ("run", "rest", "block", "direction", "held_direction")  # numbers that only name something: no mean of them


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Columns of equal length, and what was done to them: a step of the preparation takes rows and returns others.

    Columns are of shape (rows,), with the names and units of the data set; None is what the file does not tell.
    ``turn`` is a whole turn of a rotary axis; ``pauses_unknown`` says that the clock of the file starts again with
    each run. Of a log only: ``rest``, the number of the standstill that a row belongs to, −1 in motion;
    ``held_direction``, that of the last motion, also at rest; ``smoothed_off``, how much of a velocity column the low
    pass took away. ``block`` numbers what the user wants held out together.
    """

    measurement: Measurement
    axis: AxisFacts
    observe: str
    coordinate: str
    position_unit: str
    observed_unit: str
    turn: float | None
    position: Floats
    observed: Floats
    run: Ints
    block: Ints | None = None
    time_s: Floats | None = None
    pauses_unknown: bool = False
    direction: Floats | None = None
    held_direction: Floats | None = None
    rest: Ints | None = None
    velocity: Floats | None = None
    smoothed_off: Floats | None = None
    acceleration: Floats | None = None
    feed: Floats | None = None
    pressure_hpa: Floats | None = None
    humidity_percent: Floats | None = None
    load: Floats | None = None
    spindle_rpm: Floats | None = None
    temperatures: dict[str, Floats] = field(default_factory=dict)
    unknown: dict[str, Floats] = field(default_factory=dict)
    stands_for: Floats | None = None
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return int(self.position.size)

    @property
    def of_drive(self) -> bool:
        """Whether a quantity of the drive is explained."""
        return self.observe in DRIVE

    @property
    def other_axes(self) -> dict[str, Floats]:
        """Positions of other axes, by heading, in the unit of the file."""
        return {heading: values for heading, values in self.unknown.items() if axis_of_heading(heading) is not None}

    def keep(self, rows: NDArray[np.bool_]) -> Rows:
        """Return some of the rows."""
        return self if rows.all() else self._each(lambda _, values: values[rows])

    def merge(self, starts: Ints) -> Rows:
        """Return one row, their mean, for each group of successive rows, which is given by its first row."""
        each = np.ones(len(self)) if self.stands_for is None else self.stands_for
        merged = self._each(lambda name, values: values[starts] if name in _NAMES else group_means(values, starts))
        return replace(merged, stands_for=np.add.reduceat(each, starts))

    def _each(self, changed: Callable[[str, Floats], Floats]) -> Rows:
        found: dict[str, Any] = {}
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                found[item.name] = changed(item.name, value)
            elif isinstance(value, dict):
                found[item.name] = {name: changed("", values) for name, values in value.items()}
        return replace(self, **found)
