"""Scan grids are fine enough: no shape between two of a grid is far from both."""

import numpy as np
import pytest

from rtec.effects import CyclicShape
from rtec.effects.cogging import Cogging
from rtec.effects.cyclic import Cyclic
from rtec.effects.lost_counts import LostCounts, StepShape
from rtec.effects.stribeck import Stribeck, StribeckShape
from rtec.effects.warm_up import WarmShape, WarmUp
from rtec.effects.windup import Windup, WindupShape

WavesShape = Cogging().shape_type

ENOUGH = 0.975
BETWEEN_WAVES = 0.955
"""A sine over 0.15 / span: sinc(0.15) is 0.963; places that are not evenly spread take a little off."""


def best_cosine(effect, conditions, shape, grid, centred):
    """Root mean square over all phases of the cosine of a shape with the best shape of the grid."""

    def basis(columns):
        return np.linalg.qr(columns - columns.mean(axis=0) if centred else columns)[0]

    wanted = basis(effect.columns(conditions, shape))
    return max(np.linalg.norm(wanted.T @ basis(columns.T)) for columns in grid) / np.sqrt(wanted.shape[1])


def between(values, count, rng):
    values = np.sort(np.asarray(values))
    low = rng.integers(0, values.size - 1, count)
    return values[low] + rng.uniform(0.3, 0.7, count) * (values[low + 1] - values[low])


def near(shapes, key, value, count):
    return sorted(shapes, key=lambda shape: abs(key(shape) - value))[:count]


@pytest.mark.parametrize("effect, shape_type", [(Cyclic(), CyclicShape), (Cogging(), WavesShape)])
def test_periods(bidirectional, effect, shape_type):
    rng = np.random.default_rng(3)
    c = bidirectional(np.linspace(3.0, 397.0, 61) + rng.uniform(-2, 2, 61), runs=2)
    shapes = effect.shapes(c)
    for frequency in between([1 / shape.period for shape in shapes], 40, rng):
        beside = near(shapes, lambda shape: 1 / shape.period, frequency, 2)
        assert best_cosine(effect, c, shape_type(1 / frequency), effect.scan(c, beside), True) >= BETWEEN_WAVES


@pytest.mark.parametrize("centred", [False, True])
def test_distances_of_windup(bidirectional, centred):
    c = bidirectional(np.concatenate([np.geomspace(0.1, 400.0, 40)]), runs=2)
    shapes = Windup().shapes(c)
    for distance in between([shape.distance for shape in shapes], 30, np.random.default_rng(4)):
        assert best_cosine(Windup(), c, WindupShape(distance), Windup().scan(c, shapes), centred) >= ENOUGH


@pytest.mark.parametrize("centred", [False, True])
def test_time_constants_of_a_warm_up(bidirectional, centred):
    c = bidirectional()
    shapes = WarmUp().shapes(c)
    assert shapes[0].time_constant == pytest.approx(1045.0 / 50)
    assert shapes[-1].time_constant == pytest.approx(1045.0 / 2)
    for constant in between([shape.time_constant for shape in shapes], 30, np.random.default_rng(5)):
        assert best_cosine(WarmUp(), c, WarmShape(constant), WarmUp().scan(c, shapes), centred) >= ENOUGH


@pytest.mark.parametrize("runs", [5, 60])
def test_moments_of_lost_counts(bidirectional, runs):
    c = bidirectional(runs=runs)
    shapes = LostCounts().shapes(c)
    moments = (c.time_s[1:] + c.time_s[:-1]) / 2
    grid = [shape.moment for shape in shapes]
    for moment in moments[1:-1]:
        index = min(max(int(np.searchsorted(grid, moment)), 1), len(grid) - 1)
        columns = LostCounts().scan(c, shapes[index - 1 : index + 1])
        assert best_cosine(LostCounts(), c, StepShape(moment), columns, True) >= 0.97


def test_stribeck_speeds(log):
    c = log()
    shapes = Stribeck().shapes(c)
    assert shapes[0].speed < 1.0
    assert shapes[-1].speed == pytest.approx(np.abs(c.velocity).max() / 3, rel=0.02)
    for speed in between([shape.speed for shape in shapes], 30, np.random.default_rng(6)):
        assert best_cosine(Stribeck(), c, StribeckShape(speed=speed), Stribeck().scan(c, shapes), False) >= ENOUGH
