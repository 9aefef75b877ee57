"""Tables by least squares: their points, and the spacing that other readings choose."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rtec.errors import ArgumentError
from rtec.predictors import BidirectionalTable, UnidirectionalTable
from rtec.predictors.between import Between
from rtec.predictors.fitting.samples import Samples
from rtec.predictors.fitting.spaced_tables import fitted_points, spaced_table, table_of

LENGTH = 200.0


def readings(error, seed, noise_mm, rows=200):
    rng = np.random.default_rng(seed)
    x, way = np.tile(np.linspace(0.0, LENGTH, rows), 2), np.repeat([1.0, -1.0], rows)
    return Samples(position_mm=x, direction=way, error_mm=error(x, way) + rng.normal(0.0, noise_mm, 2 * rows))


def wave(x, way):
    return 0.005 * np.sin(2.0 * np.pi * x / 20.0) + 0.003 * (way < 0)


@pytest.mark.parametrize("kind", [UnidirectionalTable, BidirectionalTable])
@pytest.mark.parametrize("between", Between)
def test_a_wave_gets_points_close_to_each_other_and_noise_does_not(kind, between):
    fine = spaced_table(readings(wave, 0, 1e-4), readings(wave, 1, 1e-4), kind, between)
    coarse = spaced_table(
        readings(lambda x, way: 0.0 * x, 0, 0.005), readings(lambda x, way: 0.0 * x, 1, 0.005), kind, between
    )
    assert fine.spacing_mm < 5.0
    assert coarse.spacing_mm > 20.0
    for found in (fine, coarse):
        errors = [rms for _, rms in found.tried]
        assert found.spacing_mm == pytest.approx(found.tried[int(np.argmin(errors))][0])
        assert len(found.tried) > 5
        assert found.table.between is between


def test_the_error_of_a_tried_spacing_is_that_of_the_readings_not_seen():
    unseen = readings(wave, 1, 1e-3)
    found = spaced_table(readings(wave, 0, 1e-3), unseen, BidirectionalTable, Between.LINES)
    off = unseen.error_mm - found.table.error_mm(unseen.position_mm, unseen.direction)
    assert min(rms for _, rms in found.tried) == pytest.approx(float(np.sqrt(np.mean(off**2))))


def test_backlash_is_the_mean_difference_of_the_directions():
    found = spaced_table(readings(wave, 0, 1e-5), readings(wave, 1, 1e-5), UnidirectionalTable, Between.LINES)
    assert found.table.backlash_mm == pytest.approx(0.003, abs=1e-5)


@pytest.mark.parametrize("points", [2, 3, 9])
def test_points_are_those_of_least_squares_with_hat_functions(points):
    rng = np.random.default_rng(points)
    x = np.sort(rng.uniform(0.0, 10.0, 120))
    y = rng.normal(0.0, 1e-3, 120) + 1e-4 * x**2
    grid = np.linspace(0.0, 10.0, points)
    hats = np.stack([np.interp(x, grid, unit) for unit in np.eye(points)], axis=1)
    bends = np.diff(np.eye(points), 2, axis=0) * np.sqrt(1e-3)
    expected = np.linalg.lstsq(np.vstack([hats, bends]), np.concatenate([y, np.zeros(len(bends))]))[0]
    found = fitted_points(grid, Samples(position_mm=x, direction=np.ones(120), error_mm=y))
    assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_a_point_without_a_reading_near_it_lies_between_its_neighbours():
    x = np.array([0.0, 1.0, 2.0, 8.0, 9.0, 10.0])
    found = fitted_points(np.linspace(0.0, 10.0, 11), Samples(position_mm=x, direction=np.ones(6), error_mm=1e-3 * x))
    assert_allclose(found, 1e-3 * np.arange(11), rtol=0, atol=1e-9)


def test_a_table_of_more_readings_keeps_kind_spacing_and_ends():
    like = spaced_table(readings(wave, 0, 1e-4), readings(wave, 1, 1e-4), BidirectionalTable, Between.CUBIC)
    table = table_of(readings(wave, 2, 1e-4), like)
    assert isinstance(table, BidirectionalTable)
    assert table.between is Between.CUBIC
    assert_allclose(table.forward_positions_mm, like.table.forward_positions_mm)
    assert not np.array_equal(table.forward_errors_mm, like.table.forward_errors_mm)


def test_one_direction_alone_and_one_place_alone_are_refused():
    x = np.arange(10.0)
    forward = Samples(position_mm=x, direction=np.ones(10), error_mm=x)
    with pytest.raises(ArgumentError, match="both directions"):
        spaced_table(forward, forward, UnidirectionalTable, Between.LINES)
    place = Samples(position_mm=[5.0, 5.0], direction=[1, -1], error_mm=[0, 0])
    with pytest.raises(ArgumentError):
        spaced_table(place, place, BidirectionalTable, Between.LINES)
