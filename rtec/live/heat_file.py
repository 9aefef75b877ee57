"""What thermometers say while the PC runs: the last row of a file that a data logger goes on writing."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError, FileFormatError
from rtec.io import unreadable
from rtec.metrology.columns import ColumnUnit, quantity_of_heading
from rtec.predictors.binding import OF_TEMPERATURE
from rtec.predictors.warm.features import SPINDLE_SPEED

Floats = npt.NDArray[np.float64]

READ_EVERY_S = 0.5
OLDEST_S = 60.0
"""After which a file that nobody writes says nothing any more."""
_TAIL, _HEAD = 1 << 14, 1 << 14
"""Bytes at the end in which the last row is looked for, and at the beginning for the headings."""
_WHAT = "a table with columns such as temperature_screw_degc or spindle_rpm"


class HeatFile:
    r"""Temperatures and the speed of the spindle, as the last whole row of a table says them.

    Parameters
    ----------
    path
        A table with commas, whose rows are written one after the other.
    clock
        Seconds, for tests.

    Raises
    ------
    FileFormatError
        No readable file, or no such columns.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "heat.csv"
    >>> _ = file.write_text("time_s,temperature_nose_degf,spindle_rpm\n0,68,1000\n1,86,2000\n2,10")
    >>> heat = HeatFile(file)
    >>> heat.inputs, heat.values().round(6).tolist()
    (('temperature_nose', 'spindle_speed'), [30.0, 2000.0])
    """

    def __init__(self, path: str | Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._path, self._clock = Path(path), clock
        self._columns: dict[str, tuple[int, ColumnUnit]] = {}
        self._width = 0
        self._read_headings()
        self.inputs = tuple(self._columns)
        """Names of the inputs, in the order of `values`."""
        self._values = np.full(len(self.inputs), np.nan)
        self._next_s, self._seen, self._written_s = -np.inf, (-1, -1), self._clock()

    def values(self) -> Floats:
        """Return what they say, shape (inputs,); NaN where nothing was written for a minute, or no number."""
        now_s = self._clock()
        if now_s >= self._next_s:
            self._next_s = now_s + READ_EVERY_S
            self._look(now_s)
        return self._values

    def _read_headings(self) -> None:
        try:
            with open(self._path, "rb") as file:
                lines = file.read(_HEAD).decode("utf-8", "replace").lstrip("\ufeff").splitlines()
        except OSError as error:
            raise unreadable(self._path, error, _WHAT) from error
        headings = next((line for line in lines if line.strip() and not line.startswith("#")), "").split(",")
        self._width = len(headings)
        for k, heading in enumerate(headings):
            named = quantity_of_heading(heading)
            if named is None:
                continue
            name = SPINDLE_SPEED if named[0] == "spindle" else named[0]
            if name == SPINDLE_SPEED or name.startswith(OF_TEMPERATURE):
                if name in self._columns:
                    raise ArgumentError(str(self._path), f"two columns of {name}", "each once")
                self._columns[name] = k, named[1]
        if not self._columns:
            raise FileFormatError(self._path, None, f"the headings {','.join(headings)[:80]!r}", _WHAT)

    def _look(self, now_s: float) -> None:
        try:
            with open(self._path, "rb") as file:
                state = os.fstat(file.fileno())
                seen = state.st_size, state.st_mtime_ns
                if seen == self._seen:
                    if now_s - self._written_s > OLDEST_S:
                        self._values = np.full(len(self.inputs), np.nan)
                    return
                file.seek(max(state.st_size - _TAIL, 0))
                rows = file.read(_TAIL).decode("utf-8", "replace").split("\n")[:-1]  # behind the last end: half a row
        except OSError:  # it may be written anew this moment
            return
        self._seen, self._written_s = seen, now_s
        cells = next((row.strip().split(",") for row in reversed(rows) if row.strip()), [])
        self._values = np.array([self._number(cells, *column) for column in self._columns.values()])

    def _number(self, cells: list[str], place: int, unit: ColumnUnit) -> float:
        try:
            return (float(cells[place]) + unit.offset) * unit.factor if len(cells) == self._width else np.nan
        except ValueError:
            return np.nan
