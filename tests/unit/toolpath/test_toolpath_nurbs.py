import json

import numpy as np
import pytest
from scipy.interpolate import BSpline

from rtec.errors import ArgumentError, FileFormatError, RtecError
from rtec.toolpath import Nurbs, Path, read_nurbs, read_path

GOOD = {"degree": 2, "knots": [0, 0, 0, 1, 1, 1], "control_points": [[0, 0], [5, 8], [10, 0]]}


def random_spline(degree, dimensions, *, clamped=True, rational=True, points=12, seed=3):
    stream = np.random.default_rng(seed)
    knots = np.cumsum(stream.uniform(0.2, 1.0, points + degree + 1))
    if clamped:
        knots[: degree + 1], knots[points:] = knots[degree], knots[points]
    weights = stream.uniform(0.3, 3.0, points) if rational else None
    points_mm = stream.uniform(0.0, 1200.0, (points, dimensions))
    return Nurbs(degree=degree, knots=knots, control_points_mm=points_mm, weights=weights)


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 9])
@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("clamped", [True, False])
def test_points_and_derivatives_are_those_of_scipy(degree, dimensions, clamped):
    curve = random_spline(degree, dimensions, clamped=clamped, rational=False)
    u = np.random.default_rng(0).uniform(curve.breaks[0], curve.breaks[-1], 2000)
    spline = BSpline(curve.knots, curve.control_points_mm, degree)
    ours = curve.evaluate(u, 3)
    for order in range(4):
        theirs = spline(u, nu=order) if order <= degree else np.zeros_like(ours[order])
        assert np.abs(ours[order] - theirs).max() <= 1e-11 * max(np.abs(theirs).max(), 1.0)


def test_a_rational_curve_is_the_projection_of_its_homogeneous_spline():
    curve = random_spline(4, 3)
    u = np.linspace(curve.breaks[0], curve.breaks[-1], 501)
    weights = curve.weights[:, None]
    lifted = BSpline(curve.knots, np.hstack([curve.control_points_mm * weights, weights]), 4)(u)
    assert np.abs(curve.evaluate(u)[0] - lifted[:, :3] / lifted[:, 3:]).max() < 1e-10


@pytest.mark.parametrize("dimensions", [2, 3])
def test_derivatives_agree_with_finite_differences(dimensions):
    curve = random_spline(5, dimensions)
    u = np.linspace(curve.breaks[0], curve.breaks[-1], 200)[1:-1] + 1e-3
    h = 1e-5
    before, here, after = (curve.evaluate(u + step, 3) for step in (-h, 0.0, h))
    for order in (1, 2, 3):
        slope = (after[order - 1] - before[order - 1]) / (2.0 * h)
        assert np.abs(slope - here[order]).max() < 1e-6 * np.abs(here[order]).max()


def test_curvature_is_that_of_the_derivatives():
    for dimensions in (2, 3):
        curve = random_spline(3, dimensions)
        u = np.linspace(curve.breaks[0], curve.breaks[-1], 300)
        points, curvature = curve.curvature(u)
        at, first, second = curve.evaluate(u, 2)
        cross = np.cross(np.pad(first, ((0, 0), (0, 3 - dimensions))), np.pad(second, ((0, 0), (0, 3 - dimensions))))
        turn = cross[:, 2] if dimensions == 2 else np.linalg.norm(cross, axis=1)
        assert np.allclose(points, at, rtol=1e-13)
        assert np.allclose(curvature, turn / np.linalg.norm(first, axis=1) ** 3, rtol=1e-9, atol=1e-12)


def test_at_a_knot_each_side_has_its_own_derivative():
    bent = Nurbs(degree=1, knots=[0, 0, 1, 2, 2], control_points_mm=[[0, 0], [3, 0], [3, 4]])
    assert bent.evaluate([1.0], 1, side=-1)[1].tolist() == [[3.0, 0.0]]
    assert bent.evaluate([1.0], 1, side=1)[1].tolist() == [[0.0, 4.0]]


