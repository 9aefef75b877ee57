"""What effects with an unknown period share: the scan over frequencies, families of harmonics, the refit's bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rtec.effects._harmonics import WavesShape
from rtec.effects.conditions import Conditions, Floats, scheduled
from rtec.effects.frequency_grid import (
    FEWEST_CYCLES,
    FEWEST_PLACES,
    FEWEST_STATED,
    frequencies,
    looks_constant,
    phases_seen,
    resolved_limit,
    stated_base,
    stated_periods,
)
from rtec.effects.protocol import Effect, Shape, Tunable, own_shape

MOST_HARMONICS = 8
WAVES_A_TARGET = 0.4
"""Amplitudes of a family, at most, for each target: more of them follow anything."""
MOST_UNSTATED = 4
"""Harmonics of an unstated period: more of them fit anything that comes back a few times."""
REFIT = 0.3
"""How far a refit may move the frequency, in units of 1 / span: past the neighbours on the grid."""
ANCHOR = 32
"""Frequencies from one exact sine to the next: those between are these, turned on by the angles of as many steps."""
UNIFORM = 1e-9
"""Frequencies that deviate by less, in cycles over the positions, are equally spaced."""


class Periodic(Effect):
    """Base of the effects that are periodic in position with a period that has to be found."""

    shape_type: type[WavesShape] = WavesShape
    is_wave = True

    def untestable(self, conditions: Conditions) -> str | None:
        if frequencies(conditions).size or stated_periods(conditions).size:
            return None
        if (why := scheduled(conditions)) is not None:
            return why
        found = conditions.places.size
        if found < FEWEST_PLACES:
            return f"{found} position{'s' if found > 1 else ''} only: at least {FEWEST_PLACES} needed"
        return "no period between the sampling's limit and the span"

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        """Return the period, free by a little more than the spacing of the scan.

        Beyond the end of the scan, too: there the true one may lie, and then it is doubtful.
        """
        period = _waves(shape).period
        room = REFIT * period**2 / conditions.span
        if conditions.revolution is not None and stated_base(conditions, period) is not None:
            return ()  # a turn is a turn
        return (Tunable("period", period - room, period + room),)

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        """Return the number of stated periods for one of them, else that of all periods of the scan."""
        if stated_base(conditions, _waves(shape).period) is not None:
            return float(max(stated_periods(conditions).size, 1))
        return float(max(frequencies(conditions).size, 1)) * MOST_UNSTATED

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        """Return the columns of several shapes, shape (shapes, amplitudes, rows); single waves by the stretch."""
        if not all(_waves(shape).is_one_wave for shape in shapes):
            return super().scan(conditions, shapes)
        waves = np.empty((len(shapes), 2, conditions.rows))
        fill(np.array([1.0 / _waves(shape).period for shape in shapes]), conditions.position, waves)
        return waves


def _waves(shape: Shape) -> WavesShape:
    return own_shape(shape, WavesShape)


def fill(wanted: Floats, position: Floats, out: Floats) -> None:
    """Fill ``out`` (frequencies, 2, rows) with the waves of ``wanted``, an equally spaced stretch at a time."""
    reach = float(np.max(np.abs(position), initial=0.0))
    begin = 0
    while begin < wanted.size:
        end = _uniform_end(wanted, begin, reach)
        step = (wanted[end - 1] - wanted[begin]) / max(end - 1 - begin, 1)
        turns = _waves_of(step * np.arange(min(ANCHOR, end - begin)), position)
        for k in range(begin, end, ANCHOR):
            some = out[k : min(k + ANCHOR, end)]
            waves = turns[: some.shape[0]] * _waves_of(wanted[begin] + (k - begin) * step, position)
            some[:, 0], some[:, 1] = waves.imag, waves.real
        begin = end


def _waves_of(frequency: Floats | float, position: Floats) -> NDArray[np.complex128]:
    angle = 2.0 * np.pi * np.multiply.outer(frequency, position)
    return np.cos(angle) + 1j * np.sin(angle)


def _uniform_end(wanted: Floats, begin: int, reach: float) -> int:
    """Return where the equally spaced stretch that begins at ``begin`` ends."""
    jumps = np.abs(np.diff(wanted[begin:], n=2)) * max(reach, 1.0) > UNIFORM
    return begin + 2 + int(np.argmax(jumps)) if jumps.any() else wanted.size


def families(
    conditions: Conditions, frequency: float, parts: Sequence[int], most: int = MOST_HARMONICS
) -> list[tuple[float, int]]:
    """Return (fundamental frequency, harmonics) of families that have ``frequency`` as a harmonic, simplest first.

    Parameters
    ----------
    conditions
        Of the readings: harmonics that alias are left out, but for those of a whole pitch or turn of which none looks
        like another; so are all from one on that is mainly a constant, and fundamentals that the span does not
        hold often enough: five times, or once where the period is stated.
    frequency
        Of the strongest line, in cycles per position unit.
    parts
        Which harmonic that line may be.
    most
        Harmonics of a family.
    """
    top = resolved_limit(conditions) * (1.0 + 1e-9)
    most = max(1, min(most, int(WAVES_A_TARGET * conditions.places.size) // 2))
    found = []
    whole = conditions.revolution is not None and stated_base(conditions, 1.0 / frequency) is not None
    for part in parts:
        if part > MOST_UNSTATED and stated_base(conditions, part / frequency) is None:
            continue
        base = frequency / part
        stated = stated_base(conditions, 1.0 / base)
        if stated is not None:
            base = 1.0 / stated
        elif whole:  # of whole cycles a turn the fundamental goes round in whole cycles, too
            continue
        if base < (FEWEST_STATED if stated is not None else FEWEST_CYCLES if part > 1 else 0.0) / conditions.span:
            continue
        for count in range(part, (most if stated is not None else min(most, MOST_UNSTATED)) + 1):
            aliases = count * base > top and not _aliases_alone(conditions, stated, count)
            if count > 1 and (aliases or looks_constant(conditions, count * base)):
                break
            found.append((base, count))
    return found


def _aliases_alone(conditions: Conditions, stated: float | None, harmonics: int) -> bool:
    """Return whether waves beyond the sampling's limit look like none of their family's others.

    Of a fraction of a pitch they look like waves of the whole pitch, which are the simpler ones.
    """
    if stated is None or stated not in (conditions.screw_pitch, conditions.revolution):
        return False
    return phases_seen(conditions.places, stated) > 2 * harmonics
