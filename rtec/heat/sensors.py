"""Thermometers as they are: steps, a delay and an offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.checks import number_within

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Thermometer:
    """A digital thermometer on a node; by default a DS18B20 at 12 bits.

    Parameters
    ----------
    name
        The PC sees it as ``temperature_NAME``.
    node
        Where it is attached; ``"room"`` for the air.
    step_k
        Of its readings.
    conversion_s
        A reading says what was so long ago.
    offset_k
        Largest offset; each thermometer's own is drawn evenly from minus to plus this.

    References
    ----------
    Maxim Integrated, DS18B20 data sheet: 0.0625 degC at 12 bits, conversion within 750 ms, accuracy of +-0.5 degC
    from -10 to 85 degC.

    Examples
    --------
    >>> probe = Thermometer(name="screw", node="screw", offset_k=0.0)
    >>> probe.readings([0.0, 1.0, 2.0], [20.0, 20.1, 20.2], offset_k=0.01).tolist()
    [20.0, 20.0625, 20.125]
    """

    name: str
    node: str
    step_k: float = 0.0625
    conversion_s: float = 0.75
    offset_k: float = 0.5

    def __post_init__(self) -> None:
        number_within(f"thermometer {self.name}: step_k", self.step_k, 0.0, 10.0, unit="K")
        number_within(f"thermometer {self.name}: conversion_s", self.conversion_s, 0.0, 1e4, unit="s")
        number_within(f"thermometer {self.name}: offset_k", self.offset_k, 0.0, 10.0, unit="K")

    def readings(self, time_s: npt.ArrayLike, degc: npt.ArrayLike, *, offset_k: float = 0.0) -> Floats:
        """Return what it says at times at which its node has these temperatures, shape (times,)."""
        times = np.asarray(time_s, dtype=np.float64)
        seen = np.interp(times - self.conversion_s, times, np.asarray(degc, dtype=np.float64)) + offset_k
        return np.asarray(np.round(seen / self.step_k) * self.step_k if self.step_k > 0.0 else seen)
