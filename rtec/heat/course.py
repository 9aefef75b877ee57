"""What heat did over time: the one state that an axis, the PC's thermometers, a study, a cell and games read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeatCourse:
    """Temperatures and growth over time, on straight lines between times and held at both ends.

    Parameters
    ----------
    time_s
        Ascending, shape (times,).
    thermometers
        What each says in degrees Celsius, shape (times,), by its name; the PC sees it as ``temperature_NAME``.
    shift_mm
        By how much the axis is displaced wherever it stands, shape (times,): a positive deviation.
    per_mm
        By how much a millimetre of its scale or screw has grown, shape (times,).
    fixed_mm
        Position at which what grows is held.
    spindle_rpm
        Speed of the spindle, shape (times,); held from time to time.

    Raises
    ------
    ArgumentError
        Times that do not ascend, a column of another length, or a value that is not finite.

    Examples
    --------
    >>> course = HeatCourse(time_s=[0.0, 100.0], thermometers={"screw": [20.0, 30.0]}, per_mm=[0.0, 1e-4])
    >>> course.at("screw", 50.0), round(course.growth_mm(50.0, 200.0), 9)
    (25.0, 0.01)
    """

    time_s: npt.ArrayLike = (0.0,)
    thermometers: Mapping[str, npt.ArrayLike] = field(default_factory=dict)
    shift_mm: npt.ArrayLike | None = None
    per_mm: npt.ArrayLike | None = None
    fixed_mm: float = 0.0
    spindle_rpm: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        time_s = np.asarray(self.time_s, dtype=np.float64)
        if time_s.ndim != 1 or not time_s.size or not np.isfinite(time_s).all() or (np.diff(time_s) <= 0.0).any():
            raise ArgumentError("time_s", f"{time_s.size} times", "one or more finite times that ascend")
        object.__setattr__(self, "time_s", time_s)
        for name in ("shift_mm", "per_mm", "spindle_rpm"):
            object.__setattr__(self, name, self._column(name, getattr(self, name)))
        heats = {name: self._column(f"thermometer {name}", values) for name, values in self.thermometers.items()}
        object.__setattr__(self, "thermometers", heats)

    def _column(self, name: str, values: npt.ArrayLike | None) -> Floats:
        times = np.size(self.time_s)
        found = np.zeros(times) if values is None else np.array(values, dtype=np.float64)
        if found.shape != (times,) or not np.isfinite(found).all():
            raise ArgumentError(name, f"{found.size} values", f"{times} finite ones, one for each time")
        return found

    def at(self, thermometer: str, time_s: float) -> float:
        """Return what a thermometer says at a time, in degrees Celsius."""
        return self._between(time_s, self.thermometers[thermometer])

    def growth_mm(self, time_s: float, position_mm: float) -> float:
        """Return by how much the axis is displaced at a time and a position."""
        per_mm = self._between(time_s, self.per_mm)
        return self._between(time_s, self.shift_mm) + per_mm * (position_mm - self.fixed_mm)

    def _between(self, time_s: float, values: npt.ArrayLike | None) -> float:
        return float(np.interp(time_s, np.asarray(self.time_s), np.asarray(values, dtype=np.float64)))
