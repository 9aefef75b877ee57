"""A log of a moving axis made ready: transients left out, derivatives taken, the decimation laid down."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.drive_signals import (
    Resample,
    cutoff_of,
    local_derivatives,
    low_pass,
    settling_samples,
    shortest_stretch,
    stages_of,
)
from rtec.dataset.moving_log import even_rate, transient_rows
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import (
    Ints,
    Stretch,
    band_of,
    dead_zone,
    group_means,
    last_direction,
    noise_of,
    rest_numbers,
    rest_stretches,
    starts_of_groups,
    stretches_of,
    unbroken,
)
from rtec.effects.conditions import Floats
from rtec.errors import FileFormatError

_AT_REST = 1e-3  # share of the largest speed below which an axis is at rest, where only a velocity tells
_SIGMAS = 4.0  # of the noise of a velocity: what is larger is motion
_FEWEST_KEPT = 20  # rows of a standstill that are kept at either end, even if the axis settles sooner
_SETTLED = 4.0  # standard deviations at the end of a standstill: what is farther off has not settled
_STALE = 0.3  # share of rows that repeat the row before from which a log was written faster than it was measured


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
            why = "the axis is still in another motion (homing) there, far off the constant speed that it keeps later"
            first = f"the first {time_s[count] - time_s[0]:.2f} s{which} ({count} rows)"
            rows.notes.append(f"{first} are left out: {why}")
    rows.keep(kept)


def _leave_out_stale(rows: Rows) -> None:
    """Leave out the rows of an unevenly sampled log that repeat the row before in everything but the time."""
    seen = [x for x in (rows.position, rows.velocity, rows.observed, *rows.temperatures.values()) if x is not None]
    stale = np.append(False, np.all([np.diff(x) == 0.0 for x in seen], axis=0) & (rows.run[1:] == rows.run[:-1]))
    if stale.mean() >= _STALE:
        rows.keep(~stale)
        why = "nothing was measured anew"
        rows.notes.append(f"{int(stale.sum())} rows that only repeat the row before are left out: {why}")


def prepare_log(rows: Rows, like: Dataset | None) -> tuple[Resample | None, float | None]:
    """Give a log velocity, acceleration and direction, by the filters of the log that it is compared with.

    Its decimation comes back (None without), and the cut-off of the low pass in Hz (None where nothing was filtered).
    Runs between which the log goes on are one motion to the filters: its turning points stay in it.

    An unevenly sampled log is differentiated by local parabolas at its actual times, and neither filtered nor
    decimated: resampling to an even grid would mix neighbouring readings, and what depends on position alone
    (cogging) needs no derivative. A deviation is not decimated either: nothing differentiates it.
    """
    resample, used = None, None
    _find_rests(rows)  # before any filter, whose ringing looks like turning round
    if rows.time_s is not None:
        run = rows.run if rows.pauses_unknown else unbroken(rows.time_s, rows.position, rows.run)
        stretches = stretches_of(rows.time_s, run)
        rate = even_rate(rows.time_s, stretches) if like is None or like.cutoff_hz is not None else None
        if rate is None:
            _differentiate_unevenly(rows)
        else:
            used = cutoff_of(rate) if like is None or like.cutoff_hz is None else min(like.cutoff_hz, 0.45 * rate)
            resample = _differentiate(rows, stretches, rate, used)
    _give_direction(rows)
    if rows.rest is not None and not rows.of_drive:
        _thin_rests(rows, rows.rest)
    elif rows.rest is not None and (rows.rest >= 0).any():
        resample = _mean_at_rest(rows, rows.rest, resample)
    return resample, used


def _find_rests(rows: Rows) -> None:
    """Set the direction of the last motion, and which rows belong to a standstill."""
    if rows.coordinate == "time" or np.ptp(rows.position) == 0.0:
        return
    least = dead_zone(rows.position, rows.run, band_of(rows.position, rows.run)) if rows.of_drive else None
    rows.held_direction = last_direction(rows.position, rows.run, least)
    if rows.time_s is not None:
        found = rest_stretches(rows.time_s, rows.position, rows.run, rows.velocity)
        rows.rest = rest_numbers(found, len(rows)) if found else None


def _differentiate_unevenly(rows: Rows) -> None:
    if rows.of_drive:
        _leave_out_stale(rows)
    if rows.time_s is None:
        return
    source = rows.position if rows.velocity is None else rows.velocity
    parts = [slice(*stretch) for stretch in stretches_of(rows.time_s, rows.run)]
    first, second = np.hstack([local_derivatives(rows.time_s[part], source[part]) for part in parts])
    what, of = "acceleration", " of the velocity column"
    if rows.velocity is None:
        rows.velocity, first, what, of = first, second, "velocity and acceleration", ""
    rows.acceleration = first
    rows.notes.append(f"unevenly sampled: {what} from local parabolas through 21 rows{of}")


def _differentiate(rows: Rows, stretches: list[Stretch], rate: float, cutoff_hz: float) -> Resample | None:
    """Filter and differentiate each stretch, drop its ends, and return the decimation of a drive."""
    ends, shortest = settling_samples(rate), shortest_stretch(rate)
    long = [(begin, end) for begin, end in stretches if end - begin >= shortest]
    if not long:
        longest = max(end - begin for begin, end in stretches)
        problem = f"a log of {longest} samples without a gap at {rate:.4g} Hz"
        raise FileFormatError(rows.measurement.source, None, problem, f"at least {shortest} samples")
    kept = np.zeros(len(rows), dtype=np.bool_)
    smooth, velocity, acceleration = (np.zeros(len(rows)) for _ in range(3))
    for part in (slice(*stretch) for stretch in long):
        smooth[part] = low_pass(rows.position[part], rate, cutoff_hz)
        given = None if rows.velocity is None else low_pass(rows.velocity[part], rate, cutoff_hz)
        velocity[part] = np.gradient(smooth[part], 1.0 / rate) if given is None else given
        acceleration[part] = np.gradient(velocity[part], 1.0 / rate)
        kept[part.start + ends : part.stop - ends] = True
    what = "position" if rows.velocity is None else "velocity column"
    rows.smoothed_off = None if rows.velocity is None else np.abs(rows.velocity - velocity)
    rows.velocity, rows.acceleration = velocity, acceleration
    if rows.of_drive and rows.coordinate != "time":
        rows.position = smooth
    rows.keep(kept)
    rows.notes.append(
        f"{what} through a 4-pole Butterworth low pass at {cutoff_hz:g} Hz, forwards and backwards (no phase), "
        f"central differences, {ends / rate:.2g} s dropped at each end"
    )
    if len(long) < len(stretches):
        rows.notes.append(f"{len(stretches) - len(long)} stretches too short to be filtered are left out")
    stages = stages_of(rate) if rows.of_drive else ()
    if not stages:
        return None
    begins = np.cumsum([0, *(end - begin - 2 * ends for begin, end in long)]).tolist()
    resample = Resample(stretches=tuple(itertools.pairwise(begins)), stages=stages)
    rows.notes.append(
        f"{rows.observe} and every column of every effect decimated by {resample.factor} (zero-phase Chebyshev low "
        f"pass), from {rate:.4g} Hz to {rate / resample.factor:.4g} Hz"
    )
    return resample


def _mean_at_rest(rows: Rows, rest: Ints, resample: Resample | None) -> Resample | None:
    """Put the rows of each standstill of a drive together into one, with velocity and acceleration 0.

    Where ``resample`` decimates the rows later, they are made constant at each standstill, and the decimation comes
    back that merges what it decimated.
    """
    resting, starts = rest >= 0, starts_of_groups(rest)
    for name in ("velocity", "acceleration"):
        setattr(rows, name, np.where(resting, 0.0, getattr(rows, name)))
    means = np.repeat(group_means(rows.position, starts), np.diff(np.append(starts, rest.size)))
    rows.position = np.where(resting, means, rows.position)
    if resample is None:
        rows.merge(starts)
    else:
        near = np.clip(resample.kept[:, None] + np.array([-1, 0, 1]) * resample.factor, 0, rest.size - 1)
        within = np.where((rest[near] == rest[near[:, 1:2]]).all(1), rest[resample.kept], -1)
        resting, starts = within >= 0, starts_of_groups(within)
        resample = replace(resample, starts=starts)
    count, places = int(resting.sum()), int(resting[starts].sum())
    rows.notes.append(f"{count} rows at rest became {places}, one for each standstill, the mean of its rows")
    return resample


def _thin_rests(rows: Rows, rest: Ints) -> None:
    """Leave out rows of long standstills in a log of deviations: those beyond what the axis takes to settle.

    A standstill keeps the rows until it has settled, as many again spread over the rest of it, and 20 of either.
    """
    kept = np.ones(len(rows), dtype=np.bool_)
    for begin, values in zip(starts := starts_of_groups(rest), np.split(rows.observed, starts[1:]), strict=True):
        if values.size <= 2 * _FEWEST_KEPT:
            continue
        settled = values[values.size // 2 :]
        final = float(np.median(settled))
        noise = 1.4826 * float(np.median(np.abs(settled - final)))
        away = np.flatnonzero(np.abs(values[: values.size // 2] - final) > _SETTLED * noise)
        first = max(_FEWEST_KEPT, int(away.max(initial=-1)) + 1)
        if values.size > 2 * first:
            kept[begin + first : begin + values.size] = False
            kept[np.linspace(begin + first, begin + values.size - 1, first).round().astype(np.int64)] = True
    if not kept.all():
        rows.keep(kept)
        rows.notes.append(
            f"{int((~kept).sum())} rows of long standstills are left out: those kept show how the axis settles, and "
            "more of them would outweigh the motion"
        )


def _at_rest_between(direction: Floats, rest: Ints) -> Floats:
    """Return the direction with 0 in each standstill between motions in different directions, shape (rows,).

    There friction may point either way; where the axis goes on as it came, it does not let go meanwhile.
    """
    starts, around = starts_of_groups(rest), np.concatenate(([0.0], direction, [0.0]))
    sizes = np.diff(np.append(starts, rest.size))
    before, after = around[starts], around[starts + sizes + 1]
    return np.where(rest >= 0, np.repeat(np.where(before == after, before, 0.0), sizes), direction)


def _give_direction(rows: Rows) -> None:
    """Set the direction: that of the last motion; of a drive 0 at rest, where friction may point either way."""
    if rows.direction is not None:
        rows.held_direction = rows.direction
    elif rows.held_direction is not None:
        rows.direction = rows.held_direction
        if rows.of_drive and rows.velocity is not None:
            # where the axis stops or starts suddenly a low pass overshoots: its sign is none of the motion's
            doubt = 0.0 if rows.smoothed_off is None else rows.smoothed_off
            certain = np.abs(rows.velocity) > np.maximum(_velocity_noise(rows, rows.velocity), doubt)
            rows.direction = np.where(certain, np.sign(rows.velocity), rows.direction)
        if rows.of_drive and rows.rest is not None:
            rows.direction = _at_rest_between(rows.direction, rows.rest)
        still = ", 0 at rest" * rows.of_drive
        rows.notes.insert(0, f"no direction column: the direction is the sign of the motion{still}")
    elif rows.velocity is not None and (fastest := float(np.abs(rows.velocity).max())) > 0.0:
        least = max(_AT_REST * fastest, min(_velocity_noise(rows, rows.velocity), fastest / 10.0))
        rows.direction = np.where(np.abs(rows.velocity) < least, 0.0, np.sign(rows.velocity))
        rows.notes.insert(0, f"no direction column: the direction is the sign of the velocity, 0 below {least:.3g}")


def _velocity_noise(rows: Rows, velocity: Floats) -> float:
    """Return the speed up to which a velocity column may be noise: four standard deviations, at standstill if any."""
    still = np.empty(0) if rows.rest is None else np.abs(velocity[rows.rest >= 0])
    return _SIGMAS * (1.4826 * float(np.median(still)) if still.size else noise_of(velocity, rows.run))
