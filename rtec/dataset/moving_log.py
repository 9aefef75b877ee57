"""A log of a moving axis: derivatives, directions, standstills, decimation, places passed again."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.direction import with_direction, with_last_direction
from rtec.dataset.drive_signals import (
    Resample,
    cutoff_of,
    even_grid,
    even_rate,
    lag_of,
    local_derivatives,
    settling_samples,
    shortest_stretch,
    smooth_derivatives,
    stages_of,
    step_of,
)
from rtec.dataset.kind import with_rests
from rtec.dataset.passes import passed_again
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import (
    Ints,
    Stretch,
    band_of,
    group_means,
    starts_of_groups,
    stretches_of,
    stretches_where,
    unbroken,
)
from rtec.dataset.to_dataset import dataset_of, with_conditions
from rtec.effects.conditions import Floats
from rtec.errors import FileFormatError

_RESOLVED, _NOWHERE = 2.0, 0.25  # counts that an axis goes at the speed that counts as creep; share of that way
_FEWEST_KEPT = 20  # rows of a standstill that are kept at either end, even if the axis settles sooner
_SETTLED = 4.0  # standard deviations at the end of a standstill: what is farther off has not settled
_FEWEST_LEVELS = 16  # of a rounded signal in motion: one with fewer goes at a few speeds
_STALE = 0.2  # share of rows that repeat the row before from which a log was written faster than it was measured
_LONGEST_HOLD, _REGULAR = 20, 0.98  # rows that repeat a sample; share of the new samples that come at equal steps


def moving_log(log: Rows, like: Dataset | None) -> Dataset:
    """Return the data set of a log, by the filters of the log that it is compared with (``like``).

    An unevenly sampled log is differentiated on an even grid, but keeps its rows and is not decimated: readings
    on the grid would be mixtures of neighbours. A deviation is not decimated either: nothing differentiates it.
    """
    band, least = band_of(log.position, log.run), 0.0
    log, stretches = _without_stale(log, _stretches(log))
    log = with_last_direction(log)
    resample = cutoff_hz = None
    if log.time_s is not None:
        rate = even_rate(log.time_s, stretches) if like is None or like.cutoff_hz is not None else None
        if rate is None:
            log, passed_hz = _differentiated_unevenly(log, log.time_s, stretches)
        else:
            passed_hz = cutoff_hz = _cutoff(log, stretches, rate, like)
            log, resample = _differentiated(log, stretches, rate, cutoff_hz)
        least = band / 2.0 * passed_hz
        if log.of_drive and log.coordinate != "time":
            log = _with_creep(log, band / 2.0, least)
    log = with_direction(log, band, least)
    if log.rest is not None:
        log, resample = _mean_at_rest(log, log.rest, resample) if log.of_drive else (_thinned(log, log.rest), None)
    log, conditions = with_conditions(log, moving=True)
    observed = log.observed if resample is None else resample.apply(log.observed)
    passage, cell = passed_again(log, resample, observed)
    if (cell >= 0).any():
        note = "places passed again in the same direction at a similar speed count as repeats"
        log = replace(log, notes=(*log.notes, note))
    return dataset_of(log, conditions, observed, passage, cell, resample, cutoff_hz)


def _stretches(log: Rows) -> list[Stretch]:
    """Return the stretches that are filtered each for itself: runs between which a log goes on are one motion."""
    if log.time_s is None or log.pauses_unknown:
        return stretches_of(log.time_s, log.run)
    return stretches_of(log.time_s, unbroken(log.time_s, log.position, log.run))


def _without_stale(log: Rows, stretches: list[Stretch]) -> tuple[Rows, list[Stretch]]:
    """Leave out the rows of a drive in motion that repeat the row before because nothing was measured anew.

    Where the force repeats itself more often while the position does, the logger repeats samples; by chance it would
    repeat itself as often beside a new position. Where every so many rows bring something new, those are kept.
    """
    if log.time_s is None or not log.of_drive:
        return log, stretches
    seen = [x for x in (log.position, log.velocity) if x is not None]
    moving = (log.run[1:] == log.run[:-1]) & (True if log.rest is None else log.rest[1:] < 0)
    stays, same = np.all([np.diff(x) == 0.0 for x in seen], axis=0), np.diff(log.observed) == 0.0
    for begin, end in stretches_where(stays):
        moving[begin:end] &= end - begin <= _LONGEST_HOLD
    still, goes = moving & stays, moving & ~stays
    if not still.any() or not goes.any():
        return log, stretches
    chance = float(same[goes].mean())
    repeated = (float(same[still].mean()) - chance) / max(1.0 - chance, 1e-9)
    if repeated * still.sum() < _STALE * moving.sum():
        return log, stretches
    new = np.flatnonzero(moving & ~(stays & same)) + 1
    for period in range(_LONGEST_HOLD, 1, -1):
        phase = np.bincount(new % period, minlength=period)
        if phase.max() >= _REGULAR * new.size:
            kept = np.arange(len(log)) % period == int(phase.argmax())
            break
    else:
        kept = np.append(True, ~(still & same))
    piece = np.repeat(np.arange(len(stretches)), [end - begin for begin, end in stretches])
    note = f"{int((~kept).sum())} rows that only repeat the row before are left out: nothing was measured anew"
    return with_rests(replace(log.keep(kept), notes=(*log.notes, note))), stretches_of(None, piece[kept])


def _cutoff(log: Rows, stretches: list[Stretch], rate_hz: float, like: Dataset | None) -> float:
    """Return the cut-off of the low pass in Hz: that of ``like``, else what the position or velocity asks for."""
    if like is not None and like.cutoff_hz is not None:
        return min(like.cutoff_hz, 0.45 * rate_hz)
    source = log.position if log.velocity is None else log.velocity
    commanded = not log.of_drive and log.velocity is None and "target" in log.measurement.columns
    parts = [source[begin:end] for begin, end in stretches]
    step = step_of(source, _FEWEST_LEVELS)
    return cutoff_of(parts, rate_hz, step, noisy=log.velocity is None, commanded=commanded)


def _differentiated_unevenly(log: Rows, time_s: Floats, stretches: list[Stretch]) -> tuple[Rows, float]:
    """Differentiate on an even grid, from which only these derivatives are taken; return the cut-off, too."""
    source = log.position if log.velocity is None else log.velocity
    parts = [slice(*stretch) for stretch in stretches]
    passed = np.concatenate([np.diff(time_s[part]) for part in parts])
    usual = float(np.median(passed[passed > 0.0])) if (passed > 0.0).any() else 1.0
    grids = [even_grid(time_s[part], source[part], usual) for part in parts]
    step = step_of(source, _FEWEST_LEVELS)
    cutoff = cutoff_of([values for _, values in grids], 1.0 / usual, step, noisy=log.velocity is None)
    found = []
    for part, (grid, values) in zip(parts, grids, strict=True):
        of_grid, at = smooth_derivatives(grid, values, cutoff)[1:], time_s[part]
        settles = np.minimum(at - at[0], at[-1] - at) < 2.0 / cutoff
        local = local_derivatives(at, source[part])
        found.append([np.where(settles, x, np.interp(at, grid, y)) for x, y in zip(local, of_grid, strict=True)])
    first, second = np.hstack(found)
    what, velocity, acceleration = "acceleration from the velocity column", log.velocity, first
    if velocity is None:
        what, velocity, acceleration = "velocity and acceleration from the position", first, second
    low_pass = f"a 4-pole Butterworth low pass at {cutoff:.4g} Hz, forwards and backwards (no phase)"
    note = f"unevenly sampled: {what} on an even grid, through {low_pass}"
    return replace(log, velocity=velocity, acceleration=acceleration, notes=(*log.notes, note)), cutoff


def _differentiated(
    log: Rows, stretches: list[Stretch], rate: float, cutoff_hz: float
) -> tuple[Rows, Resample | None]:
    """Filter and differentiate each stretch, drop its ends, and return the decimation of a drive, too."""
    ends, shortest = settling_samples(rate), shortest_stretch(rate)
    long = [(begin, end) for begin, end in stretches if end - begin >= shortest]
    if not long:
        longest = max(end - begin for begin, end in stretches)
        problem = f"a log of {longest} samples without a gap at {rate:.4g} Hz"
        raise FileFormatError(log.measurement.source, None, problem, f"at least {shortest} samples")
    begins = np.cumsum([0, *(end - begin - 2 * ends for begin, end in long)]).tolist()
    kept = np.zeros(len(log), dtype=np.bool_)
    columns = np.empty((3 if log.velocity is None else 4, begins[-1]))
    lags_s = []
    for (begin, end), (first, last) in zip(long, itertools.pairwise(begins), strict=True):
        found, lag_s = _derivatives(log, slice(begin, end), rate, cutoff_hz)
        for column, values in zip(columns, found, strict=True):
            column[first:last] = values[ends : end - begin - ends]
        kept[begin + ends : end - ends] = True
        lags_s += [lag_s] if lag_s else []
    what, notes = "position" if log.velocity is None else "velocity column", [*log.notes]
    if lags_s:
        notes.append(f"the velocity column is {1e3 * float(np.median(lags_s)):.3g} ms behind the position: set right")
    notes.append(
        f"{what} through a 4-pole Butterworth low pass at {cutoff_hz:g} Hz, forwards and backwards (no phase), "
        f"central differences, {ends / rate:.2g} s dropped at each end"
    )
    if len(long) < len(stretches):
        notes.append(f"{len(stretches) - len(long)} stretches too short to be filtered are left out")
    resample, stages = None, stages_of(rate) if log.of_drive else ()
    if stages:
        resample = Resample(stretches=tuple(itertools.pairwise(begins)), stages=stages)
        notes.append(
            f"{log.observe} and every column of every effect decimated by {resample.factor} (zero-phase Chebyshev "
            f"low pass), from {rate:.4g} Hz to {rate / resample.factor:.4g} Hz"
        )
    log = replace(log, velocity=None).keep(kept)
    position = columns[0] if log.of_drive and log.coordinate != "time" else log.position
    off = columns[3] if len(columns) > 3 else None
    log = replace(log, position=position, velocity=columns[1], acceleration=columns[2], smoothed_off=off)
    return replace(log, notes=tuple(notes)), resample


def _derivatives(log: Rows, part: slice, rate: float, cutoff_hz: float) -> tuple[list[Floats], float]:
    """Return smooth position, velocity and acceleration of a stretch; beside a velocity column what the filter took.

    Also by how many seconds a velocity column was late, 0 where there is none.
    """
    time_s, position = np.arange(part.stop - part.start) / rate, log.position[part]
    smooth, velocity, acceleration = smooth_derivatives(time_s, position, cutoff_hz)
    if log.velocity is None:
        return [smooth, velocity, acceleration], 0.0
    given = log.velocity[part]
    lag_s = lag_of(rate, position, given) if log.coordinate != "time" else 0.0
    if lag_s:
        given = given + lag_s * rate * np.gradient(given)
    velocity, acceleration, _ = smooth_derivatives(time_s, given, cutoff_hz)
    return [smooth, velocity, acceleration, np.abs(given - velocity)], lag_s


def _with_creep(log: Rows, count: float, least: float) -> Rows:
    """Call slower motion than ``least``, which leads nowhere, a standstill: friction may be anything up to breakaway.

    At that speed the axis goes a ``count`` in the time that the low pass resolves.
    """
    time_s, velocity = np.asarray(log.time_s), np.asarray(log.velocity)
    rest = np.full(len(log), -1, dtype=np.int64) if log.rest is None else log.rest.copy()
    for begin, end in stretches_where((np.abs(velocity) < least) | (rest >= 0)):
        way, lasts_s = float(np.ptp(log.position[begin:end])), float(time_s[end - 1] - time_s[begin])
        if (
            log.run[begin] == log.run[end - 1]
            and least * lasts_s >= _RESOLVED * count
            and way <= max(2.0 * count, _NOWHERE * least * lasts_s)
        ):
            known = int(rest[begin:end].max())
            rest[begin:end] = known if known >= 0 else rest.max() + 1
    return replace(log, rest=rest if (rest >= 0).any() else None)


def _mean_at_rest(log: Rows, rest: Ints, resample: Resample | None) -> tuple[Rows, Resample | None]:
    """Put the rows of each standstill of a drive together into one, with velocity and acceleration 0.

    Where ``resample`` decimates the rows later, they are made constant at each standstill, and the decimation comes
    back that merges what it decimated.
    """
    resting, starts = rest >= 0, starts_of_groups(rest)
    if not resting.any():
        return log, resample
    means = np.repeat(group_means(log.position, starts), np.diff(np.append(starts, rest.size)))
    log = replace(
        log,
        position=np.where(resting, means, log.position),
        velocity=np.where(resting, 0.0, np.asarray(log.velocity)),
        acceleration=np.where(resting, 0.0, np.asarray(log.acceleration)),
    )
    if resample is None:
        log = log.merge(starts)
    else:
        near = np.clip(resample.kept[:, None] + np.array([-1, 0, 1]) * resample.factor, 0, rest.size - 1)
        within = np.where((rest[near] == rest[near[:, 1:2]]).all(1), rest[resample.kept], -1)
        resting, starts = within >= 0, starts_of_groups(within)
        resample = replace(resample, starts=starts)
    count, places = int(resting.sum()), int(resting[starts].sum())
    note = f"{count} rows at rest became {places}, one for each standstill, the mean of its rows"
    return replace(log, notes=(*log.notes, note)), resample


def _thinned(log: Rows, rest: Ints) -> Rows:
    """Leave out rows of long standstills in a log of deviations: those beyond what the axis takes to settle.

    A standstill keeps the rows until it has settled, as many again spread over the rest of it, and 20 of either.
    """
    kept = np.ones(len(log), dtype=np.bool_)
    starts = starts_of_groups(rest)
    ends = np.append(starts[1:], rest.size)
    long = ends - starts > 2 * _FEWEST_KEPT
    for begin, end in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
        values = log.observed[begin:end]
        settled = values[values.size // 2 :]
        final = float(np.median(settled))
        noise = 1.4826 * float(np.median(np.abs(settled - final)))
        away = np.flatnonzero(np.abs(values[: values.size // 2] - final) > _SETTLED * noise)
        first = max(_FEWEST_KEPT, int(away.max(initial=-1)) + 1)
        if values.size > 2 * first:
            kept[begin + first : end] = False
            kept[np.linspace(begin + first, end - 1, first).round().astype(np.int64)] = True
    if kept.all():
        return log
    note = (
        f"{int((~kept).sum())} rows of long standstills are left out: those kept show how the axis settles, and "
        "more of them would outweigh the motion"
    )
    return replace(log.keep(kept), notes=(*log.notes, note))
