"""What effects with an unknown period share: the scan over frequencies, families of harmonics, the refit's bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rtec.effects._harmonics import WavesShape, harmonic_columns
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.frequency_grid import (
    FEWEST_CYCLES,
    FEWEST_PLACES,
    FEWEST_STATED,
    NEAR_TWO,
    SPACING,
    alias_limit,
    frequencies,
    is_uneven,
    looks_constant,
    phases_seen,
    resolved_limit,
    stated_base,
    stated_periods,
)
from rtec.effects.protocol import Effect, Shape, Tunable, own_shape

MOST_HARMONICS = 8
LEAST_FUNDAMENTAL, LEAST_OF_PART = 0.5, 0.15
"""Of the strongest harmonic: a family with a weaker first wave is one of a fraction of its period, and another. Less
is asked of a whole fraction of a stated turn or pitch: what comes seven times a turn is likely to have harmonics."""
EDGE = 0.02
"""Cycles from the end of the scan within which the true period may as well lie beyond."""
WAVES_A_TARGET = 0.4
"""Amplitudes of a family, at most, for each target: more of them follow anything."""
MOST_UNSTATED = 4
"""Harmonics of an unstated period: more of them fit anything that comes back a few times."""
FEWEST_SUSPECTED = 1.5
"""Cycles over the span: less of a wave is a bend."""
CYCLES_APART = 1.5
"""Over the span, between two waves: nearer ones are how one wave of a changing amplitude looks."""
CONSTANT, UNEVEN_FROM = 0.8, 2.0
"""Share of a constant from which on waves that explain it are a backlash; of periods below so many steps."""
REFIT = 0.3
"""How far a refit may move the frequency, in units of 1 / span: past the neighbours on the grid."""
ANCHOR = 32
"""Frequencies from one exact sine to the next: those between are these, turned on by the angles of as many steps."""
UNIFORM = 1e-9
"""Frequencies that deviate by less, in cycles over the positions, are equally spaced."""


class Periodic(Effect):
    """Base of the effects that are periodic in position with a period that has to be found."""

    shape_type: ClassVar[type[WavesShape]] = WavesShape
    is_wave = True

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why no period can be seen, or None."""
        if frequencies(conditions).size or stated_periods(conditions).size:
            return None
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

    def doubtful(self, conditions: Conditions, shape: Shape) -> str | None:
        """Return why the positions cannot bear out an unstated period, or None."""
        return wave_doubt(conditions, _waves(shape).period, _waves(shape).harmonics)

    def suspects(self, conditions: Conditions) -> Sequence[Shape]:
        """Return waves that do not come back often enough to be told from a smooth curve."""
        if not frequencies(conditions).size:
            return ()
        few = np.arange(FEWEST_SUSPECTED, FEWEST_CYCLES, SPACING)
        return [self.shape_type(conditions.span / cycles) for cycles in few]

    def crowded(
        self, conditions: Conditions, shape: Shape, others: Sequence[Shape], finest: float = np.inf
    ) -> str | None:
        """Return why a wave of an unstated period cannot stand beside others, or a map: they cannot be told apart."""
        own = _waves(shape)
        stated = stated_base(conditions, own.period)
        if own.period > finest and stated is None:
            return "the map beside it has nodes so close that it draws such a wave itself"
        lines, *theirs = (np.arange(1.0, w.harmonics + 1.0) / w.period for w in (own, *map(_waves, others)))
        if not theirs:
            return None
        if stated is not None:
            # one within the other, where the two could cancel each other, or next to the last of its harmonics
            near = min(
                np.abs([*(line[0] - _and_next(lines)), *(lines[0] - _and_next(line))]).min() for line in theirs
            )
            return "it belongs to the harmonics of another family" if near * conditions.span < REFIT else None
        if np.abs(lines[:, None] - np.concatenate(theirs)).min() * conditions.span >= CYCLES_APART:
            return None
        return "so near to another wave it may as well be one wave whose amplitude changes along the axis"

    def implausible(self, conditions: Conditions, shape: Shape, amplitudes: Floats) -> str | None:
        """Return why a family is none of its period: its first wave hardly takes part.

        A whole turn or pitch may have any of its harmonics alone.
        """
        size = np.hypot(amplitudes[::2], amplitudes[1::2])
        own = _waves(shape)
        harmonics, base = own.harmonics, stated_base(conditions, own.period)
        if harmonics < 2 or (base is not None and base in (conditions.revolution, conditions.screw_pitch)):
            return None
        each = np.sqrt((size.reshape(-1, harmonics) ** 2).sum(axis=0))
        if each[0] >= (LEAST_FUNDAMENTAL if base is None else LEAST_OF_PART) * each.max():
            return None
        return "its first wave is weaker than its harmonics: a multiple of the true period"

    def regrouped(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return the families that hold a harmonic of this one: it may have brought two periods together."""
        form, own = self.shape_type, _waves(shape)
        lines = [form(own.period / k) for k in range(1, own.harmonics + 1)]
        found = dict.fromkeys(_waves(v) for line in lines for v in self.variants(conditions, line))
        return [
            other
            for other in found
            if other.harmonics <= own.harmonics
            and (abs(other.period / own.period - 1.0) > UNIFORM or other.harmonics < own.harmonics)
            and self.doubtful(conditions, other) is None
        ]

    def joined(self, conditions: Conditions, shape: Shape, other: Shape) -> Sequence[Shape]:
        """Return the families of a whole pitch or turn that hold the first waves of two fractions of it."""
        lines = [_line_of_turn(conditions, one) for one in (shape, other)]
        if lines[0] is None or lines[1] is None or lines[0][0] != lines[1][0]:
            return ()
        whole, part = lines[0][0], max(lines[0][1], lines[1][1])
        families = map(_waves, self.variants(conditions, self.shape_type(whole)))
        return [v for v in families if v.period == whole and v.harmonics >= part]

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        """Return the columns of several shapes, shape (shapes, amplitudes, rows); single waves by the stretch."""
        if not all(_waves(shape).is_one_wave for shape in shapes):
            return super().scan(conditions, shapes)
        waves = np.empty((len(shapes), 2, conditions.rows))
        fill(np.array([1.0 / _waves(shape).period for shape in shapes]), conditions.position, waves)
        return waves


def _waves(shape: Shape) -> WavesShape:
    return own_shape(shape, WavesShape)


def _line_of_turn(conditions: Conditions, shape: Shape) -> tuple[float, int] | None:
    """Return the whole pitch or turn of which a shape's period is a fraction, and which fraction; None of neither."""
    base = stated_base(conditions, _waves(shape).period)
    for whole in (conditions.revolution, conditions.screw_pitch):
        if base is not None and whole is not None and stated_base(conditions, whole / round(whole / base)) == base:
            return whole, round(whole / base)
    return None


def _and_next(lines: Floats) -> Floats:
    """Return the lines of a family with one harmonic more."""
    return np.append(lines, lines[0] * (lines.size + 1))


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


def wave_doubt(conditions: Conditions, period: float, harmonics: int = 1) -> str | None:
    """Return why the positions cannot bear out a wave of an unstated period; None where they can."""
    if stated_base(conditions, period) is not None:
        return None
    cycles, unit = conditions.span / period, conditions.position_unit
    if cycles < FEWEST_CYCLES + EDGE:
        return (
            f"{cycles:.1f} cycles of {period:.4g} {unit} only, and the period is not stated: a span of "
            f"{FEWEST_CYCLES * period:.4g} {unit} would settle it"
        )
    if 1.0 / period > NEAR_TWO * alias_limit(conditions) * (1.0 + 1e-9):
        return (
            f"a period of {period:.4g} {unit} is two readings long, and it is not stated: targets "
            "twice as dense would settle it"
        )
    if period < UNEVEN_FROM * conditions.span / conditions.places.size and is_uneven(conditions):
        waves = harmonic_columns(conditions.places, period, harmonics)
        constant = waves @ np.linalg.lstsq(waves, np.ones(len(waves)), rcond=None)[0]
        if constant.mean() > CONSTANT:
            return f"at these targets a period of {period:.4g} {unit} is mainly a constant: others would settle it"
    return None
