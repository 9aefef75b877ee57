"""The cascade of loops that moves a feed drive: position, velocity and current, with feed-forwards."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec._jit import Record, new_record
from rtec.axis.plant import Plant
from rtec.axis.plants._drive_kernels import CONTROL
from rtec.axis.servo import Servo
from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.units import PS_PER_US

FloatArray = npt.NDArray[np.float64]
STEP_RAD = 0.25
"""Largest step of the fastest motion: the method then errs by 1e-5 of a turn of it."""
MOST_STEPS = 64
"""Of a period, so that a run ends."""
_FASTEST_MM_S = 1e4

OUTPUTS = ("load_mm", "load_mm_s", "current_a", "friction_n")
"""What a drive in a closed loop says of itself, as its period begins."""


def numbers_of(record: Record) -> FloatArray:
    """Return the fields of a kernels' record as they lie."""
    return np.array(record.tolist())


@dataclass(frozen=True, slots=True, kw_only=True)
class Cascade:
    """Gains of the loops, each with its reason; the papers give none.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Notes
    -----
    At each period: ``v* = kv (command - actual) + kff v_command``, ``i* = kp (v* - v) + integral + aff a_command``,
    cut to the limit of current; the integral gives up what the limit cuts off. The closed current loop is a
    first-order lag, which the kernels integrate exactly. The velocity is the difference of two positions of the
    encoder, through a first-order filter, so a corrector's insertion is seen as a speed.

    Examples
    --------
    The following error of Erwinski et al. (2019) in mm, at 2500 mm/s:

    >>> c = Cascade()
    >>> round(2500 / c.position_gain_per_s * (1 - c.velocity_feedforward), 3)
    0.8
    """

    period_us: float = 62.5
    """Four periods in the 0.25 ms of Erwinski et al. (2019)."""
    position_gain_per_s: float = 50.0
    """kv: a fifteenth of the velocity loop's 754 1/s, so that the axis does not overshoot."""
    velocity_feedforward: float = 0.984
    """With kv: 2500 mm/s / 50 1/s x 0.016 = 0.8 mm, the following error of Erwinski et al. (2019) at full speed."""
    acceleration_feedforward: float = 1.0
    """Share of the moving mass: the following error of 004 goes with the speed."""
    velocity_bandwidth_hz: float = 120.0
    """Crossover of the velocity loop: below the 200 Hz of a screw and carriage, and 15 times above kv."""
    integral_time_s: float = 0.01
    """7 times slower than the crossover, so that the loop does not overshoot."""
    filter_hz: float = 800.0
    """Of the velocity: takes 8 degrees of phase at the crossover."""
    current_bandwidth_hz: float = 1500.0
    """Usual for a drive that switches at 8 to 16 kHz."""
    limit_a: float = 9.0
    """Peak current of the amplifier: a drive of 3 A continuous, as in 004, has three times that."""

    def __post_init__(self) -> None:
        number_within("period_us", self.period_us, 1.0, 1000.0, unit="us")
        number_within("position_gain_per_s", self.position_gain_per_s, 1e-3, 1e3, unit="1/s")
        number_within("velocity_feedforward", self.velocity_feedforward, 0.0, 1.5)
        number_within("acceleration_feedforward", self.acceleration_feedforward, 0.0, 1.5)
        number_within("velocity_bandwidth_hz", self.velocity_bandwidth_hz, 1.0, 1e4)
        number_within("integral_time_s", self.integral_time_s, 1e-3, 1e6)
        number_within("filter_hz", self.filter_hz, 10.0, 1e6)
        number_within("current_bandwidth_hz", self.current_bandwidth_hz, 10.0, 1e5)
        number_within("limit_a", self.limit_a, 1e-3, 1e4, unit="A")

    def steps(self, squared_rate_per_s2: float) -> int:
        """Return in how many steps a period is integrated, for a bound of the square of the fastest rate.

        Raises
        ------
        ArgumentError
            Too fast: the drive is too stiff for its masses.
        """
        rate_hz = math.sqrt(squared_rate_per_s2) / (2.0 * math.pi)
        fastest_hz = MOST_STEPS * STEP_RAD / (2e-6 * math.pi * self.period_us)
        if not rate_hz <= fastest_hz:
            allowed = f"at most {fastest_hz:.4g} Hz: less stiffness or more mass"
            raise ArgumentError("drive", f"a resonance of {rate_hz:.4g} Hz", allowed)
        return max(1, math.ceil(2e-6 * math.pi * rate_hz * self.period_us / STEP_RAD))

    def servo(self, plant: Plant) -> Servo:
        """Return the position loop of this cascade, for a closed loop whose plant is the drive with the others."""
        return Servo(
            period_ps=round(self.period_us * PS_PER_US),
            gain_per_s=self.position_gain_per_s,
            feedforward=self.velocity_feedforward,
            max_speed_mm_s=_FASTEST_MM_S,
            deadband_counts=0.0,
            standstill_counts_s=0.0,
            plant=plant,
        )

    def state(self, mass_kg: float, n_per_a: float, *, open_loop: bool = False) -> Record:
        """Return the kernels' record of the loops at rest, for a mass and the force of a current."""
        c = new_record(CONTROL)
        c.period_s = 1e-6 * self.period_us
        c.position_gain = self.position_gain_per_s
        c.velocity_feedforward = self.velocity_feedforward
        c.acceleration_a = self.acceleration_feedforward * 1e-3 * mass_kg / n_per_a
        c.velocity_gain = 2e-3 * math.pi * self.velocity_bandwidth_hz * mass_kg / n_per_a
        c.integral_share = c.velocity_gain * c.period_s / self.integral_time_s
        c.filter_share = 1.0 - math.exp(-2.0 * math.pi * self.filter_hz * c.period_s)
        c.limit_a = self.limit_a
        c.lag_s = 0.5 / (math.pi * self.current_bandwidth_hz)
        c.open_loop = float(open_loop)
        return c
