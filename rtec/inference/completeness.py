"""Signs that a model is not complete: what is left is no noise, or what was found only resembles its name."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from scipy.special import fdtrc

from rtec.effects import Floats, Shape, WavesShape
from rtec.effects.protocol import own_shape
from rtec.inference.leftover import OF_EXPLAINED_IN_MOTION
from rtec.inference.proposals import orthonormal
from rtec.inference.results import NoiseFloor, Unknown
from rtec.inference.scored import Judge, Scored

if TYPE_CHECKING:
    from rtec.inference.search import Search

REACHED, ENOUGH = 1.3, 10
"""Noise floors that a complete model may leave, and the degrees of freedom from which on a floor is known so well."""
LAGS, CORRELATED, BY_CHANCE = (2, 3, 4), 0.2, 3.0
"""A residual is strongly coloured where its mean correlation over these lags, in readings, is so large, and so many
standard errors of white noise. A low pass before a log was thinned out correlates neighbours alone."""
CURVE = 6
"""Degree of the curves that a residual is compared with."""
TREND, MATERIAL = 0.0025, 0.03
"""Probability below which a curve is no chance, and the least share of the residual's square that it explains."""
ROUNDING = 1e-6
"""Share of the readings' spread: less is no residual."""
MOST_RUNS = 60
APART = 3.0
"""Cycles over the whole axis by which two waves differ at least: closer ones are a beat, a wave in one part of it."""
OF_A_TURN = 0.02
"""Cycles by which waves of a turn may be off a whole number of them: these are harmonics, however close."""
OUTSIDE, OUTSIDE_WITH_SIGNS = 0.04, 0.5
"""Chance that a name stands for physics outside the library: docs/diagnosis.md has the table it was read off."""


@dataclass(frozen=True, slots=True)
class Sign:
    """A sign that something outside the library acts: what it depends on, and what is seen."""

    depends_on: str
    text: str


def is_coloured(judge: Judge, model: Scored) -> bool:
    """Return whether what a model leaves is strongly correlated from reading to reading."""
    left, chain = judge.left(model), np.cumsum(np.isinf(judge.space.gap))
    left = left - left.mean()
    if float(left @ left) <= ROUNDING**2 * float(judge.space.dataset.observed @ judge.space.dataset.observed):
        return False
    together = [
        float((left[lag:] * left[:-lag])[chain[lag:] == chain[:-lag]].sum()) for lag in LAGS if lag < left.size
    ]
    mean = sum(together) / len(LAGS) / max(float(left @ left), 1e-300)
    return mean > max(CORRELATED, BY_CHANCE / float(np.sqrt(len(LAGS) * left.size)))


def knows_the_floor(judge: Judge, model: Scored, floor: NoiseFloor) -> bool:
    """Return whether repeats tell the noise well, so that a residual can be judged by it."""
    return floor.from_repeats and floor.degrees_of_freedom >= ENOUGH and not is_coloured(judge, model)


def unknown_by(signs: Sequence[Sign]) -> Unknown:
    """Return what the signs say of the structure that is left."""
    depends = tuple(dict.fromkeys(sign.depends_on for sign in signs))
    text = "; ".join(sign.text for sign in signs)
    return Unknown(
        depends_on=depends, period=None, frequency_hz=None, description=f"something outside the library acts: {text}"
    )


def leaves_a_hair(search: Search, model: Scored) -> bool:
    """Return whether what a model leaves is a hair of what it explains, which speaks against nothing."""
    left = float(np.sqrt(np.mean(search.judge.left(model) ** 2)))
    hair = OF_EXPLAINED_IN_MOTION if _in_time(search) else ROUNDING
    return left <= hair * float(np.std(search.judge.fit(model).effects()))


def _in_time(search: Search) -> bool:
    c = search.space.dataset.coordinates
    return c.moving or c.time_is_coordinate


def floor_missed(search: Search, model: Scored, floor: NoiseFloor, approximate: Sequence[str]) -> list[Sign]:
    """Return the sign that a model leaves more than a noise floor that is known well."""
    left = float(np.sqrt(np.mean(search.judge.left(model) ** 2)))
    # noise that wanders differs more between runs than the repeats that are left when its course is taken off
    if knows_the_floor(search.judge, model, floor) and left > REACHED * floor.sigma > 0.0:
        return [Sign("time", f"the residual is {left / floor.sigma:.1f} times the noise floor")]
    return []


