"""Between drive and controller: an encoder that gives pulses, and a corrector's box that slips counts in.

Each axis is a closed loop of `rtec.machine`: its plant is the drive, its command the toolpath.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from rtec.axis import Dwell, Encoder, Limits, MotionSegments, Move, Program, plan
from rtec.axis.plants import DriveRun
from rtec.axis.plants.cascade import OUTPUTS
from rtec.axis.plants.run import Drive
from rtec.axis.sampled import one_after_another, sampled_command
from rtec.board import Microcontroller
from rtec.errors import ArgumentError
from rtec.injector import InjectorSettings
from rtec.machine import TRACE_COLUMNS, Ending, LoopResult, Machine, run_machine
from rtec.predictors import NoError, Predictor
from rtec.units import PS_PER_S

Floats = npt.NDArray[np.float64]
_COLUMNS = (*TRACE_COLUMNS, *OUTPUTS)
_HOME_S, _SETTLE_S, _APPROACH_S = 0.5, 1.0, 5.0
"""At home, until the PC has taken the axis over; before the path; and on the way between, slowly."""
_FASTEST_MM_S = 200.0
"""On the way from home."""
FOLLOWING_LIMIT_MM = 10.0
"""Following error at which the controller stops an axis: ten times what the faster drive has at full speed."""
_MOST_COUNTS = 1e9
"""Of an axis in a run: half a minute."""
_ROOM_MM = 5.0
"""Beyond the commands, that a predictor has to be known for: following error and overshoot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulses:
    """Encoders with a resolution, their scales' errors, and a box.

    Raises
    ------
    ArgumentError
        A count that is no length above 0, up to 1 mm.
    """

    count_mm: float
    injector: InjectorSettings | None = None
    """The box in each axis; None where the lines go straight to the controller."""
    microcontroller: Microcontroller | None = None
    """A processor that runs the design's program in the box, in place of its model."""
    errors: Mapping[str, Predictor] = field(default_factory=dict)
    """What the scale of an axis is wrong by, actual less encoder, by letter; the PC knows the same."""

    def __post_init__(self) -> None:
        if not 0.0 < self.count_mm <= 1.0:
            raise ArgumentError("count", f"{self.count_mm:g} mm", "a length above 0, up to 1 mm")
        object.__setattr__(self, "errors", MappingProxyType(dict(self.errors)))


def run_over_pulses(
    drive: Drive, period_s: float, command_mm: Floats, pulses: Pulses, letter: str
) -> tuple[DriveRun, LoopResult]:
    """Move a drive along a command that begins at rest; its controller counts pulses.

    The axis is homed at 0 mm and goes to the first position before the run begins, so that what is to be corrected
    there is in.

    Parameters
    ----------
    drive
        With its cascade: the position loop takes what the controller has counted.
    period_s
        Of the commands, a whole number of control periods.
    command_mm
        Shape (samples,).
    pulses, letter
        What is between drive and controller, and the axis for whose error it is asked.

    Returns
    -------
    tuple
        The run, its integration error not known (NaN): quantised, two integrations count at other times. It ends
        where the controller stops the axis, because the following error exceeds `FOLLOWING_LIMIT_MM`. And what box
        and receiver did.

    Raises
    ------
    ArgumentError
        An error that is not known where the axis goes, more counts than can be run, or an axis that the PC holds or
        whose drive faults.
    """
    error = pulses.errors.get(letter, NoError())
    low, high = error.range_mm
    least, most = min(float(command_mm.min()), 0.0) - _ROOM_MM, max(float(command_mm.max()), 0.0) + _ROOM_MM
    if least < low or most > high:
        needed = f"one from {least:.4g} to {most:.4g} mm: axis {letter} is homed at 0 mm"
        raise ArgumentError("error", f"known from {low:g} to {high:g} mm", needed)
    way_mm = abs(float(command_mm[0])) + float(np.abs(np.diff(command_mm)).sum())
    if way_mm > _MOST_COUNTS * pulses.count_mm:
        raise ArgumentError(
            "count", f"{pulses.count_mm:g} mm", f"{way_mm / _MOST_COUNTS:.2g} mm or more for this path"
        )
    servo, encoder = drive.servo(), Encoder(count_mm=pulses.count_mm)
    before, path = _approach(float(command_mm[0])), sampled_command([*command_mm, command_mm[-1]], period_s)
    machine = Machine(
        axis_error=error,
        model=error,
        injector=pulses.injector,
        microcontroller=pulses.microcontroller,
        encoder=encoder,
        servo=servo,
    )
    every = round(period_s * PS_PER_S) // servo.period_ps
    result = run_machine(machine, one_after_another(before, path), trace_every=every)
    if result.ending is not Ending.FINISHED or result.trace is None:
        when = f"axis {letter} after {result.simulated_s - before.total_ps / PS_PER_S:.3f} s of the path"
        why = "its drive faults" if result.ending is Ending.FAULTED else f"the PC holds it ({result.status.meaning})"
        raise ArgumentError("path", f"{when}: {why}", "a smaller error, a finer step, or a lower feed")
    first = before.total_ps // (servo.period_ps * every)
    rows = result.trace[first : first + command_mm.size].T
    seen = dict(zip(_COLUMNS, rows, strict=True))
    lost = np.abs(command_mm - seen["controller_mm"]) > FOLLOWING_LIMIT_MM
    if lost.any():
        seen = {name: values[: max(int(np.argmax(lost)), 2)] for name, values in seen.items()}
    samples = seen["controller_mm"].size
    run = DriveRun(
        time_s=period_s * np.arange(samples, dtype=np.float64),
        command_mm=command_mm[:samples],
        actual_mm=seen["controller_mm"],
        load_mm=seen["true_mm"],
        velocity_mm_s=seen["load_mm_s"],
        current_a=seen["current_a"],
        force_n=drive.n_per_a * seen["current_a"],
        friction_n=seen["friction_n"],
        integration_error_nm=float("nan"),
    )
    return run, result


def _approach(first_mm: float) -> MotionSegments:
    """Return the way from home to the first position; it lasts whole seconds, so that the path's clock begins."""
    speed = min(max(abs(first_mm) / _APPROACH_S, 1.0), _FASTEST_MM_S)
    limits = Limits(max_speed_mm_s=2.0 * speed, max_acceleration_mm_s2=10.0 * speed, rapid_mm_s=speed)
    blocks: list[Dwell | Move] = [Dwell(seconds=_HOME_S), Move(target_mm=first_mm, feed_mm_s=speed)]
    if first_mm == 0.0:
        blocks.pop()
    lasts_s = plan(Program(blocks=tuple(blocks)), limits).total_ps / PS_PER_S
    blocks.append(Dwell(seconds=float(np.ceil(lasts_s + _SETTLE_S)) - lasts_s))
    return plan(Program(blocks=tuple(blocks)), limits)
