"""A feed drive moved along commands, and its log."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from rtec.axis.plants import _drive_kernels as kernels
from rtec.axis.plants.ball_screw import BallScrew
from rtec.axis.plants.linear_motor import LinearMotor
from rtec.axis.sampled import cubics
from rtec.checks import one_of_types
from rtec.compiled import finite_array
from rtec.errors import ArgumentError

FloatArray = npt.NDArray[np.float64]
Corrector: TypeAlias = Callable[[FloatArray], npt.ArrayLike] | npt.ArrayLike
MOST_PERIODS = 10_000
"""Control periods in one of the interpolation."""
Drive: TypeAlias = BallScrew | LinearMotor

_WHOLE = {"integration_error_nm"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriveRun:
    """What a drive did; arrays of shape (samples,) at the interpolation period."""

    time_s: FloatArray
    command_mm: FloatArray
    """What the axis was told; what it did, where it was given a current."""
    actual_mm: FloatArray
    """What the drive reads: encoder and corrector."""
    load_mm: FloatArray
    """Where the carriage is."""
    velocity_mm_s: FloatArray
    """Of the carriage."""
    current_a: FloatArray
    force_n: FloatArray
    """Of the motor, at the carriage."""
    friction_n: FloatArray
    """Against the motion, all of it."""
    integration_error_nm: float
    """Bound of the error of the positions: by how much twice as long steps change them."""

    @property
    def following_mm(self) -> FloatArray:
        """Command less what the drive reads."""
        return self.command_mm - self.actual_mm

    def until(self, samples: int) -> DriveRun:
        """Return the first samples."""
        arrays = {item.name: getattr(self, item.name)[:samples] for item in fields(self) if item.name not in _WHOLE}
        return replace(self, **arrays)

    def __str__(self) -> str:
        """Return the run in one line."""
        largest_um = 1e3 * float(np.abs(self.following_mm).max())
        return (
            f"{self.time_s.size} samples, {self.time_s[-1] - self.time_s[0]:.4g} s, following error up to "
            f"{largest_um:.4g} um, integration error below {self.integration_error_nm:.2g} nm"
        )


def run_drive(
    drive: Drive,
    time_s: npt.ArrayLike,
    command_mm: npt.ArrayLike,
    velocity_mm_s: npt.ArrayLike | None = None,
    acceleration_mm_s2: npt.ArrayLike | None = None,
    corrector: Corrector | None = None,
) -> DriveRun:
    """Move a drive along a command, from rest at its first position.

    Parameters
    ----------
    drive
        A `BallScrew` or a `LinearMotor`.
    time_s, command_mm
        Shape (samples,), equally spaced by a whole number of control periods; a command is due at its time, and the
        drive interpolates by cubics with the slopes of central differences.
    velocity_mm_s, acceleration_mm_s2
        For the feed-forwards, shape (samples,); central differences where they are not given.
    corrector
        What is added to the encoder's position in mm: an array of shape (samples,), held for a sample, or a function
        of times in s.

    Raises
    ------
    ArgumentError
        Arrays of other shapes, not finite, or not equally spaced.

    Notes
    -----
    The motion is integrated twice, with steps h and h/2. h is a control period (less for a drive stiffer than these),
    or an eighth of it where friction or play may change regime. The finer run is returned. Its error is below the
    difference of the two, since the method is of first order at least.

    Examples
    --------
    >>> from rtec.axis.plants import LinearMotor, run_drive
    >>> t = np.arange(4001) * 0.25e-3
    >>> run = run_drive(LinearMotor(), t, 1000 * t)
    >>> round(float(run.following_mm[-1]), 1), run.integration_error_nm < 1
    (0.3, True)
    """
    time, every = _clock(drive, time_s)
    command = _like(time, "command_mm", command_mm)
    period_s = (time[-1] - time[0]) / (time.size - 1)
    ticks = np.arange((time.size - 1) * every + 1) / every
    samples = np.arange(time.size)

    def between(values: FloatArray) -> FloatArray:
        return np.interp(ticks, samples, values)

    derived = np.gradient(command, period_s)
    speed = derived if velocity_mm_s is None else _like(time, "velocity_mm_s", velocity_mm_s)
    if acceleration_mm_s2 is None:
        acceleration = np.gradient(speed, period_s)
    else:
        acceleration = _like(time, "acceleration_mm_s2", acceleration_mm_s2)
    offset = np.zeros(ticks.size)
    if callable(corrector):
        at_s = time[0] + ticks * period_s
        offset = _like(at_s, "corrector", corrector(at_s))
    elif corrector is not None:
        offset = _held(_like(time, "corrector", corrector), every)
    position = _between(command, period_s, every)
    commands = np.stack([position, between(speed), between(acceleration), offset])
    return _run(drive, time, command, commands, every, open_loop=False)


def run_current(drive: Drive, time_s: npt.ArrayLike, current_a: npt.ArrayLike) -> DriveRun:
    """Give a drive a current, its position and velocity loops open; it begins at rest at 0 mm.

    Parameters
    ----------
    drive, time_s
        As of `run_drive`.
    current_a
        What the current loop is told, shape (samples,), held for a sample.

    Raises
    ------
    ArgumentError
        Arrays of other shapes, not finite, or not equally spaced.
    """
    time, every = _clock(drive, time_s)
    current = _held(_like(time, "current_a", current_a), every)
    zero = np.zeros(current.size)
    return _run(drive, time, None, np.stack([current, zero, zero, zero]), every, open_loop=True)


def log_columns(runs: Mapping[str, DriveRun]) -> dict[str, FloatArray]:
    """Return the columns of a controller's log, named as measurement files name them.

    Parameters
    ----------
    runs
        By the letter of the axis: X or x, ...

    Raises
    ------
    ArgumentError
        No run, a name that is no letter, or runs at different times.
    """
    if not runs:
        raise ArgumentError("runs", "no run", "a run for each axis")
    time = next(iter(runs.values())).time_s
    columns = {"time_s": time}
    for axis, run in runs.items():
        name = axis.lower()
        if not (len(name) == 1 and name.isascii() and name.isalpha()) or f"target_{name}_mm" in columns:
            raise ArgumentError("runs", repr(axis)[:60], "one letter for each axis, such as x")
        if not np.array_equal(run.time_s, time):
            raise ArgumentError("runs", f"axis {axis} at other times", "runs at the same times")
        columns |= {
            f"target_{name}_mm": run.command_mm,
            f"actual_{name}_mm": run.actual_mm,
            f"current_{name}_a": run.current_a,
        }
    return columns


def _run(
    drive: Drive, time: FloatArray, command: FloatArray | None, commands: FloatArray, every: int, *, open_loop: bool
) -> DriveRun:
    coarse = drive.simulate(commands, every, 1, open_loop=open_loop)
    out = drive.simulate(commands, every, 2, open_loop=open_loop)
    places = [kernels.LOAD, kernels.ENCODER]
    return DriveRun(
        time_s=time,
        command_mm=out[kernels.ENCODER] if command is None else command,
        actual_mm=out[kernels.ENCODER],
        load_mm=out[kernels.LOAD],
        velocity_mm_s=out[kernels.SPEED],
        current_a=out[kernels.CURRENT],
        force_n=drive.n_per_a * out[kernels.CURRENT],
        friction_n=out[kernels.FRICTION_N],
        integration_error_nm=1e6 * float(np.abs(out[places] - coarse[places]).max()),
    )


def _clock(drive: Drive, time_s: npt.ArrayLike) -> tuple[FloatArray, int]:
    """Return times, and how many control periods lie between two of them."""
    one_of_types("drive", drive, BallScrew, LinearMotor)
    time = finite_array("time_s", time_s)
    if time.size < 2:
        raise ArgumentError("time_s", f"{time.size} samples", "2 samples or more")
    period_us = 1e6 * (time[-1] - time[0]) / (time.size - 1)
    every = round(period_us / drive.cascade.period_us)
    if not 1 <= every <= MOST_PERIODS or abs(period_us - every * drive.cascade.period_us) > 1e-6 * period_us:
        allowed = f"a multiple of the {drive.cascade.period_us:g} us of the drive"
        raise ArgumentError("time_s", f"a period of {period_us:.9g} us", allowed)
    if np.abs(np.diff(time) - 1e-6 * period_us).max() > 1e-8 * period_us:
        raise ArgumentError("time_s", "times that are not equally spaced", "a constant period")
    return time, every


def _like(time: FloatArray, name: str, values: npt.ArrayLike) -> FloatArray:
    array = finite_array(name, values)
    if array.size != time.size:
        raise ArgumentError(name, f"{array.size} numbers", f"{time.size}, one for each time")
    return array


def _between(values: FloatArray, period_s: float, every: int) -> FloatArray:
    """Return values at control periods, on the cubics through the samples."""
    u = np.arange(every) * period_s / every
    slope, second, third = (part[:, None] for part in cubics(values, period_s))
    inner = values[:-1, None] + u * (slope + u * (second / 2.0 + u * third / 6.0))
    return np.append(inner.ravel(), values[-1])


def _held(values: FloatArray, every: int) -> FloatArray:
    return np.append(np.repeat(values[:-1], every), values[-1])
