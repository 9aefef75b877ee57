"""What a table says between its points, beside scipy and numpy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import PchipInterpolator

from rtec.predictors import BidirectionalTable, UnidirectionalTable
from rtec.predictors.tables import Between

POINTS = np.array([0.0, 1.0, 2.5, 3.0, 7.0, 8.0, 20.0])
ERRORS = np.array([0.0, 2.0, 2.0, -1.0, 4.0, 3.0, 3.5]) * 1e-3
REVERSE = np.array([[-1.0, 5.0, 21.0], [3e-3, 9e-3, 1e-3]])
INSIDE = np.linspace(0.0, 20.0, 501)


@pytest.mark.parametrize("way", [1, -1])
def test_cubics_are_those_of_scipy(way):
    table = BidirectionalTable(
        forward_positions_mm=POINTS,
        forward_errors_mm=ERRORS,
        reverse_positions_mm=REVERSE[0],
        reverse_errors_mm=REVERSE[1],
        between=Between.CUBIC,
    )
    expected = PchipInterpolator(POINTS, ERRORS) if way > 0 else PchipInterpolator(*REVERSE)
    assert_allclose(table.error_mm(INSIDE, way), expected(INSIDE), rtol=0, atol=1e-15)


def test_lines_are_those_of_numpy_and_cubics_differ():
    lines, cubics = (
        UnidirectionalTable(positions_mm=POINTS, errors_mm=ERRORS, backlash_mm=0.002, between=between)
        for between in Between
    )
    assert_allclose(lines.error_mm(INSIDE, 1), np.interp(INSIDE, POINTS, ERRORS), rtol=0, atol=1e-15)
    assert np.abs(lines.error_mm(INSIDE, 1) - cubics.error_mm(INSIDE, 1)).max() > 1e-4
    expected = PchipInterpolator(POINTS, ERRORS)(INSIDE) + 0.002
    assert_allclose(cubics.error_mm(INSIDE, -1), expected, rtol=0, atol=1e-15)


def test_cubics_hold_their_ends():
    cubic = UnidirectionalTable(positions_mm=POINTS, errors_mm=ERRORS, backlash_mm=0.0, between=Between.CUBIC)
    assert cubic.error_mm(np.array([-50.0, 70.0]), 1).tolist() == [ERRORS[0], ERRORS[-1]]


def test_two_points_make_a_line_of_a_cubic():
    cubic = UnidirectionalTable(positions_mm=[0, 10], errors_mm=[0, 0.01], backlash_mm=0.0, between=Between.CUBIC)
    assert float(cubic.error_mm(2.5, 1)) == pytest.approx(0.0025)
