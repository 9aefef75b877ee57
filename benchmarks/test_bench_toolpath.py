"""Speed of a million points of a NURBS with curvature, and of a million feet; scipy's points with derivatives."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from rtec.toolpath import butterfly, contour_error, random_path

COUNT = 1_000_000


@pytest.fixture(scope="module")
def curve():
    return random_path(1).curve


@pytest.fixture(scope="module")
def u(curve):
    return np.linspace(curve.breaks[0], curve.breaks[-1], COUNT)


def test_speed_of_points_with_curvature(benchmark, curve, u):
    assert np.isfinite(benchmark(curve.curvature, u)[1]).all()


def test_speed_of_points_with_two_derivatives(benchmark, curve, u):
    assert benchmark(curve.evaluate, u, 2).shape == (3, COUNT, 2)


def test_speed_of_scipys_points_with_two_derivatives(benchmark, curve, u):
    spline = BSpline(curve.knots, curve.control_points_mm, curve.degree)
    theirs = benchmark(lambda: [spline(u, nu=order) for order in range(3)])
    assert np.allclose(theirs, curve.evaluate(u, 2), atol=1e-8)


def test_speed_of_feet(benchmark):
    path = butterfly()
    s = np.linspace(0.0, path.length_mm, COUNT)
    found = benchmark(contour_error, path, s, path.points(s) + 0.01)
    assert np.abs(found.error_mm).max() < 0.015
