"""What the PC's temperature sensors read while a machine runs in simulated time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rtec._jit import Record
from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.predictors.binding import sensor_names


@dataclass(frozen=True, slots=True, kw_only=True)
class Thermometer:
    """A temperature sensor of the PC and the first-order course of what it reads.

    A model sees it as ``temperature_NAME``. What the axis does when it warms up is the machine's affair (`Growth`):
    the PC knows of it what its sensors say, and no more.

    Parameters
    ----------
    name
        Small letters, digits and underscores.
    start_degc
        Reading when the machine starts.
    rise_k
        What it rises by in the end.
    time_constant_s
        After which 63 % of that is reached.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> Thermometer(name="screw", rise_k=8.0, time_constant_s=600.0).start_degc
    20.0
    """

    name: str
    start_degc: float = 20.0
    rise_k: float = 0.0
    time_constant_s: float = 60.0

    def __post_init__(self) -> None:
        try:
            sensor_names([self.name])
        except ArgumentError as error:
            raise error.of("name") from None
        number_within("start_degc", self.start_degc, -273.15, 1000.0, unit="degC")
        number_within("rise_k", self.rise_k, -1000.0, 1000.0, unit="K")
        number_within("time_constant_s", self.time_constant_s, 1e-3, 1e6, unit="s")


def names_of(thermometers: Sequence[Thermometer]) -> tuple[str, ...]:
    """Return the names of thermometers; refuse one twice, and too many.

    Examples
    --------
    >>> names_of([Thermometer(name="screw"), Thermometer(name="bed")])
    ('screw', 'bed')
    """
    return sensor_names([one.name for one in thermometers])


def fill_thermometers(record: Record, thermometers: Sequence[Thermometer]) -> None:
    """Hand thermometers to the kernels."""
    record.count = len(thermometers)
    for k, one in enumerate(thermometers):
        record.start_degc[k] = one.start_degc
        record.rise_k[k] = one.rise_k
        record.tau_s[k] = one.time_constant_s
