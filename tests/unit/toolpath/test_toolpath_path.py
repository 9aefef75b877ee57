import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe

from rtec.errors import ArgumentError
from rtec.toolpath import Nurbs, Path, butterfly, circle, random_path, read_path


def ellipse(a_mm, b_mm):
    round_one = circle(1.0).curve
    points = round_one.control_points_mm * [a_mm, b_mm]
    return Path(
        name="ellipse",
        curve=Nurbs(degree=2, knots=round_one.knots, control_points_mm=points, weights=round_one.weights),
    )


def test_a_circle_is_round_and_as_long_as_it_should_be():
    for clockwise in (False, True):
        path = circle(150.0, clockwise=clockwise)
        s = np.linspace(0.0, path.length_mm, 1001)
        angle = s / 150.0 * (-1.0 if clockwise else 1.0)
        assert path.length_mm == pytest.approx(300.0 * math.pi, rel=1e-14)
        assert path.closed
        assert not path.corners_mm.size
        assert np.abs(path.points(s) - 150.0 * np.column_stack([np.cos(angle), np.sin(angle)])).max() < 1e-11
        assert np.allclose(path.curvature(s), -1 / 150.0 if clockwise else 1 / 150.0, rtol=1e-11)


@pytest.mark.parametrize("b_mm", [600.0, 100.0, 3.0])
def test_the_length_of_an_ellipse_is_the_elliptic_integral(b_mm):
    assert ellipse(600.0, b_mm).length_mm == pytest.approx(2400.0 * ellipe(1.0 - (b_mm / 600.0) ** 2), rel=1e-12)


@pytest.mark.parametrize("path", [butterfly(), random_path(5), random_path(6, box_mm=(1200.0, 900.0, 300.0))])
def test_arc_lengths_are_those_of_quadrature(path):
    curve = path.curve
    begins, widths = curve.breaks[:-1], np.diff(curve.breaks)
    inner = begins + 0.37 * widths

    def length(a, b):
        return quad(lambda u: np.linalg.norm(curve.evaluate(u, 1)[1]), a, b, epsabs=1e-11, epsrel=1e-13)[0]

    s = path.knots_mm[:-1] + [length(a, b) for a, b in zip(begins, inner, strict=True)]
    assert np.abs(path.points(s) - curve.evaluate(inner)[0]).max() < 1e-9
    assert np.abs(np.diff(path.knots_mm) - list(map(length, begins, curve.breaks[1:]))).max() < 1e-9


@pytest.mark.parametrize("path", [butterfly(), random_path(7, box_mm=(1200.0, 1200.0, 400.0)), ellipse(300.0, 40.0)])
def test_derivatives_by_arc_length_agree_with_finite_differences(path):
    h = 1e-4
    s = path.knots_mm[:-1] + 0.43 * np.diff(path.knots_mm)
    x = [path.points(s), *path.derivatives(s)]
    before, after = ([path.points(at), *path.derivatives(at)] for at in (s - h, s + h))
    for order in (1, 2, 3):
        slope = (after[order - 1] - before[order - 1]) / (2.0 * h)
        assert np.abs(slope - x[order]).max() < 1e-6 * max(1.0 if order == 1 else 0.0, np.abs(x[order]).max())
    assert np.abs(np.linalg.norm(x[1], axis=1) - 1.0).max() < 1e-14
    assert np.abs(np.einsum("ij,ij->i", x[1], x[2])).max() < 1e-12


def test_the_third_derivative_of_a_cubic_jumps_at_its_knots_only():
    path = random_path(8)
    inner = path.knots_mm[1:-1]
    before, after = path.derivatives(inner, side=-1), path.derivatives(inner, side=1)
    assert np.abs(before[1] - after[1]).max() < 1e-12
    assert np.linalg.norm(before[2] - after[2], axis=1).min() > 1e-9
    near = path.derivatives(inner - 1e-7)
    assert np.abs(near[2] - before[2]).max() < 1e-6 * np.abs(before[2]).max()


def test_corners_are_where_direction_or_curvature_jumps():
    bent = Nurbs(degree=1, knots=[0, 0, 1, 2, 3, 3], control_points_mm=[[0, 0], [3, 0], [5, 0], [5, 4]])
    path = Path(name="bent", curve=bent)
    assert path.knots_mm.tolist() == [0.0, 3.0, 5.0, 9.0]
    assert path.corners_mm.tolist() == [5.0]
    assert not butterfly().corners_mm.size


def test_arc_lengths_off_the_path_are_refused():
    path = circle()
    for s in ([-0.1], [path.length_mm + 0.1], [math.nan], [[1.0]]):
        with pytest.raises(ArgumentError, match="s_mm"):
            path.points(s)


def test_the_butterfly_is_fays_within_its_tolerance():
    path = butterfly(600.0, tolerance_mm=0.01)
    u = np.linspace(0.0, 2.0 * math.pi, 20_001)
    radius = np.exp(np.sin(u)) - 2.0 * np.cos(4.0 * u)
    fay = np.column_stack([radius * np.cos(u), radius * np.sin(u)])
    fay *= 600.0 / np.ptp(fay[:, 0])
    off = np.linalg.norm(path.curve.evaluate(u)[0] - fay, axis=1).max()
    assert 1e-4 < off < 0.01
    assert path.closed
    assert np.allclose(path.derivatives([0.0])[1], path.derivatives([path.length_mm], side=-1)[1], atol=1e-12)


def test_random_paths_are_those_of_their_seed_and_stay_in_their_box():
    for box in ((1200.0, 1200.0), (300.0, 200.0, 100.0)):
        one, same, other = (random_path(seed, box_mm=box) for seed in (1, 1, 2))
        s = np.linspace(0.0, one.length_mm, 5000)
        assert np.array_equal(one.points(s), same.points(s))
        assert one.length_mm != other.length_mm
        assert (one.points(s) >= 0.0).all()
        assert (one.points(s) <= box).all()


def test_paths_have_names():
    assert [read_path(name).name for name in ("butterfly", "Circle", "random")] == ["butterfly", "circle", "random 1"]
    assert read_path("random", seed=3).length_mm == random_path(3).length_mm
    with pytest.raises(ArgumentError, match="butterfly, circle, random, or a file"):
        read_path("wings.svg")