def coloured(search: Search, model: Scored, floor: NoiseFloor, approximate: Sequence[str]) -> list[Sign]:
    """Return the sign that what is left of a log, or in time, is correlated."""
    if not _in_time(search) or not is_coloured(search.judge, model):
        return []
    return [Sign("time", f"the residual is correlated over about {model.colour.length:.0f} readings")]


def nearly_right(search: Search, model: Scored, floor: NoiseFloor, approximate: Sequence[str]) -> list[Sign]:
    """Return the signs that effects are approximate."""
    text = "what is there resembles {}, but does not quite have its form"
    return [Sign(search.space.dataset.library.named(name).over.value, text.format(name)) for name in approximate]


def trends(search: Search, model: Scored, floor: NoiseFloor, approximate: Sequence[str]) -> list[Sign]:
    """Return the curves that what is left, freed of its correlation, still follows."""
    judge = search.judge
    c = judge.space.dataset.coordinates
    left = judge.space.view(model.colour).project(judge.left(model)[None, :])[0]
    left = left - left.mean()
    in_time = _curve(np.arange(c.rows, dtype=np.float64))
    curves = {"time": ("time", in_time)}
    if not c.time_is_coordinate and c.span > 0.0:
        curves["position"] = "position", _curve(c.position)
    if c.direction is not None and c.both_directions:
        curves["direction"] = "direction", _each_way(c.position, c.direction)
        if not c.moving and c.since_reversal is not None:
            # where targets come in any order, an error that follows these two is no curve over position
            follows = (np.diff(c.order, prepend=np.inf) == 1.0) & (np.diff(c.run, prepend=c.run[0]) == 0)
            moved = np.where(follows, np.abs(np.diff(c.position, prepend=c.position[0])), 0.0)
            for name, way in (("way since the reversal", c.since_reversal), ("length of the last move", moved)):
                by_rank = np.unique(way, return_inverse=True)[1].astype(np.float64)
                curves[f"the {name}"] = "direction", np.hstack([_curve(by_rank), _each_way(by_rank, c.direction)])
    runs = np.unique(c.run)
    if 1 < runs.size <= MOST_RUNS:
        curves["run"] = "run", (c.run[:, None] == runs[1:]).astype(np.float64)
    spent = sum(part.raw.shape[0] for part in judge.space.parts_of(model.choices))
    found = []
    for name, (depends_on, table) in curves.items():
        basis = orthonormal((table - table.mean(axis=0)).T)
        explained, whole = float(((basis @ left) ** 2).sum()), float(left @ left)
        k, below = len(basis), left.size - 1 - len(basis) - spent
        if k == 0 or below <= 0 or whole <= 0.0 or explained < MATERIAL * whole:
            continue
        p = float(fdtrc(k, below, (explained / k) / max((whole - explained) / below, 1e-300)))
        if p < TREND:
            found.append(Sign(depends_on, f"the residual follows a smooth curve over {name} (p {p:.1g})"))
    return found


def _curve(values: Floats) -> Floats:
    """Return smooth curves over values, shape (rows, curves); the constant is not among them."""
    reach = float(np.ptp(values))
    return (
        chebvander(2.0 * (values - values.min()) / reach - 1.0, CURVE)[:, 1:]
        if reach > 0.0
        else np.zeros((values.size, 1))
    )


def _each_way(values: Floats, direction: Floats) -> Floats:
    """Return the direction and smooth curves over values in each, shape (rows, curves)."""
    way = np.sign(direction)[:, None]
    return np.hstack([way, _curve(values) * way])


def beats(search: Search, model: Scored, floor: NoiseFloor, approximate: Sequence[str]) -> list[Sign]:
    """Return the waves found that are too close to each other to be two."""
    c = search.space.dataset.conditions
    waves = [_frequencies(s) for e, s in model.choices if e.is_wave and (e, s) not in search.given]
    for mine, theirs in itertools.combinations(waves, 2):
        turns = np.concatenate([mine, theirs]) * (c.revolution or 0.0)
        of_a_turn = c.revolution is not None and float(np.abs(turns - np.round(turns)).max()) < OF_A_TURN
        if not of_a_turn and float(np.abs(mine[:, None] - theirs).min()) * c.span < APART:
            periods = f"{1.0 / mine[0]:.4g} and {1.0 / theirs[0]:.4g} {c.position_unit}"
            return [Sign("position", f"waves of {periods} are a beat, one wave that changes along the axis")]
    return []


def _frequencies(shape: Shape) -> Floats:
    """Return the frequencies of a family of waves, shape (harmonics,)."""
    own = own_shape(shape, WavesShape)
    return np.arange(1, own.harmonics + 1) / own.period
