"""The position loop and the drive: parameters of the servo that moves the axis."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtec._jit import Record
from rtec.axis.plant import Plant
from rtec.checks import number_within, whole_within
from rtec.units import PS_PER_MS, PS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Servo:
    """A proportional position loop over a velocity loop with a first-order lag.

    Parameters
    ----------
    period_ps
        Period of the position loop, at most 1 ms.
    gain_per_s
        Velocity gain Kv, mm/s per mm of following error. 16.67 1/s is the common 1 m/min per mm.
    feedforward
        Share of the commanded velocity that is added, 0 to 1.
    lag_s
        Time constant of the velocity loop.
    max_speed_mm_s
        Limit of the velocity command.
    deadband_counts
        Following error within which the loop asks for no motion.
    standstill_counts_s
        Velocity below which friction holds the axis once the loop asks for none.
    dither_counts, dither_hz
        Sine added to the command, for an axis that has to be kept moving (off by default).
    plant
        What the loop moves; None is a rigid axis behind the lag.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Notes
    -----
    The acceleration is constant within a period; after a period the velocity has gained the share
    ``1 - exp(-period / lag)`` of what it lacked, as the lag has it for a constant command.

    Examples
    --------
    >>> Servo().gain_per_s
    16.666666666666668
    """

    period_ps: int = PS_PER_MS
    gain_per_s: float = 1000.0 / 60.0
    feedforward: float = 0.0
    lag_s: float = 0.01
    max_speed_mm_s: float = 500.0
    deadband_counts: float = 0.5
    standstill_counts_s: float = 0.01
    dither_counts: float = 0.0
    dither_hz: float = 10.0
    plant: Plant | None = None

    def __post_init__(self) -> None:
        whole_within("period_ps", self.period_ps, PS_PER_MS // 1000, PS_PER_MS)
        number_within("gain_per_s", self.gain_per_s, 1e-3, 1e3, unit="1/s")
        number_within("feedforward", self.feedforward, 0.0, 1.0)
        number_within("lag_s", self.lag_s, 0.0, 10.0, unit="s")
        number_within("max_speed_mm_s", self.max_speed_mm_s, 1e-6, 1e4, unit="mm/s")
        number_within("deadband_counts", self.deadband_counts, 0.0, 1e6)
        number_within("standstill_counts_s", self.standstill_counts_s, 0.0, 1e3)
        number_within("dither_counts", self.dither_counts, 0.0, 1e6)
        number_within("dither_hz", self.dither_hz, 1e-3, 1e3, unit="Hz")

    def fill(self, state: Record, *, count_mm: float, counts_per_unit: float) -> None:
        """Write the parameters into a kernel's state."""
        state.period_ps = self.period_ps
        state.period_s = self.period_ps / PS_PER_S
        state.gain_per_s = self.gain_per_s
        state.feedforward = self.feedforward
        state.lag_share = 1.0 - math.exp(-state.period_s / self.lag_s) if self.lag_s > 0.0 else 1.0
        state.max_speed = self.max_speed_mm_s / count_mm
        state.deadband = self.deadband_counts
        state.standstill = self.standstill_counts_s
        state.dither = self.dither_counts
        state.dither_hz = self.dither_hz
        state.counts_per_unit = counts_per_unit
        state.count_mm = count_mm
        state.rigid = int(self.plant is None)
