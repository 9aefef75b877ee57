"""What speaks against the name of a wave, and which families of harmonics may be one cause."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.effects import Conditions, CyclicShape, Effect, Floats, Shape, WavesShape
from rtec.effects._harmonics import harmonic_columns
from rtec.effects._periodic import REFIT, UNIFORM
from rtec.effects.frequency_grid import (
    FEWEST_CYCLES,
    NEAR_TWO,
    SAME_PERIOD,
    SPACING,
    alias_limit,
    frequencies,
    is_uneven,
    stated_base,
)
from rtec.effects.protocol import own_shape

LEAST_FUNDAMENTAL, LEAST_OF_PART = 0.5, 0.15
"""Of the strongest harmonic: a family with a weaker first wave is one of a fraction of its period, and another. Less
is asked of a whole fraction of a stated turn or pitch: what comes seven times a turn is likely to have harmonics."""
EDGE = 0.02
"""Cycles from the end of the scan within which the true period may as well lie beyond."""
FEWEST_SUSPECTED = 1.5
"""Cycles over the span: less of a wave is a bend."""
CYCLES_APART = 1.5
"""Over the span, between two waves: nearer ones are how one wave of a changing amplitude looks."""
CONSTANT, UNEVEN_FROM = 0.8, 2.0
"""Share of a constant from which on waves that explain it are a backlash; of periods below so many steps."""
FEWEST_A_TURN = 3
"""Poles and slots that a motor has at least, together."""


def _waves(shape: Shape) -> WavesShape:
    return own_shape(shape, WavesShape)


def wave_doubt(conditions: Conditions, shape: Shape) -> str | None:
    """Return why the positions cannot bear out a wave of an unstated period."""
    period, unit = _waves(shape).period, conditions.position_unit
    if stated_base(conditions, period) is not None:
        return None
    cycles = conditions.span / period
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
        waves = harmonic_columns(conditions.places, period, _waves(shape).harmonics)
        constant = waves @ np.linalg.lstsq(waves, np.ones(len(waves)), rcond=None)[0]
        if constant.mean() > CONSTANT:
            return f"at these targets a period of {period:.4g} {unit} is mainly a constant: others would settle it"
    return None


def bends(form: type[WavesShape], conditions: Conditions) -> Sequence[Shape]:
    """Return waves that do not come back often enough to be told from a smooth curve."""
    if not frequencies(conditions).size:
        return ()
    few = np.arange(FEWEST_SUSPECTED, FEWEST_CYCLES, SPACING)
    return [form(conditions.span / cycles) for cycles in few]


def crowded_waves(conditions: Conditions, shape: Shape, others: Sequence[Shape], finest: float) -> str | None:
    """Return why a wave of an unstated period cannot be told from others, or a map."""
    own = _waves(shape)
    stated = stated_base(conditions, own.period)
    if own.period > finest and stated is None:
        return "the map beside it has nodes so close that it draws such a wave itself"
    lines, *theirs = (np.arange(1.0, w.harmonics + 1.0) / w.period for w in (own, *map(_waves, others)))
    if not theirs:
        return None
    if stated is not None:
        # one within the other, where the two could cancel each other, or next to the last of its harmonics
        near = min(np.abs([*(line[0] - _and_next(lines)), *(lines[0] - _and_next(line))]).min() for line in theirs)
        return "it belongs to the harmonics of another family" if near * conditions.span < REFIT else None
    if np.abs(lines[:, None] - np.concatenate(theirs)).min() * conditions.span >= CYCLES_APART:
        return None
    return "so near to another wave it may as well be one wave whose amplitude changes along the axis"


def _and_next(lines: Floats) -> Floats:
    """Return the lines of a family with one harmonic more."""
    return np.append(lines, lines[0] * (lines.size + 1))


def no_family(conditions: Conditions, shape: Shape, amplitudes: Floats) -> str | None:
    """Return why a family is none of its period; a whole turn or pitch may have any of its harmonics alone."""
    own = _waves(shape)
    waves = amplitudes[: own.waves] if isinstance(own, CyclicShape) else amplitudes  # a step says nothing of that
    harmonics, base = own.harmonics, stated_base(conditions, own.period)
    if harmonics < 2 or (base is not None and base in (conditions.revolution, conditions.screw_pitch)):
        return None
    size = np.hypot(waves[::2], waves[1::2])
    each = np.sqrt((size.reshape(-1, harmonics) ** 2).sum(axis=0))
    if each[0] >= (LEAST_FUNDAMENTAL if base is None else LEAST_OF_PART) * each.max():
        return None
    return "its first wave is weaker than its harmonics: a multiple of the true period"


def no_cogging(conditions: Conditions, shape: Shape, amplitudes: Floats) -> str | None:
    """Return why a fit is no cogging: magnets and teeth come many times a turn, a weight comes once."""
    turn = conditions.revolution
    if turn is not None and _waves(shape).period > turn / FEWEST_A_TURN * (1.0 + SAME_PERIOD):
        return "it comes once or twice a turn, as a weight does"
    return no_family(conditions, shape, amplitudes)


def no_eccentricity(conditions: Conditions, shape: Shape, amplitudes: Floats) -> str | None:
    """Return why a fit is no eccentricity: the wave that a disc off centre gives hardly takes part."""
    size = np.hypot(amplitudes[::2], amplitudes[1::2])
    if size[0] >= LEAST_FUNDAMENTAL * size.max():
        return None
    return "a disc off centre gives one wave a turn first, and two are stronger here"


def parts_of_family(effect: Effect, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
    """Return the families that hold a harmonic of one: it may have brought two periods together."""
    own = _waves(shape)
    lines = [type(own)(own.period / k) for k in range(1, own.harmonics + 1)]
    found = dict.fromkeys(_waves(v) for line in lines for v in effect.variants(conditions, line))
    return [
        other
        for other in found
        if other.harmonics <= own.harmonics
        and (abs(other.period / own.period - 1.0) > UNIFORM or other.harmonics < own.harmonics)
        and wave_doubt(conditions, other) is None
    ]


def family_of_turn(effect: Effect, conditions: Conditions, shape: Shape, other: Shape) -> Sequence[Shape]:
    """Return the families of a whole pitch or turn that hold the first waves of two fractions of it."""
    lines = [_line_of_turn(conditions, one) for one in (shape, other)]
    if lines[0] is None or lines[1] is None or lines[0][0] != lines[1][0]:
        return ()
    whole, part = lines[0][0], max(lines[0][1], lines[1][1])
    families = map(_waves, effect.variants(conditions, type(_waves(shape))(whole)))
    return [v for v in families if v.period == whole and v.harmonics >= part]


def _line_of_turn(conditions: Conditions, shape: Shape) -> tuple[float, int] | None:
    """Return the whole pitch or turn of which a shape's period is a fraction, and which fraction; None of neither."""
    base = stated_base(conditions, _waves(shape).period)
    for whole in (conditions.revolution, conditions.screw_pitch):
        if base is not None and whole is not None and stated_base(conditions, whole / round(whole / base)) == base:
            return whole, round(whole / base)
    return None
