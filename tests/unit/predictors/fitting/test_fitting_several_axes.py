"""What a grid of readings says of the geometry of a machine: known geometries come out again, others are refused."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors.fitting.samples import Samples
from rtec.predictors.fitting.several_axes import Geometry, fit_across

X, Y, Z = np.linspace(0.0, 300.0, 7), np.linspace(-50.0, 200.0, 6), np.linspace(0.0, 100.0, 5)
LEAN = 42e-6


def grid(error, *, noise_mm=0.0, seed=0):
    x, y, z, way = (each.ravel() for each in np.meshgrid(X, Y, Z, [1.0, -1.0], indexing="ij"))
    error_mm = error(x, way, y, z) + np.random.default_rng(seed).normal(0.0, noise_mm, x.size)
    return Samples(position_mm=x, direction=way, error_mm=error_mm, others_mm={2: y, 3: z})


def own(x, way):
    return 3e-3 * np.sin(x / 80.0) + np.where(way < 0.0, 4e-3, 0.0)


def bend(y):
    """A parabola whose least-squares line over its six places has no slope, 3 µm deep at its middle."""
    return 3e-3 * ((y - 75.0) / 125.0) ** 2


def square(x, way, y, z):
    return own(x, way) + LEAN * y


def bent(x, way, y, z):
    return square(x, way, y, z) + bend(y)


def turning(x, way, y, z):
    return bent(x, way, y, z) + 20e-6 * np.cos(x / 90.0) * (z - 50.0)


@pytest.mark.parametrize(
    ("geometry", "error", "third"),
    [
        (Geometry.SQUARENESS, square, 0.0),
        (Geometry.STRAIGHTNESS, bent, 0.0),
        (Geometry.ANGLES, turning, 20e-6 * np.cos(X / 90.0).mean()),  # of an angle, the mean is squareness
    ],
)
def test_a_geometry_that_was_put_in_comes_out_again(geometry, error, third):
    samples = grid(error)
    found = fit_across(samples, geometry)
    assert np.abs(samples.left_by(found.predictor)).max() < 1e-6
    two, three = found.across
    assert (two.axis, three.axis) == (2, 3)
    assert two.squareness == pytest.approx(LEAN, abs=2e-8)
    assert three.squareness == pytest.approx(third, abs=2e-8)
    bends = np.ptp(bend(Y)) if geometry is not Geometry.SQUARENESS else 0.0
    assert two.straightness_mm == pytest.approx(bends, abs=2e-5)


@pytest.mark.parametrize(
    ("geometry", "error", "left_mm"),
    [
        (Geometry.SQUARENESS, bent, np.sqrt(np.mean((bend(Y) - bend(Y).mean()) ** 2))),
        (Geometry.STRAIGHTNESS, turning, 20e-6 * np.sqrt(np.mean(np.cos(X / 90.0) ** 2) * np.mean((Z - 50.0) ** 2))),
    ],
)
def test_what_a_geometry_cannot_hold_is_left(geometry, error, left_mm):
    samples = grid(error)
    left = samples.left_by(fit_across(samples, geometry).predictor)
    assert np.sqrt(np.mean(left**2)) == pytest.approx(left_mm, rel=0.02)


@pytest.mark.parametrize("geometry", list(Geometry))
def test_the_error_of_a_squareness_is_as_large_as_it_says(geometry):
    """In 60 measurements with noise the slope is off by its standard error, on the whole."""
    off = []
    for seed in range(60):
        two, _ = fit_across(grid(square, noise_mm=2e-3, seed=seed), geometry).across
        off.append((two.squareness - LEAN) / two.sd)
    assert np.mean(off) == pytest.approx(0.0, abs=0.4)
    assert np.std(off) == pytest.approx(1.0, abs=0.27)


def test_what_it_says_of_an_axis_in_words():
    two, three = fit_across(grid(bent), Geometry.STRAIGHTNESS).across
    assert str(two).startswith("axis 2: squareness 42.00 ± ")
    assert str(two).endswith("µm/m, straightness 2.88 µm")
    assert "straightness" not in str(fit_across(grid(bent), Geometry.SQUARENESS).across[0])
    assert str(three).startswith("axis 3: ")


def test_one_direction_is_enough():
    samples = grid(square)
    up = samples.take(samples.direction > 0.0)
    found = fit_across(up, Geometry.SQUARENESS)
    assert np.abs(up.left_by(found.predictor)).max() < 1e-7
    assert {table.direction for table in found.predictor.tables} == {0}


WAY = np.ones(40)
RISING = np.linspace(0.0, 300.0, 40)
TWICE = np.tile(np.linspace(0.0, 300.0, 20), 2)
SIDE = np.repeat([0.0, 100.0], 20)


@pytest.mark.parametrize(
    ("samples", "says"),
    [
        (Samples(position_mm=RISING, direction=WAY, error_mm=RISING), "one axis alone"),
        (Samples(position_mm=RISING, direction=WAY, error_mm=RISING, others_mm={2: 0.5 * RISING}), "each axis moves"),
        (
            Samples(position_mm=TWICE, direction=WAY, error_mm=TWICE, others_mm={2: SIDE, 3: 2.0 * SIDE}),
            "each axis moves",
        ),
        (
            Samples(position_mm=RISING, direction=WAY, error_mm=RISING, others_mm={2: 5.0 * WAY}),
            "an axis at 5 mm alone",
        ),
    ],
)
def test_readings_that_cannot_tell_are_refused(samples, says):
    with pytest.raises(ArgumentError, match=says):
        fit_across(samples, Geometry.SQUARENESS)


def test_fewer_places_than_numbers_are_refused():
    samples = grid(turning)
    few = samples.take(np.random.default_rng(1).permutation(samples.rows)[:20])
    with pytest.raises(ArgumentError, match="20 places"):
        fit_across(few, Geometry.ANGLES)


def test_many_places_share_equidistant_points():
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0.0, 100.0, 3000), rng.uniform(0.0, 100.0, 3000)
    samples = Samples(position_mm=x, direction=np.ones(3000), error_mm=1e-5 * x + LEAN * y, others_mm={2: y})
    found = fit_across(samples, Geometry.STRAIGHTNESS)
    assert [table.positions_mm.size for table in found.predictor.tables] == [200, 30]
    assert np.abs(samples.left_by(found.predictor)).max() < 1e-7
