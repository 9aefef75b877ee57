"""The readings of a file while they are made into a data set."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from rtec.effects.conditions import Floats
from rtec.metrology import Measurement

Ints = NDArray[np.int64]


@dataclass(slots=True, kw_only=True, eq=False)
class Rows:
    """Columns of equal length, which steps of the preparation replace, and what they did.

    Parameters
    ----------
    measurement
        The file.
    observe, coordinate
        What is explained, and which column is the position.
    position, observed, run
        Shape (rows,); units as in the data set.
    time_s, direction, velocity, acceleration
        Shape (rows,), or None where the file does not tell.
    held_direction
        Direction of the last motion, also at rest; None as above.
    temperatures, unknown
        By name and by heading.
    notes
        In sentences.
    """

    measurement: Measurement
    observe: str
    coordinate: str
    position_unit: str
    position: Floats
    observed: Floats
    run: Ints
    time_s: Floats | None = None
    direction: Floats | None = None
    held_direction: Floats | None = None
    velocity: Floats | None = None
    acceleration: Floats | None = None
    temperatures: dict[str, Floats] = field(default_factory=dict)
    unknown: dict[str, Floats] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def __len__(self) -> int:
        """Return the number of rows."""
        return int(self.position.size)

    def keep(self, rows: NDArray[np.bool_]) -> None:
        """Leave out rows."""
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                setattr(self, item.name, value[rows])
        self.temperatures = {name: values[rows] for name, values in self.temperatures.items()}
        self.unknown = {name: values[rows] for name, values in self.unknown.items()}
