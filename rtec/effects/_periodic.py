"""What effects with an unknown period share: the scan over frequencies, families of harmonics, the refit's bounds."""

from __future__ import annotations

import abc
from collections.abc import Sequence

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.frequency_grid import (
    ENOUGH_PHASES,
    FEWEST_CYCLES,
    FEWEST_PLACES,
    NEARLY,
    frequencies,
    highest_frequency,
    phases_seen,
    resolved_harmonics,
    resolved_limit,
)
from rtec.effects.protocol import Effect, Shape, Tunable

MOST_HARMONICS = 8
FAMILIES = 6
"""The strongest line may be the first to the sixth harmonic of its family."""
REFIT = 0.3
"""How far a refit may move the frequency, in units of 1 / span: past the neighbours on the grid."""
SAME_PERIOD = 0.01
"""Share by which a period found may differ from the stated one and still be it."""
UNIFORM = 1e-9
"""Frequencies that deviate by less, in cycles over the positions, are equally spaced."""


class Periodic(Effect):
    """Base of the effects that are periodic in position with a period that has to be found."""

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why no period can be seen, or None."""
        if frequencies(conditions).size:
            return None
        found = conditions.places.size
        if found < FEWEST_PLACES:
            return f"{found} position{'s' if found > 1 else ''} only: at least {FEWEST_PLACES} needed"
        return "no period between the sampling's limit and the span"

    def highest_frequency(self, conditions: Conditions) -> float:
        """Return the top of the scan, in cycles per position unit; see :func:`highest_frequency`."""
        return highest_frequency(conditions)

    def resolved_harmonics(self, conditions: Conditions, period: float) -> int:
        """Return up to which harmonic of a period the places resolve; see :func:`resolved_harmonics`."""
        return resolved_harmonics(conditions, period)

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        """Return the period, free by a little more than the spacing of the scan, as long as the span holds enough."""
        period = period_of(shape)
        room = REFIT * period**2 / conditions.span
        longest = conditions.span / (NEARLY * FEWEST_CYCLES)
        return (Tunable("period", period - room, max(period, min(period + room, longest))),)

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        """Return the columns of several shapes, shape (shapes, amplitudes, rows); single waves by compiled code."""
        if any(self._more_than_one_wave(shape) for shape in shapes):
            return super().scan(conditions, shapes)
        waves = np.empty((len(shapes), 2, conditions.rows))
        fill(np.array([1.0 / period_of(shape) for shape in shapes]), conditions.position, waves)
        return waves

    @abc.abstractmethod
    def _more_than_one_wave(self, shape: Shape) -> bool:
        """Return whether a shape has harmonics or depends on the direction."""


def period_of(shape: Shape) -> float:
    """Return the period of a shape that has one."""
    period: float = getattr(shape, "period")  # noqa: B009 - shapes of several effects have it, their base has not
    return period


def fill(wanted: Floats, position: Floats, out: Floats) -> None:
    """Fill ``out`` (frequencies, 2, rows) with the waves of ``wanted``, an equally spaced stretch at a time."""
    from rtec.effects._periodic_kernels import fill_waves  # noqa: PLC0415 - numba takes 0.3 s, for scans only

    reach = float(np.max(np.abs(position), initial=0.0))
    place = np.ascontiguousarray(position)
    begin = 0
    while begin < wanted.size:
        end = _uniform_end(wanted, begin, reach)
        step = (wanted[end - 1] - wanted[begin]) / max(end - 1 - begin, 1)
        fill_waves(float(wanted[begin]), float(step), place, out[begin:end])
        begin = end


def _uniform_end(wanted: Floats, begin: int, reach: float) -> int:
    """Return where the equally spaced stretch that begins at ``begin`` ends."""
    jumps = np.abs(np.diff(wanted[begin:], n=2)) * max(reach, 1.0) > UNIFORM
    return begin + 2 + int(np.argmax(jumps)) if jumps.any() else wanted.size


def families(
    conditions: Conditions, frequency: float, parts: Sequence[int], most: int = MOST_HARMONICS
) -> list[tuple[float, int]]:
    """Return (fundamental frequency, harmonics) of each family that has ``frequency`` among its harmonics.

    Parameters
    ----------
    conditions
        Of the readings: harmonics that alias are left out, and fundamentals that the span does not hold twice.
    frequency
        Of the strongest line, in cycles per position unit.
    parts
        Which harmonic that line may be.
    most
        Harmonics of a family.

    Returns
    -------
    list of tuple
        The simplest first.
    """
    top = max(resolved_limit(conditions), frequency) * (1.0 + 1e-9)
    found = []
    for part in parts:
        base = frequency / part
        if part > 1 and base < NEARLY * FEWEST_CYCLES / conditions.span:
            continue
        found += [
            (base, count)
            for count in range(part, most + 1)
            if count * base <= top or _stated(conditions, base, count)
        ]
    return found


def _stated(conditions: Conditions, base: float, count: int) -> bool:
    """Return whether a harmonic is one of the stated screw pitch, and shows at enough phases, fast as it is."""
    pitch = conditions.screw_pitch
    if pitch is None or abs(base * pitch - 1.0) > SAME_PERIOD:
        return False
    return all(phases_seen(conditions.places, pitch / k) >= ENOUGH_PHASES for k in range(1, count + 1))
