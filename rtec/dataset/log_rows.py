"""A log of a moving axis made ready: transients left out, derivatives taken, the decimation laid down."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.dataset.drive_signals import (
    Resample,
    cutoff_of,
    even_grid,
    lag_of,
    local_derivatives,
    settling_samples,
    shortest_stretch,
    smooth_derivatives,
    stages_of,
    step_of,
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
_RESOLVED, _NOWHERE = 2.0, 0.25  # counts that an axis goes at the speed that counts as creep; share of that way
_FEWEST_KEPT = 20  # rows of a standstill that are kept at either end, even if the axis settles sooner
_SETTLED = 4.0  # standard deviations at the end of a standstill: what is farther off has not settled
FEWEST_LEVELS = 16  # of a rounded signal in motion: one with fewer goes at a few speeds
_STALE = 0.2  # share of rows that repeat the row before from which a log was written faster than it was measured
_LONGEST_HOLD, _REGULAR = 20, 0.98  # rows that repeat a sample; share of the new samples that come at equal steps


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


def _leave_out_stale(rows: Rows, piece: Ints) -> Ints:
    """Leave out the rows of a log in motion that repeat the row before because nothing was measured anew.

    Where the force repeats itself more often while the position does, the logger repeats samples; by chance it would
    repeat itself as often beside a new position. Where every so many rows bring something new, those are kept. The
    numbers of the stretches that the rows belong to come back for those kept.
    """
    seen = [x for x in (rows.position, rows.velocity) if x is not None]
    moving = (rows.run[1:] == rows.run[:-1]) & (True if rows.rest is None else rows.rest[1:] < 0)
    stays, same = np.all([np.diff(x) == 0.0 for x in seen], axis=0), np.diff(rows.observed) == 0.0
    for begin, end in _runs(stays):
        moving[begin:end] &= end - begin <= _LONGEST_HOLD
    still, goes = moving & stays, moving & ~stays
    if not still.any() or not goes.any():
        return piece
    chance = float(same[goes].mean())
    repeated = (float(same[still].mean()) - chance) / max(1.0 - chance, 1e-9)
    if repeated * still.sum() < _STALE * moving.sum():
        return piece
    new = np.flatnonzero(moving & ~(stays & same)) + 1
    for period in range(_LONGEST_HOLD, 1, -1):
        phase = np.bincount(new % period, minlength=period)
        if phase.max() >= _REGULAR * new.size:
            kept = np.arange(len(rows)) % period == int(phase.argmax())
            break
    else:
        kept = np.append(True, ~(still & same))
    rows.keep(kept)
    _find_rests(rows)
    why = "nothing was measured anew"
    rows.notes.append(f"{int((~kept).sum())} rows that only repeat the row before are left out: {why}")
    left: Ints = piece[kept]
    return left


def prepare_log(rows: Rows, like: Dataset | None) -> tuple[Resample | None, float | None]:
    """Give a log velocity, acceleration and direction, by the filters of the log that it is compared with.

    Its decimation comes back (None without), and the cut-off of the low pass in Hz (None where nothing was filtered).
    Runs between which the log goes on are one motion to the filters: its turning points stay in it.

    An unevenly sampled log is differentiated on an even grid, but keeps its rows and is not decimated: readings
    on the grid would be mixtures of neighbours. A deviation is not decimated either: nothing differentiates it.
    """
    resample, used = None, None
    _find_rests(rows)  # before any filter, whose ringing looks like turning round
    band, least = band_of(rows.position, rows.run), 0.0
    if rows.time_s is not None:
        run = rows.run if rows.pauses_unknown else unbroken(rows.time_s, rows.position, rows.run)
        stretches = stretches_of(rows.time_s, run)
        if rows.of_drive:
            piece = np.repeat(np.arange(len(stretches)), [end - begin for begin, end in stretches])
            stretches = stretches_of(None, _leave_out_stale(rows, piece))
        rate = even_rate(rows.time_s, stretches) if like is None or like.cutoff_hz is not None else None
        if rate is None:
            cutoff_hz = _differentiate_unevenly(rows, rows.time_s, stretches)
        else:
            source = rows.position if rows.velocity is None else rows.velocity
            step = step_of(source, FEWEST_LEVELS)
            commanded = not rows.of_drive and rows.velocity is None and "target" in rows.measurement.columns
            parts = [source[a:b] for a, b in stretches]
            own = cutoff_of(parts, rate, step, noisy=rows.velocity is None, commanded=commanded)
            cutoff_hz = used = own if like is None or like.cutoff_hz is None else min(like.cutoff_hz, 0.45 * rate)
            resample = _differentiate(rows, stretches, rate, used)
        least = band / 2.0 * cutoff_hz
        if rows.of_drive and rows.coordinate != "time" and rows.velocity is not None:
            _find_creep(rows, rows.time_s, rows.velocity, band / 2.0, least)
    _give_direction(rows, band, least)
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


def _find_creep(rows: Rows, time_s: Floats, velocity: Floats, count: float, least: float) -> None:
    """Call slower motion than ``least``, which leads nowhere, a standstill: friction may be anything up to breakaway.

    At that speed the axis goes a ``count`` in the time that the low pass resolves.
    """
    rest = np.full(len(rows), -1, dtype=np.int64) if rows.rest is None else rows.rest
    slow = (np.abs(velocity) < least) | (rest >= 0)
    for begin, end in _runs(slow):
        way, lasts_s = float(np.ptp(rows.position[begin:end])), float(time_s[end - 1] - time_s[begin])
        if (
            rows.run[begin] == rows.run[end - 1]
            and least * lasts_s >= _RESOLVED * count
            and way <= max(2.0 * count, _NOWHERE * least * lasts_s)
        ):
            known = int(rest[begin:end].max())
            rest[begin:end] = known if known >= 0 else rest.max() + 1
    rows.rest = rest if (rest >= 0).any() else None


def _differentiate_unevenly(rows: Rows, time_s: Floats, stretches: list[Stretch]) -> float:
    """Differentiate on an even grid, at whose times nothing but these derivatives is taken; return the cut-off."""
    source = rows.position if rows.velocity is None else rows.velocity
    parts = [slice(*stretch) for stretch in stretches]
    passed = np.concatenate([np.diff(time_s[part]) for part in parts])
    usual = float(np.median(passed[passed > 0.0])) if (passed > 0.0).any() else 1.0
    grids = [even_grid(time_s[part], source[part], usual) for part in parts]
    step = step_of(source, FEWEST_LEVELS)
    cutoff = cutoff_of([values for _, values in grids], 1.0 / usual, step, noisy=rows.velocity is None)
    found = []
    for part, (grid, values) in zip(parts, grids, strict=True):
        of_grid, at = smooth_derivatives(grid, values, cutoff)[1:], time_s[part]
        settles = np.minimum(at - at[0], at[-1] - at) < 2.0 / cutoff
        local = local_derivatives(at, source[part])
        found.append([np.where(settles, x, np.interp(at, grid, y)) for x, y in zip(local, of_grid, strict=True)])
    first, second = np.hstack(found)
    what, of = "acceleration", "velocity column"
    if rows.velocity is None:
        rows.velocity, first, what, of = first, second, "velocity and acceleration", "position"
    rows.acceleration = first
    low_pass = f"a 4-pole Butterworth low pass at {cutoff:.4g} Hz, forwards and backwards (no phase)"
    rows.notes.append(f"unevenly sampled: {what} from the {of} on an even grid, through {low_pass}")
    return cutoff


def _differentiate(rows: Rows, stretches: list[Stretch], rate: float, cutoff_hz: float) -> Resample | None:
    """Filter and differentiate each stretch, drop its ends, and return the decimation of a drive."""
    ends, shortest = settling_samples(rate), shortest_stretch(rate)
    long = [(begin, end) for begin, end in stretches if end - begin >= shortest]
    if not long:
        longest = max(end - begin for begin, end in stretches)
        problem = f"a log of {longest} samples without a gap at {rate:.4g} Hz"
        raise FileFormatError(rows.measurement.source, None, problem, f"at least {shortest} samples")
    kept = np.zeros(len(rows), dtype=np.bool_)
    smooth, velocity, acceleration, off = (np.zeros(len(rows)) for _ in range(4))
    late: list[float] = []
    for part in (slice(*stretch) for stretch in long):
        time_s = np.arange(part.stop - part.start) / rate
        smooth[part], velocity[part], acceleration[part] = smooth_derivatives(time_s, rows.position[part], cutoff_hz)
        if rows.velocity is not None:
            given = rows.velocity[part]
            lag_s = lag_of(rate, rows.position[part], given) if rows.coordinate != "time" else 0.0
            if lag_s:
                given = given + lag_s * rate * np.gradient(given)
            velocity[part], acceleration[part], _ = smooth_derivatives(time_s, given, cutoff_hz)
            off[part] = np.abs(given - velocity[part])
            late += [lag_s] if lag_s else []
        kept[part.start + ends : part.stop - ends] = True
    if late:
        rows.notes.append(
            f"the velocity column is {1e3 * float(np.median(late)):.3g} ms behind the position: set right"
        )
    what = "position" if rows.velocity is None else "velocity column"
    rows.smoothed_off = None if rows.velocity is None else off
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


def _turning(held: Floats, way: Floats, certain: NDArray[np.bool_], position: Floats, band: float) -> Floats:
    """Return the direction of the last motion, corrected by the sign ``way`` of the velocity; shape (rows,).

    Where the axis turned, within the ``band`` that hides it, the velocity knows best when. Where it is certain
    elsewhere, the axis goes back by less than it takes to have turned: friction need not have turned either, and the
    direction is 0.
    """
    found = held.copy()
    for begin, end in _runs(way * held < 0.0):
        turned = held[max(begin - 1, 0)] != held[begin] or held[end - 1] != held[min(end, held.size - 1)]
        hidden = turned and np.ptp(position[begin:end]) <= band
        found[begin:end] = way[begin:end] if hidden else np.where(certain[begin:end], 0.0, held[begin:end])
    return found


def _runs(rows: NDArray[np.bool_]) -> list[Stretch]:
    """Return first row and end of each stretch of rows."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _give_direction(rows: Rows, band: float, least: float) -> None:
    """Set the direction: that of the last motion; of a drive 0 at rest, where friction may point either way.

    Slower than ``least`` the sign of a velocity is noise, and within a ``band`` the position says nothing.
    """
    if rows.direction is not None:
        rows.held_direction = rows.direction
    elif rows.held_direction is not None:
        rows.direction = rows.held_direction
        if rows.of_drive and rows.velocity is not None:
            # where the axis stops or starts suddenly a low pass overshoots: its sign is none of the motion's
            doubt = 0.0 if rows.smoothed_off is None else rows.smoothed_off
            certain = np.abs(rows.velocity) > np.maximum(max(_velocity_noise(rows, rows.velocity), least), doubt)
            band = band if rows.smoothed_off is None else np.inf  # a velocity column need not agree with the position
            way = np.where(np.abs(rows.velocity) > doubt, np.sign(rows.velocity), 0.0)
            rows.direction = _turning(rows.held_direction, way, certain, rows.position, band)
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
