"""Readings of a positioning test: the common result of the laser file, the CSV file and the simulated laser."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Signs = NDArray[np.int8]

_LARGEST = 1e12
"""Largest number of a reading: a thousand million metres; squares and sums of such numbers stay finite."""


def _column(name: str, values: object, size: int | None) -> Floats:
    """Return ``values`` as a one-dimensional float array, refusing what is not finite."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentError(name, type(values).__name__, "a one-dimensional array of numbers") from None
    if array.ndim != 1 or (size is not None and array.size != size):
        raise ArgumentError(name, f"shape {array.shape}", "one number for each reading")
    _refuse(name, array, ~(np.abs(array) <= _LARGEST), f"a finite number, at most {_LARGEST:g} in size")
    return array


def _refuse(name: str, array: Floats, bad: NDArray[np.bool_], allowed: str) -> None:
    if bad.any():
        first = int(np.argmax(bad))
        raise ArgumentError(f"{name}[{first}]", array[first], allowed)


def _check(readings: Readings | RotaryReadings, target: str, deviation: str) -> None:
    """Replace the columns that both kinds of readings have by checked arrays."""
    places = _column(target, getattr(readings, target), None)
    if places.size == 0:
        raise ArgumentError(target, "no reading", "at least one reading")
    object.__setattr__(readings, target, places)
    object.__setattr__(readings, deviation, _column(deviation, getattr(readings, deviation), places.size))
    way, run = (_column(name, getattr(readings, name), places.size) for name in ("direction", "run"))
    _refuse("direction", way, np.abs(way) != 1, "+1 (increasing position) or -1")
    _refuse("run", run, (run != np.round(run)) | (np.abs(run) > 2**31), "a whole number")
    object.__setattr__(readings, "direction", way.astype(np.int8))
    object.__setattr__(readings, "run", run.astype(np.int64))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Readings:
    """Readings of a linear axis, in the order in which they were taken.

    Parameters
    ----------
    target_mm
        Commanded position of each reading, shape (n,), in mm.
    deviation_mm
        Actual minus target, shape (n,), in mm (ISO 230-2: positioning deviation).
    direction
        Direction of approach, shape (n,), +1 (increasing position, "forward") or -1.
    run
        Repeat number, shape (n,), whole.
    air_temperature_degc, air_pressure_kpa, material_temperature_degc
        Surroundings at each reading, shape (n,), or None where they were not recorded.
    status
        Status word of the instrument, shape (n,), or None. The thesis shows 0 and does not say what others mean.

    Raises
    ------
    ArgumentError
        Columns of different lengths, none at all, a value that is not finite, a direction other than +1 or -1.

    Examples
    --------
    >>> r = Readings(target_mm=[0, 10, 10, 0], deviation_mm=[0, 0.002, 0.005, 0.003],
    ...              direction=[1, 1, -1, -1], run=[1, 1, 1, 1])
    >>> r.size, r.direction.dtype
    (4, dtype('int8'))
    """

    target_mm: Floats
    deviation_mm: Floats
    direction: Signs
    run: Integers
    air_temperature_degc: Floats | None = None
    air_pressure_kpa: Floats | None = None
    material_temperature_degc: Floats | None = None
    status: Integers | None = None

    def __post_init__(self) -> None:
        _check(self, "target_mm", "deviation_mm")
        for name in ("air_temperature_degc", "air_pressure_kpa", "material_temperature_degc"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _column(name, getattr(self, name), self.size))
        if self.status is not None:
            object.__setattr__(self, "status", _column("status", self.status, self.size).astype(np.int64))

    @property
    def size(self) -> int:
        """Number of readings."""
        return int(self.target_mm.size)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RotaryReadings:
    """Readings of a rotary axis, in the order in which they were taken.

    Parameters
    ----------
    target_deg, deviation_deg
        Commanded angle, and actual minus target, shape (n,), in degrees.
    direction, run
        As in `Readings`.

    Raises
    ------
    ArgumentError
        As in `Readings`.

    Examples
    --------
    >>> RotaryReadings(target_deg=[0, 90], deviation_deg=[0, 0.001], direction=[1, 1], run=[1, 1]).size
    2
    """

    target_deg: Floats
    deviation_deg: Floats
    direction: Signs
    run: Integers

    def __post_init__(self) -> None:
        _check(self, "target_deg", "deviation_deg")

    @property
    def size(self) -> int:
        """Number of readings."""
        return int(self.target_deg.size)


def joined(parts: Sequence[Readings]) -> Readings:
    """Return the readings of several programs, carried out one after the other, as those of one, runs numbered on.

    Surroundings and status are kept where all of the parts have these.

    Examples
    --------
    >>> one = Readings(target_mm=[1.0], deviation_mm=[0.0], direction=[1], run=[1])
    >>> joined([one, one]).run.tolist()
    [1, 2]
    """
    columns: dict[str, NDArray[Any] | None] = {}
    for item in fields(Readings):
        values = [getattr(part, item.name) for part in parts]
        columns[item.name] = None if any(value is None for value in values) else np.concatenate(values)
    ended = np.cumsum([0, *(int(part.run.max()) for part in parts[:-1])])
    columns["run"] = np.concatenate([part.run + before for part, before in zip(parts, ended, strict=True)])
    return Readings(**columns)  # type: ignore[arg-type]  # what every part has, all together have