BAD = {
    "no knots": ({"knots": None}, "knots"),
    "too few points": ({"control_points": [[0, 0], [1, 1]]}, "3 to 1000000 for degree 2"),
    "too few knots": ({"knots": [0, 0, 1, 1, 1]}, "control points . degree . 1"),
    "descending": ({"knots": [0, 0, 0, 1, 1, 0.5]}, "descending"),
    "repeated": ({"knots": [0, 0, 0, 0, 1, 1]}, "0 stands 4 times"),
    "zero weight": ({"weights": [1, 0, 1]}, "weights, number 2: 0"),
    "negative weight": ({"weights": [1, 1, -2]}, "weights, number 3: -2"),
    "uneven weights": ({"weights": [1, 20000, 1]}, "1 to 20000 differ too much"),
    "weights missing": ({"weights": [1, 1]}, "3, one for each"),
    "one place": ({"control_points": [[1, 1]] * 3}, "coincide"),
    "four dimensions": ({"control_points": [[1, 1, 1, 1], [0, 0, 0, 0], [2, 2, 2, 2]]}, "x, y"),
    "ragged": ({"control_points": [[1, 1], [0], [2, 2]]}, "equal length"),
    "words": ({"control_points": [["1", "2"], [0, 0], [2, 2]]}, "numbers"),
    "not rows": ({"control_points": 5}, "rows .x, y."),
    "far": ({"control_points": [[0, 0], [1e9, 0], [1, 1]]}, "1e.09"),
    "huge": ({"control_points": [[0, 0], [10**400, 0], [1, 1]]}, "numbers"),
    "degree": ({"degree": 0}, "degree: 0 is too small"),
    "another key": ({"weight": [1, 1, 1]}, "did you mean 'weights'"),
}


@pytest.mark.parametrize("change, said", BAD.values(), ids=BAD)
def test_a_degenerate_file_gets_one_clear_error(tmp_path, change, said):
    file = tmp_path / "curve.json"
    file.write_text(json.dumps({key: value for key, value in {**GOOD, **change}.items() if value is not None}))
    with pytest.raises(FileFormatError, match=said) as caught:
        read_nurbs(file)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 250 + len(str(file))


def test_repeated_inner_knots_end_at_the_degree():
    points = [[0, 0], [1, 2], [3, 0], [4, 2], [6, 0]]
    Nurbs(degree=2, knots=[0, 0, 0, 1, 1, 2, 2, 2], control_points_mm=points)
    with pytest.raises(ArgumentError, match="1 stands 3 times"):
        Nurbs(degree=2, knots=[0, 0, 0, 1, 1, 1, 2, 2, 2], control_points_mm=[*points, [7, 1]])


def test_a_file_is_read_as_written_and_others_are_refused(tmp_path):
    file = tmp_path / "arch.json"
    file.write_text(json.dumps(GOOD))
    path = read_path(str(file))
    assert (path.name, path.dimensions, path.closed) == ("arch.json", 2, False)
    assert path.points([0.0, path.length_mm / 2, path.length_mm]).round(9).tolist() == [[0, 0], [5, 4], [10, 0]]
    for text, said in (("[1]", "no object"), ("{", "no JSON"), ('{"degree": NaN}', "NaN"), ("", "empty")):
        file.write_text(text)
        with pytest.raises(FileFormatError, match=said):
            read_path(str(file))
    file.write_bytes(b" " * (1 << 24) + b"{}")
    with pytest.raises(FileFormatError, match="at most 16777216 bytes"):
        read_path(str(file))


def test_the_most_uneven_weights_still_make_a_path():
    points = [[0, 0], [100, 300], [200, 0], [300, 300], [400, 0]]
    curve = Nurbs(degree=3, knots=[0, 0, 0, 0, 1, 2, 2, 2, 2], control_points_mm=points, weights=[1, 1, 1e4, 1, 1])
    path = Path(name="uneven", curve=curve)
    s = np.linspace(0.0, path.length_mm, 100_001)
    chords = np.linalg.norm(np.diff(path.points(s), axis=0), axis=1)
    assert chords.max() < path.length_mm / 100_000 + 1e-9
    assert chords.sum() == pytest.approx(path.length_mm, rel=1e-6)


@pytest.mark.parametrize(
    "points",
    [
        [[0, 0], [0, 0], [1, 1], [2, 0]],  # rests at its beginning
        [[0, 0], [10, 10], [0, 10], [10, 0]],  # a cusp in the middle
        [[0, 0], [1, 1], [2, 2], [1, 1.0]],  # turns back on itself
    ],
)
def test_a_cusp_within_a_span_is_no_path(tmp_path, points):
    file = tmp_path / "cusp.json"
    file.write_text(json.dumps({"degree": 3, "knots": [0] * 4 + [1] * 4, "control_points": points}))
    with pytest.raises(FileFormatError, match=r"cusp.json: the curve has a cusp or coincident control points"):
        read_path(str(file))
    curve = Nurbs(degree=3, knots=[0] * 4 + [1] * 4, control_points_mm=points)
    with pytest.raises(RtecError, match="cusp"):
        Path(name="cusp", curve=curve)
