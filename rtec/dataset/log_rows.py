"""A log of a moving axis made ready: transients left out, derivatives taken, the decimation laid down."""

from __future__ import annotations

import numpy as np

from rtec.dataset.drive_signals import (
    Resample,
    cutoff_of,
    local_derivatives,
    low_pass,
    settling_samples,
    shortest_stretch,
    stages_of,
)
from rtec.dataset.moving_log import even_rate, last_direction, stretches_of, transient_rows
from rtec.dataset.observed import observable_of
from rtec.dataset.rows import Rows
from rtec.effects import Observable
from rtec.effects.conditions import Floats
from rtec.errors import FileFormatError

AT_REST = 1e-3
"""Share of the largest speed below which an axis is at rest."""


def leave_out_transient(rows: Rows) -> None:
    """Leave out the motion before the test proper, at the start of each run at constant speed."""
    if rows.time_s is None or rows.coordinate == "time":
        return
    kept = np.ones(len(rows), dtype=np.bool_)
    for begin, end in stretches_of(rows.time_s, rows.run):
        if begin and rows.run[begin] == rows.run[begin - 1]:
            continue
        time_s = rows.time_s[begin:end]
        count = transient_rows(time_s, rows.position[begin:end])
        if count:
            kept[begin : begin + count] = False
            which = "" if np.ptp(rows.run) == 0 else f" of run {rows.run[begin]}"
            rows.notes.append(
                f"the first {time_s[count] - time_s[0]:.2f} s{which} ({count} rows) are left out: the axis is still "
                "in another motion (homing) there, far off the constant speed that it keeps later"
            )
    if not kept.all():
        rows.keep(kept)


def prepare_log(rows: Rows, cutoff_hz: float | None, evenly: bool) -> tuple[Resample | None, float | None]:
    """Give a log velocity, acceleration and direction.

    Parameters
    ----------
    rows
        Without transient; changed in place.
    cutoff_hz
        Low pass to use, as in another log; None for that of `cutoff_of`.
    evenly
        Whether an evenly sampled log is filtered; False where the log that this one is compared with was not even.

    Returns
    -------
    tuple
        The decimation (None without) and the cut-off of the low pass in Hz (None where nothing was filtered).

    Raises
    ------
    FileFormatError
        No stretch of the log is long enough.

    Notes
    -----
    An unevenly sampled log is differentiated by local parabolas at its actual times, and neither filtered nor
    decimated: resampling to an even grid would mix neighbouring readings, and what depends on position alone
    (cogging) needs no derivative. A deviation is not decimated either: nothing differentiates it.
    """
    resample, used = None, None
    if rows.coordinate != "time" and np.ptp(rows.position) > 0.0:
        # before any filter, whose ringing looks like turning round
        rows.held_direction = last_direction(rows.position, rows.run)
    if rows.time_s is not None:
        stretches = stretches_of(rows.time_s, rows.run)
        rate = even_rate(rows.time_s, stretches) if evenly else None
        if rate is None:
            _differentiate_unevenly(rows, rows.time_s, stretches)
        else:
            used = min(cutoff_hz, 0.45 * rate) if cutoff_hz is not None else cutoff_of(rate)
            lengths = _differentiate(rows, stretches, rate, used)
            stages = stages_of(rate) if observable_of(rows.observe) is Observable.DRIVE else ()
            if stages:
                resample = _decimation(rows, lengths, stages, rate)
    _give_direction(rows)
    return resample, used


def _differentiate_unevenly(rows: Rows, time_s: Floats, stretches: list[tuple[int, int]]) -> None:
    source = rows.position if rows.velocity is None else rows.velocity
    first, second = np.zeros(len(rows)), np.zeros(len(rows))
    for begin, end in stretches:
        part = slice(begin, end)
        first[part], second[part] = local_derivatives(time_s[part], source[part])
    if rows.velocity is not None:
        rows.acceleration = first
        rows.notes.append(
            "unevenly sampled: acceleration from local parabolas through 21 rows of the velocity column"
        )
    elif rows.coordinate != "time":
        rows.velocity, rows.acceleration = first, second
        rows.notes.append("unevenly sampled: velocity and acceleration from local parabolas through 21 rows")


def _differentiate(rows: Rows, stretches: list[tuple[int, int]], rate: float, cutoff_hz: float) -> list[int]:
    """Filter and differentiate each stretch, drop its ends, and return how long the stretches are then."""
    ends, shortest = settling_samples(rate), shortest_stretch(rate)
    kept = np.zeros(len(rows), dtype=np.bool_)
    smooth, velocity, acceleration = (np.zeros(len(rows)) for _ in range(3))
    lengths = []
    for begin, end in stretches:
        if end - begin < shortest:
            continue
        part = slice(begin, end)
        smooth[part] = low_pass(rows.position[part], rate, cutoff_hz)
        if rows.velocity is None:
            velocity[part] = np.gradient(smooth[part], 1.0 / rate)
        else:
            velocity[part] = low_pass(rows.velocity[part], rate, cutoff_hz)
        acceleration[part] = np.gradient(velocity[part], 1.0 / rate)
        kept[begin + ends : end - ends] = True
        lengths.append(end - begin - 2 * ends)
    if not lengths:
        longest = max(end - begin for begin, end in stretches)
        problem = f"a log of {longest} samples without a gap at {rate:.4g} Hz"
        raise FileFormatError(rows.measurement.source, None, problem, f"at least {shortest} samples")
    if rows.coordinate == "time":
        smooth = rows.position
    given = rows.velocity is not None
    if given or rows.coordinate != "time":
        rows.velocity, rows.acceleration = velocity, acceleration
    if observable_of(rows.observe) is Observable.DRIVE:
        rows.position = smooth
    rows.keep(kept)
    what = "velocity column" if given else "position"
    rows.notes.append(
        f"{what} through a 4-pole Butterworth low pass at {cutoff_hz:g} Hz, forwards and backwards (no phase), "
        f"central differences, {ends / rate:.2g} s dropped at each end"
    )
    if len(lengths) < len(stretches):
        rows.notes.append(f"{len(stretches) - len(lengths)} stretches too short to be filtered are left out")
    return lengths


def _decimation(rows: Rows, lengths: list[int], stages: tuple[int, ...], rate: float) -> Resample:
    ends = np.cumsum(lengths).tolist()
    factor = int(np.prod(stages))
    rows.notes.append(
        f"{rows.observe} and every column of every effect decimated by {factor} (zero-phase Chebyshev low pass), "
        f"from {rate:.4g} Hz to {rate / factor:.4g} Hz"
    )
    return Resample(stretches=tuple(zip([0, *ends[:-1]], ends, strict=True)), stages=stages)


def _give_direction(rows: Rows) -> None:
    """Set the direction: the sign of the velocity, 0 at rest; a deviation keeps that of the last motion."""
    if rows.direction is not None:
        rows.held_direction = rows.direction
    elif rows.held_direction is not None and observable_of(rows.observe) is Observable.DEVIATION:
        rows.direction = rows.held_direction
    elif rows.velocity is not None and (fastest := float(np.abs(rows.velocity).max())) > 0.0:
        rows.direction = np.where(np.abs(rows.velocity) < AT_REST * fastest, 0.0, np.sign(rows.velocity))
