"""Tables by least squares: their points, and the spacing that other readings choose."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rtec.errors import ArgumentError
from rtec.predictors import BidirectionalTable, UnidirectionalTable
from rtec.predictors.fitting.samples import Samples
from rtec.predictors.fitting.spaced_tables import fitted_points, spaced_table, table_of
from rtec.predictors.tables import Between

LENGTH = 200.0


def readings(error, seed, noise_mm, rows=200):
    rng = np.random.default_rng(seed)
    x, way = np.tile(np.linspace(0.0, LENGTH, rows), 2), np.repeat([1.0, -1.0], rows)
    return Samples(position_mm=x, direction=way, error_mm=error(x, way) + rng.normal(0.0, noise_mm, 2 * rows))


def wave(x, way):
    return 0.005 * np.sin(2.0 * np.pi * x / 20.0) + 0.003 * (way < 0)


def two_rounds(seed, noise_mm, error, runs=4):
    """Targets every millimetre in all runs but the last, which has them 24/23 mm apart, both ways."""
    rng = np.random.default_rng(seed)
    first, second = np.arange(0.0, LENGTH + 0.5), np.arange(0.0, LENGTH, 24.0 / 23.0)
    x = np.concatenate([*[first] * 2 * runs, second, second])
    way = np.concatenate([np.repeat([1.0, -1.0] * runs, first.size), np.repeat([1.0, -1.0], second.size)])
    return Samples(position_mm=x, direction=way, error_mm=error(x, way) + rng.normal(0.0, noise_mm, x.size))


@pytest.mark.parametrize("kind", [UnidirectionalTable, BidirectionalTable])
@pytest.mark.parametrize("between", Between)
def test_a_wave_gets_points_close_to_each_other_and_noise_does_not(kind, between):
    fine = spaced_table(readings(wave, 0, 1e-4), kind, between)
    coarse = spaced_table(readings(lambda x, way: 0.0 * x, 0, 0.005), kind, between)
    assert fine.spacing_mm < 5.0
    assert coarse.spacing_mm > 20.0
    for found in (fine, coarse):
        errors = [rms for _, rms in found.tried]
        assert found.spacing_mm == pytest.approx(found.tried[int(np.argmin(errors))][0])
        assert len(found.tried) > 5
        assert found.table.between is between


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("period_mm, most_um", [(80.0, 0.30), (10.0, 0.55)])
def test_two_rounds_of_noisy_readings_get_the_spacing_of_least_bias_and_noise(seed, period_mm, most_um):
    """Straight lines miss a curve by its bend times h^2 / sqrt(720), and each point costs the noise of one reading.

    (de Boor, A Practical Guide to Splines, 1978, chapter III: the error of the best broken line.)
    """
    noise_um, high_um = 1.0, 5.0

    def truth(x, way):
        return 1e-3 * (high_um * np.sin(2.0 * np.pi * x / period_mm) + 4.0 * (way < 0))

    samples = two_rounds(seed, 1e-3 * noise_um, truth)
    found = spaced_table(samples, BidirectionalTable, Between.LINES)
    h = np.array([spacing for spacing, _ in found.tried])
    bend = high_um * (2.0 * np.pi / period_mm) ** 2 / np.sqrt(2.0)
    expected = np.hypot(bend * h**2 / np.sqrt(720.0), noise_um * np.sqrt(LENGTH / h / (samples.rows / 2)))
    best, chosen = int(np.argmin(expected)), int(np.flatnonzero(np.isclose(h, found.spacing_mm))[0])
    assert abs(chosen - best) <= 1, (found.spacing_mm, h[best])
    x, way = np.tile(np.linspace(0.0, LENGTH, 4001), 2), np.repeat([1.0, -1.0], 4001)
    off_um = 1e3 * float(np.sqrt(np.mean((found.table.error_mm(x, way) - truth(x, way)) ** 2)))
    assert off_um < most_um
    assert off_um == pytest.approx(expected[chosen], rel=0.35)
    assert 1e3 * min(rms for _, rms in found.tried) == pytest.approx(np.hypot(noise_um, off_um), rel=0.15)


def test_the_error_of_a_tried_spacing_is_that_of_places_left_out_whole():
    """By plain least squares with each place of both rounds left out in turn; parts of ten leave out more at once."""
    samples = two_rounds(0, 1e-3, wave)
    found = spaced_table(samples, BidirectionalTable, Between.LINES)
    for spacing, rms in found.tried[-6:]:
        grid = np.linspace(0.0, LENGTH, round(LENGTH / spacing) + 1)
        left = []
        for way in (1.0, -1.0):
            rows = samples.direction == way
            x, y = samples.position_mm[rows], samples.error_mm[rows]
            hats = np.stack([np.interp(x, grid, unit) for unit in np.eye(grid.size)], axis=1)
            bends = np.diff(np.eye(grid.size), 2, axis=0) * np.sqrt(1e-3)
            table = np.vstack([hats, bends])
            covered = hats @ np.linalg.solve(table.T @ table, hats.T)
            off = y - covered @ y
            for place in np.unique(np.round(x, 6))[1:-1]:
                out = np.abs(x - place) < 1e-3
                left.append(np.linalg.solve(np.eye(out.sum()) - covered[np.ix_(out, out)], off[out]))
        expected = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
        assert rms == pytest.approx(expected, rel=0.15), spacing


def test_targets_of_one_round_are_not_judged_by_the_gaps_that_they_leave():
    """Five targets a wave: without one of them nothing bridges the gap, and with all of them the wave is there."""
    x, way = np.tile(2.0 * np.arange(101.0), 4), np.repeat([1.0, -1.0, 1.0, -1.0], 101)

    def fine(x, way):
        return 0.003 * np.sin(2.0 * np.pi * x / 10.0) + 0.004 * (way < 0)

    noise = np.random.default_rng(0).normal(0.0, 3e-4, x.size)
    samples = Samples(position_mm=x, direction=way, error_mm=fine(x, way) + noise)
    found = spaced_table(samples, BidirectionalTable, Between.LINES)
    assert found.spacing_mm == pytest.approx(2.0)
    # a reading against the other one of its place, on which the point stands: noise of both
    assert found.tried[-1][1] == pytest.approx(3e-4 * np.sqrt(2.0), rel=0.1)


def test_backlash_is_the_mean_difference_of_the_directions():
    found = spaced_table(readings(wave, 0, 1e-5), UnidirectionalTable, Between.LINES)
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
    like = spaced_table(readings(wave, 0, 1e-4), BidirectionalTable, Between.CUBIC)
    table = table_of(readings(wave, 2, 1e-4), like)
    assert isinstance(table, BidirectionalTable)
    assert table.between is Between.CUBIC
    assert_allclose(table.forward_positions_mm, like.table.forward_positions_mm)
    assert not np.array_equal(table.forward_errors_mm, like.table.forward_errors_mm)


def test_one_direction_alone_and_one_place_alone_are_refused():
    x = np.arange(10.0)
    forward = Samples(position_mm=x, direction=np.ones(10), error_mm=x)
    with pytest.raises(ArgumentError, match="both directions"):
        spaced_table(forward, UnidirectionalTable, Between.LINES)
    place = Samples(position_mm=[5.0, 5.0], direction=[1, -1], error_mm=[0, 0])
    with pytest.raises(ArgumentError, match=r"1 between 5 and 5 mm.*three or more"):
        spaced_table(place, BidirectionalTable, Between.LINES)
