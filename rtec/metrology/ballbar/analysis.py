"""Which errors a circle test shows: one joint least-squares fit of named shapes to both senses.

All shapes without a parameter are fitted together; what is left is searched for spikes, cyclic errors and vibration,
one after the other; then the shape that is least significant is taken out, until all that remain are significant. The
noise is that of the residual, robust against single readings and widened where neighbours are correlated.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from rtec.metrology.ballbar.circle_test import CircleTest, Floats
from rtec.metrology.ballbar.circularity import Circularity, circular_deviation, circularity
from rtec.metrology.ballbar.search import Design, best_shape, refined
from rtec.metrology.ballbar.shapes import (
    AXES,
    BY_SENSE,
    LATERAL,
    RADIUS,
    SCALING,
    SPIKE,
    Shape,
    nuisance,
    scale_of,
    static_shapes,
)
from rtec.metrology.ballbar.stick_slip import CHANCE, stick_slip
from rtec.metrology.ballbar.values import value_of

_CLASSES = 18.0
"""Errors that are looked for, by axis."""
_LEAST_SHARE = 0.05
"""Of the largest error: what is smaller may be what the shape of that one leaves."""
_LEAST_SIGMAS = 0.5
"""Of a point: what is smaller is not named, significant or not."""
_ONE_CAUSE = 9.0
"""By which chi-squared may rise, 3 sigma, where one cause stands for two."""
_MOST_SEARCHED, _MOST_ROUNDS = 8, 4
_OUTLIER_SIGMAS = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundError:
    """An error that a circle test shows."""

    name: str
    value: float
    unit: str
    uncertainty: float
    """One standard deviation, in the same unit."""
    alone_um: float
    """Circular deviation of both senses that it would show alone."""
    share: float
    """Of the sum of these over all errors."""
    details: Mapping[str, float]
    """More of its numbers by name and unit: ends of an axis, a period."""

    def document(self) -> dict[str, object]:
        """Return what ``rtec ballbar --json`` prints of it."""
        return {
            "name": self.name,
            "value": self.value,
            "unit": self.unit,
            "share": self.share,
            "uncertainty": self.uncertainty,
            "alone_um": self.alone_um,
            **self.details,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """What a circle test shows."""

    test: CircleTest
    figures: Circularity
    errors: tuple[FoundError, ...]
    """The largest first."""
    contributions_um: Mapping[str, Floats]
    """Radial deviation of each error at each point, shape (points,)."""
    residual_um: Floats
    """What is left, shape (points,)."""
    noise_um: float
    """Standard deviation of a point."""
    notes: tuple[str, ...]

    def document(self) -> dict[str, object]:
        """Return what ``rtec ballbar --json`` prints."""
        figures, test = self.figures, self.test
        return {
            "G": figures.largest_g,
            "G_ccw": figures.counter_clockwise,
            "G_cw": figures.clockwise,
            "G_b": figures.both,
            "D": figures.mean_radial,
            "F": max(figures.largest_radial, -figures.least_radial),
            "F_max": figures.largest_radial,
            "F_min": figures.least_radial,
            "unit": "um",
            "radius_mm": test.radius_mm,
            "feed_mm_s": test.feed_mm_s,
            "errors": [error.document() for error in self.errors],
            "centre_um": list(figures.centre),
            "diameter_x_um": figures.diameters[0],
            "diameter_y_um": figures.diameters[1],
            "squareness_by_diagonals_um_m": figures.diagonals,
            "noise_um": self.noise_um,
            "residual_rms_um": float(np.sqrt(np.mean(self.residual_um**2))),
            "points": test.angle_rad.size,
            "passes": int(test.number.max()) + 1,
            "notes": list(self.notes),
        }


@dataclass(slots=True, eq=False)
class _Fit:
    """Shapes in the fit with what they leave."""

    shapes: list[Shape]
    coefficients: list[Floats]
    inverse: list[Floats]
    """Of the normal equations, the block of each shape: times the variance of a point the covariance of numbers."""
    residual: Floats
    weights: Floats
    sigma: float
    correlated: float
    """By which variances are widened."""


def analysed(test: CircleTest) -> Found:
    """Return the errors that a circle test shows, and the figures of ISO 230-4.

    Examples
    --------
    >>> from rtec.metrology.ballbar import circle_test
    >>> way = np.arange(0.0, 360.0, 0.5)
    >>> noise = np.random.default_rng(1).normal(0.0, 0.3, 1440)
    >>> oval = np.tile(4.0 * np.sin(np.radians(2.0 * way)), 2) + noise
    >>> test = circle_test([*way, *way], oval, [1] * 720 + [-1] * 720, radius_mm=100.0)
    >>> [(error.name, round(error.value), error.unit, error.share) for error in analysed(test).errors]
    [('squareness', 80, 'um/m', 1.0)]
    """
    plays: dict[str, float] = {}
    for _ in range(_MOST_ROUNDS):
        fit = _eliminated(test, _searched(test, static_shapes(test, plays)))
        fit = _of_one_cause(test, _eliminated(test, _refined(test, fit)))
        seen = {axis: _play(test, fit, axis) for axis in AXES}
        settled = all(abs(seen[axis] - plays.get(axis, 0.0)) <= 0.02 * abs(seen[axis]) for axis in AXES)
        plays = seen
        if settled:
            break
    return _found(test, fit)


def _play(test: CircleTest, fit: _Fit, axis: str) -> float:
    """Return the play of an axis in um where it is crossed as a nut crosses it, 0 where there is none, or a step."""
    name = f"backlash {axis}"
    pairs = zip(fit.shapes, fit.coefficients, strict=True)
    play = next((float(numbers[0]) for shape, numbers in pairs if shape.name == name), 0.0)
    if play <= 0.0:
        return 0.0
    others = [shape for shape in fit.shapes if shape.name not in (name, f"reversal spike {axis}")]
    left = []
    for tried in (0.0, play):
        backlash = next(shape for shape in static_shapes(test, {axis: tried}) if shape.name == name)
        columns = np.column_stack([nuisance(test), *(shape.columns for shape in [*others, backlash])])
        left.append(float(np.sum((Design.of(columns).without(test.deviation_um) * fit.weights) ** 2)))
    return play if left[1] < left[0] else 0.0


def _searched(test: CircleTest, static: list[Shape]) -> list[Shape]:
    """Return static shapes and those with a parameter that the residual shows beside them."""
    base = nuisance(test)
    found: list[Shape] = []
    for _ in range(_MOST_SEARCHED):
        columns = np.column_stack([base, *(shape.columns for shape in [*static, *found])])
        sigma = _sigma(Design.of(columns).without(test.deviation_um))
        best = best_shape(test, columns, test.deviation_um, sigma)
        if not _is_significant(best.gain, best.shape):
            break
        found.append(best.shape)
    return [*static, *found]


def _refined(test: CircleTest, fit: _Fit) -> list[Shape]:
    """Return the shapes of a fit, waves at the parameter that suits the shapes that are left."""
    found = list(fit.shapes)
    for index, shape in enumerate(found):
        others = [other.columns for k, other in enumerate(found) if k != index]
        design = Design.of(np.column_stack([nuisance(test), *others]))
        found[index] = refined(test, shape, design, design.without(test.deviation_um) / fit.sigma)
    return found


def _is_significant(chi_squared: float, shape: Shape) -> bool:
    """Return whether noise would reach a chi-squared with a shape, of all shapes, in less than the chance allowed."""
    from scipy.stats import chi2  # noqa: PLC0415 - half a second that other verbs do not need

    return bool(chi2.sf(chi_squared, shape.columns.shape[1]) * shape.searched < CHANCE / _CLASSES)


def _fitted(test: CircleTest, shapes: Sequence[Shape], sigma: float | None, correlated: float) -> _Fit:
    """Return the least-squares fit of shapes; single points that stand out are left aside."""
    base = nuisance(test)
    columns = np.column_stack([base, *(shape.columns for shape in shapes)])
    weights = np.ones(test.angle_rad.size)
    for _ in range(2):
        numbers = np.linalg.lstsq(columns * weights[:, None], test.deviation_um * weights, rcond=None)[0]
        residual = test.deviation_um - columns @ numbers
        weights = _weights(residual)
    whole: Floats = np.asarray(np.linalg.pinv((columns * weights[:, None]).T @ columns), dtype=np.float64)
    edges = np.cumsum([base.shape[1], *(shape.columns.shape[1] for shape in shapes)]).tolist()
    parts = [slice(*pair) for pair in itertools.pairwise(edges)]
    return _Fit(
        shapes=list(shapes),
        coefficients=[np.asarray(numbers[part], dtype=np.float64) for part in parts],
        inverse=[np.asarray(whole[part, part]) for part in parts],
        residual=residual,
        weights=weights,
        sigma=sigma or _sigma(residual),
        correlated=correlated,
    )


def _weights(residual: Floats) -> Floats:
    """Return 0 for single points beyond 6 sigma whose neighbours are not, 1 for all others."""
    far = np.abs(residual) > _OUTLIER_SIGMAS * _sigma(residual)
    alone = far & ~np.roll(far, 1) & ~np.roll(far, -1)
    return np.where(alone, 0.0, 1.0)


def _sigma(residual: Floats) -> float:
    return max(1.4826 * float(np.median(np.abs(residual - np.median(residual)))), 1e-9)


def _correlation(test: CircleTest, residual: Floats) -> float:
    """Return by how much the correlation of neighbours widens the variance of a mean, 1 or more."""
    found = []
    for number in range(int(test.number.max()) + 1):
        part = residual[test.number == number]
        part = np.clip(part, -4.0 * _sigma(part), 4.0 * _sigma(part))
        part = part - part.mean()
        power = np.abs(np.fft.rfft(part, 2 * part.size)) ** 2
        lags = np.fft.irfft(power)[: part.size // 4]
        lags = lags / max(float(lags[0]), 1e-300)
        noisy = lags < 2.0 / math.sqrt(part.size)
        end = int(noisy.argmax()) if noisy.any() else lags.size
        found.append(1.0 + 2.0 * float(lags[1:end].sum()))
    return max(1.0, float(np.mean(found)))


def _eliminated(test: CircleTest, shapes: list[Shape]) -> _Fit:
    """Return the fit without the shapes that are not significant, taken out one after the other."""
    fit = _fitted(test, shapes, None, 1.0)
    fit.correlated = _correlation(test, fit.residual)
    while fit.shapes:
        scores = [
            (float(numbers @ np.linalg.pinv(inverse) @ numbers) / fit.sigma**2 / fit.correlated, shape)
            for shape, numbers, inverse in zip(fit.shapes, fit.coefficients, fit.inverse, strict=True)
        ]
        weak = [(score, k) for k, (score, shape) in enumerate(scores) if not _is_significant(score, shape)]
        small = _too_small(fit)
        if weak:
            out = min(weak)[1]
        elif small is not None:
            out = small
        else:
            break
        kept = [shape for k, shape in enumerate(fit.shapes) if k != out]
        fit = _fitted(test, kept, fit.sigma, fit.correlated)
    return fit


def _of_one_cause(test: CircleTest, fit: _Fit) -> _Fit:
    """Return the fit with one shape for two that it explains as well: the scale of an axis, a lateral play."""
    lateral = {shape.name: shape for shape in static_shapes(test, {}) if shape.name.startswith(LATERAL)}
    causes = [({SCALING, RADIUS}, scale_of(test, axis)) for axis in AXES]
    causes += [({BY_SENSE, f"{LATERAL} {axis}"}, lateral[f"{LATERAL} {other}"]) for axis, other in ("xy", "yx")]
    names = {shape.name for shape in fit.shapes}
    tried = [
        _fitted(test, [s for s in fit.shapes if s.name not in both] + [one], fit.sigma, fit.correlated)
        for both, one in causes
        if both <= names and (one.name in both or one.name not in names)
    ]
    if not tried:
        return fit
    best = min(tried, key=_left)
    rise = (_left(best) - _left(fit)) / fit.sigma**2 / fit.correlated
    return best if rise < _ONE_CAUSE else fit


def _left(fit: _Fit) -> float:
    return float(np.sum((fit.residual * fit.weights) ** 2))


def _too_small(fit: _Fit) -> int | None:
    """Return the index of the smallest shape where it is too small to be named."""
    sizes = [float(np.ptp(s.columns @ n)) / 2.0 for s, n in zip(fit.shapes, fit.coefficients, strict=True)]
    sizes = [size or float(np.abs(n).max()) for size, n in zip(sizes, fit.coefficients, strict=True)]
    least = int(np.argmin(sizes))
    limit = max(_LEAST_SIGMAS * fit.sigma, _LEAST_SHARE * max(sizes))
    return least if sizes[least] < limit else None


def _relative_errors(fit: _Fit) -> list[float]:
    """Return the standard error of the numbers of each shape, relative to their size."""
    found = []
    for numbers, inverse in zip(fit.coefficients, fit.inverse, strict=True):
        spread = fit.sigma * np.sqrt(fit.correlated * np.diag(inverse))
        found.append(float(np.linalg.norm(spread * numbers)) / max(float(numbers @ numbers), 1e-300))
    return found


def _found(test: CircleTest, fit: _Fit) -> Found:
    """Return the errors with values, uncertainties and shares, the largest first."""
    sizes: dict[str, Floats] = {}
    errors: dict[str, FoundError] = {}
    spreads = _relative_errors(fit)
    for name in dict.fromkeys(shape.name for shape in fit.shapes):
        parts = [k for k, shape in enumerate(fit.shapes) if shape.name == name]
        sizes[name] = np.sum([fit.shapes[k].columns @ fit.coefficients[k] for k in parts], axis=0)
        shape, numbers = _together([fit.shapes[k] for k in parts], [fit.coefficients[k] for k in parts])
        value = value_of(shape, numbers, test, fit.residual if shape.name.startswith(SPIKE) else None)
        errors[name] = FoundError(
            name=name,
            value=value.value,
            unit=value.unit,
            uncertainty=abs(value.value) * spreads[parts[0]],
            alone_um=0.0,
            share=0.0,
            details=MappingProxyType(value.details),
        )
    alone = {name: _alone(test, values) for name, values in sizes.items()}
    for name, jump_um, spread_um in stick_slip(test, fit.residual, fit.weights, fit.correlated):
        alone[name] = jump_um
        errors[name] = FoundError(
            name=name, value=jump_um, unit="um", uncertainty=spread_um, alone_um=0.0, share=0.0, details={}
        )
    total = sum(alone.values())
    shared = [replace(e, alone_um=alone[name], share=alone[name] / total) for name, e in errors.items()]
    figures = circularity(test)
    x, y = figures.centre
    return Found(
        test=test,
        figures=figures,
        errors=tuple(sorted(shared, key=lambda error: -error.share)),
        contributions_um=MappingProxyType(sizes),
        residual_um=fit.residual,
        noise_um=fit.sigma,
        notes=(*test.notes, f"centre offset taken out: x {round(x, 3) + 0.0:g} um, y {round(y, 3) + 0.0:g} um"),
    )


def _together(shapes: Sequence[Shape], numbers: Sequence[Floats]) -> tuple[Shape, Floats]:
    """Return spikes of an axis that several shapes make up as one; of several waves the first, the largest."""
    if len(shapes) == 1 or shapes[0].of is not None:
        return shapes[0], numbers[0]
    columns = np.sum([shape.columns * of for shape, of in zip(shapes, numbers, strict=True)], axis=0)
    return replace(shapes[0], columns=columns), np.ones(columns.shape[1])


def _alone(test: CircleTest, values: Floats) -> float:
    """Return the circular deviation of an error alone; of another radius, which has none, its size."""
    found = circular_deviation(test.angle_rad, values)
    return found if np.ptp(values) > 1e-9 else float(np.abs(values).max())
