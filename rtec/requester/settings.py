"""Settings of the handshake between PC and box, and what the PC is doing."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from rtec._jit import Record
from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError
from rtec.link._kernels import SLOTS
from rtec.requester import _pc_kernels
from rtec.units import PS_PER_MS, PS_PER_US


class PcState(enum.IntEnum):
    """What the PC is doing."""

    WAITING = _pc_kernels.WAITING
    """Waits for the box to report the home position."""
    ACTIVE = _pc_kernels.ACTIVE
    HOLD = _pc_kernels.HOLD
    """The machine is held."""


class Outside(enum.Enum):
    """What becomes of the correction where the model has no answer: an input outside its ranges, or inside them.

    Where a sensor is lost, or the axis stands outside the model's positions, the machine is held in any case.
    """

    HOLD = "hold"
    """The machine is held."""
    KEEP = "keep"
    """The last correction stays."""
    ZERO = "zero"
    """The correction goes to zero, window by window."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HandshakeSettings:
    """Settings of the handshake between PC and box (Yee 1992, General Considerations).

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> HandshakeSettings().window_steps
    3
    """

    window_steps: int = 3
    """Largest change of the requested total that the box accepts from one reading to the next."""
    grace_readings: int = 2
    """Further readings outside the window that the box tolerates before it stops for good."""
    box_period_ps: int = 1 * PS_PER_MS
    """Period with which the box samples the request."""
    update_ps: int = 20 * PS_PER_US
    """Time for which Data Valid is low while the box's words change."""
    pc_period_ps: int = 10 * PS_PER_MS
    """Period with which the PC makes a request."""
    retry_ps: int = 100 * PS_PER_US
    """Time to the PC's next reading where Data Valid was low."""
    latency_ps: int = 100 * PS_PER_US
    """Latency of a message, either way."""
    reversal_mm: float = 0.020
    """Hysteresis of the direction that the PC follows: a correction at rest moves the axis, too."""
    rounding_margin: float = 0.03
    """Hysteresis of the rounding to whole steps, in steps, so that a correction does not undo itself."""
    pc_window_steps: int | None = None
    """Largest change that the PC asks for at once; None: the window of the box. One that asks for more needs the flag
    Large Correction wherever the error jumps, as at a restart with a hot machine."""
    outside: Outside = Outside.HOLD
    """What becomes of the correction where the PC's model has no answer."""

    def __post_init__(self) -> None:
        whole_within("window_steps", self.window_steps, 1, 32767)
        if self.pc_window_steps is not None:
            whole_within("pc_window_steps", self.pc_window_steps, 1, 32767)
        whole_within("grace_readings", self.grace_readings, 0, 1000)
        whole_within("box_period_ps", self.box_period_ps, PS_PER_US, 1000 * PS_PER_MS, unit="ps")
        whole_within("pc_period_ps", self.pc_period_ps, PS_PER_US, 10_000 * PS_PER_MS, unit="ps")
        whole_within("update_ps", self.update_ps, 0, self.box_period_ps - 1, unit="ps (below box_period_ps)")
        whole_within("retry_ps", self.retry_ps, PS_PER_US, self.pc_period_ps, unit="ps (up to pc_period_ps)")
        longest_ps = (SLOTS - 1) * min(self.box_period_ps, self.pc_period_ps)
        whole_within("latency_ps", self.latency_ps, 0, longest_ps, unit="ps (messages under way are limited)")
        number_within("reversal_mm", self.reversal_mm, 0.0, 1e3, unit="mm")
        number_within("rounding_margin", self.rounding_margin, 0.0, 0.5, unit="steps")
        if self.retry_ps + self.update_ps >= self.box_period_ps and self.update_ps > 0:
            raise ArgumentError(
                "retry_ps",
                self.retry_ps,
                f"less than {self.box_period_ps - self.update_ps} ps",
                "otherwise the PC may read while Data Valid is low every time",
            )

    def fill_box(self, box: Record, *, switch_on: bool = True) -> None:
        """Write the parameters into the box's state."""
        box.period_ps = self.box_period_ps
        box.update_ps = self.update_ps
        box.window = self.window_steps
        box.grace = self.grace_readings
        box.switch_on = int(switch_on)

    def fill_pc(self, pc: Record, *, count_mm: float, step_counts: int, word_limit: int) -> None:
        """Write the parameters into the PC's state."""
        pc.period_ps = self.pc_period_ps
        pc.retry_ps = self.retry_ps
        pc.valid_after_ps = self.update_ps
        pc.window = self.window_steps
        pc.most = self.window_steps if self.pc_window_steps is None else self.pc_window_steps
        pc.word_limit = word_limit
        pc.count_mm = count_mm
        pc.step_mm = count_mm * step_counts
        pc.reversal_mm = self.reversal_mm
        pc.margin_steps = self.rounding_margin
        pc.home_count = 0
        pc.at_outside = list(Outside).index(self.outside)
