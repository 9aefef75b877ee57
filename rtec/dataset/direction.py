"""Which way an axis goes in a log, also while it stands still.

The sign of a noisy velocity says nothing at rest: the axis goes the way that it went last.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.dataset.rows import Rows
from rtec.dataset.standstill import Ints, band_of, noise_of, starts_of_groups, stretches_of, stretches_where
from rtec.effects.conditions import Floats

_TURNED = 1e-5  # share of the span that an axis has to go back to have turned
_WIDER = 4.0  # factor between the dead zones that are tried
_AT_REST = 1e-3  # share of the largest speed below which an axis is at rest, where only a velocity tells
_SIGMAS = 4.0  # of the noise of a velocity: what is larger is motion


def _turns(position: Floats, least: float) -> tuple[list[int], int]:
    """Return the rows at which an axis turned by more than ``least``, the last peak, and its first way."""
    way, peak, row, first, found = 0, float(position[0]), 0, 0, []
    for at, x in enumerate(position.tolist()):
        if (way >= 0 and x < peak - least) or (way <= 0 and x > peak + least):
            found += [row] if way else []
            way = -way or (1 if x > peak else -1)
            first, peak, row = first or way, x, at
        elif (x - peak) * way >= 0.0:
            peak, row = (x if way else peak), at
    return [*found, row], first


def last_direction(position: Floats, run: Ints, least: float | None = None) -> Floats:
    """Return the direction of the last motion at each row of a log, +1 or −1, also while the axis is at rest.

    Before the first motion of a run it is the direction of that, 0 in a run without motion. To have turned, the axis
    goes back by more than ``least``, 1e-5 of the span of all positions where it is None: less is rounding.
    """
    direction = np.zeros(position.size)
    least = _TURNED * float(np.ptp(position)) if least is None else least
    for begin, end in stretches_of(None, run):
        rows, way = _turns(position[begin:end], least)
        direction[begin:end] = way * (-1.0) ** np.searchsorted(rows[:-1], np.arange(end - begin))
    return direction


def dead_zone(position: Floats, run: Ints, least: float) -> float:
    """Return how far an axis has to go back to have turned: the smallest that could be larger without losing a turn.

    Noise makes turns of every small size, an axis makes turns of the sizes that its program has. So the dead zone
    grows from ``least`` in factors of 4 until a zone 4 times wider still finds every turn. Where there is no such
    gap between small and large turns, it is ``least``.
    """
    if least <= 0.0:
        return least
    peaks, width = [position[begin:end] for begin, end in stretches_of(None, run)], least
    while True:
        fewer = [x[[0, *_turns(x, width)[0]]] for x in peaks]
        if width > least and sum(map(len, fewer)) == sum(map(len, peaks)):
            return width / _WIDER
        if width * _WIDER >= np.ptp(position) / 2.0:
            return least
        peaks, width = fewer, width * _WIDER


def with_last_direction(log: Rows) -> Rows:
    """Take the direction of the last motion at each row of a log, before any filter: ringing looks like turning."""
    if log.coordinate == "time" or np.ptp(log.position) == 0.0:
        return log
    least = dead_zone(log.position, log.run, band_of(log.position, log.run)) if log.of_drive else None
    return replace(log, held_direction=last_direction(log.position, log.run, least))


def with_direction(log: Rows, band: float, least: float) -> Rows:
    """Take the direction: that of the last motion; of a drive 0 at rest, where friction may point either way.

    Slower than ``least`` the sign of a velocity is noise, and within a ``band`` the position says nothing.
    """
    if log.direction is not None:
        return replace(log, held_direction=log.direction)
    direction, velocity = log.held_direction, log.velocity
    if direction is not None:
        if log.of_drive and velocity is not None:
            direction = _turning(log, direction, velocity, band, least)
        if log.of_drive and log.rest is not None:
            direction = _at_rest_between(direction, log.rest)
        note = "no direction column: the direction is the sign of the motion" + ", 0 at rest" * log.of_drive
    elif velocity is not None and (fastest := float(np.abs(velocity).max())) > 0.0:
        least = max(_AT_REST * fastest, min(_velocity_noise(log, velocity), fastest / 10.0))
        direction = np.where(np.abs(velocity) < least, 0.0, np.sign(velocity))
        note = f"no direction column: the direction is the sign of the velocity, 0 below {least:.3g}"
    else:
        return log
    return replace(log, direction=direction, notes=(note, *log.notes))


def _velocity_noise(log: Rows, velocity: Floats) -> float:
    """Return the speed up to which a velocity column may be noise: four standard deviations, at standstill if any."""
    still = np.empty(0) if log.rest is None else np.abs(velocity[log.rest >= 0])
    return _SIGMAS * (1.4826 * float(np.median(still)) if still.size else noise_of(velocity, log.run))


def _turning(log: Rows, held: Floats, velocity: Floats, band: float, least: float) -> Floats:
    """Return the direction of the last motion, corrected by the sign of the velocity; shape (rows,).

    Where the axis turned, within the ``band`` that hides it, the velocity knows best when. Where it is certain
    elsewhere, the axis goes back by less than it takes to have turned: friction need not have turned either, and the
    direction is 0.
    """
    # where the axis stops or starts suddenly a low pass overshoots: its sign is none of the motion's
    doubt = 0.0 if log.smoothed_off is None else log.smoothed_off
    certain = np.abs(velocity) > np.maximum(max(_velocity_noise(log, velocity), least), doubt)
    band = band if log.smoothed_off is None else np.inf  # a velocity column need not agree with the position
    way = np.where(np.abs(velocity) > doubt, np.sign(velocity), 0.0)
    found = held.copy()
    for begin, end in stretches_where(way * held < 0.0):
        turned = held[max(begin - 1, 0)] != held[begin] or held[end - 1] != held[min(end, held.size - 1)]
        hidden = turned and np.ptp(log.position[begin:end]) <= band
        found[begin:end] = way[begin:end] if hidden else np.where(certain[begin:end], 0.0, held[begin:end])
    return found


def _at_rest_between(direction: Floats, rest: Ints) -> Floats:
    """Return the direction with 0 in each standstill between motions in different directions, shape (rows,).

    There friction may point either way; where the axis goes on as it came, it does not let go meanwhile.
    """
    starts, around = starts_of_groups(rest), np.concatenate(([0.0], direction, [0.0]))
    sizes = np.diff(np.append(starts, rest.size))
    before, after = around[starts], around[starts + sizes + 1]
    return np.where(rest >= 0, np.repeat(np.where(before == after, before, 0.0), sizes), direction)
