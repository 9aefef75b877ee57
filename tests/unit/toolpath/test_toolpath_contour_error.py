import math

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.toolpath import (
    Estimate,
    Nurbs,
    Path,
    butterfly,
    circle,
    contour_error,
    estimate,
    parse_gcode,
    random_path,
    second_order_bound,
)

PATHS = [butterfly(), random_path(11), random_path(12, box_mm=(1200.0, 1200.0, 400.0)), circle()]


def reached(path, size_mm, count=3000, seed=0):
    stream = np.random.default_rng(seed)
    s = np.sort(stream.uniform(0.0, path.length_mm, count))
    return s, path.points(s) + stream.normal(0.0, size_mm, (count, path.dimensions))


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.name)
def test_the_foot_is_the_nearest_point_of_the_branch(path):
    s, actual = reached(path, 0.5, 300)
    found = contour_error(path, s, actual)
    for i in range(s.size):
        near = np.linspace(s[i] - 4.0, s[i] + 4.0, 4001)
        near = np.mod(near, path.length_mm) if path.closed else np.clip(near, 0.0, path.length_mm)
        nearest = np.linalg.norm(path.points(near) - actual[i], axis=1).min()
        assert abs(found.error_mm[i]) <= nearest + 1e-12
        assert nearest**2 - found.error_mm[i] ** 2 < 1.1e-6  # the grid has steps of 2 um
    inner = (found.foot_mm > 0.0) & (found.foot_mm < path.length_mm)
    ahead = np.einsum("ij,ij->i", actual - path.points(found.foot_mm), path.derivatives(found.foot_mm)[0])
    assert np.abs(ahead[inner]).max() < 1e-9


def test_errors_about_a_circle_are_differences_of_radii():
    path = circle(100.0)
    s, actual = reached(path, 2.0)
    error = 100.0 - np.linalg.norm(actual, axis=1)  # to the left is towards the centre
    assert np.abs(contour_error(path, s, actual).error_mm - error).max() < 1e-11
    assert np.abs(estimate(path, s, actual, Estimate.CIRCLE) - error).max() < 1e-11
    flat = circle(100.0, clockwise=True)
    mirrored = contour_error(flat, s, actual * [1.0, -1.0])
    assert np.abs(mirrored.error_mm + error).max() < 1e-11


def test_in_space_the_distance_has_a_normal_and_a_binormal_part():
    level = np.column_stack([circle(100.0).curve.control_points_mm, np.full(9, 7.0)])
    flat = circle(100.0).curve
    path = Path(
        name="level",
        curve=Nurbs(degree=2, knots=flat.knots, control_points_mm=level, weights=flat.weights),
    )
    found = contour_error(path, [1.0], [[97.0, 1.0, 11.0]])
    inwards = 100.0 - math.hypot(97.0, 1.0)
    assert found.normal_mm[0] == pytest.approx(inwards, abs=1e-11)
    assert found.binormal_mm[0] == pytest.approx(4.0, abs=1e-11)
    assert found.error_mm[0] == pytest.approx(math.hypot(inwards, 4.0), abs=1e-11)


def test_a_foot_stays_on_its_branch_where_the_path_crosses_itself():
    path = butterfly()
    s = np.linspace(0.0, path.length_mm, 20_000)
    tangent = path.derivatives(s)[0]
    lag = 1.0  # behind the command, and to the left of the path; its tightest turn has a radius of 3.7 mm
    behind = np.mod(s - lag, path.length_mm)
    tangent = path.derivatives(behind)[0]
    left = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    found = contour_error(path, s, path.points(behind) + 0.5 * left)
    between = np.abs(np.mod(found.foot_mm - behind + path.length_mm / 2, path.length_mm) - path.length_mm / 2)
    assert between.max() < 1e-9
    assert np.abs(found.error_mm - 0.5).max() < 1e-9
    samples = path.points(s)
    crossing = [
        np.linalg.norm(samples - point, axis=1).min() for point in path.points(behind[::50]) + 0.5 * left[::50]
    ]
    assert min(crossing) < 0.4  # another branch is nearer somewhere


def test_a_large_lag_through_a_tight_turn_is_followed():
    path = parse_gcode("G1 X100\nG3 Y20 J10\nG1 X0")
    s = np.arange(0.0, path.length_mm, 0.5)
    behind = np.maximum(s - 25.0, 0.0)
    found = contour_error(path, s, path.points(behind))
    assert np.abs(found.foot_mm - behind).max() < 1e-8


def test_behind_an_inner_corner_the_foot_leaves_the_leg_before():
    path = parse_gcode("G1 X10\nG1 Y10", blend_mm=0.0)
    s = np.linspace(9.0, 12.0, 3001)  # far shorter steps than the corner is cut by
    actual = np.column_stack([np.minimum(s, 10.0) - 0.1, np.maximum(s - 10.0, 0.0) + 0.1])
    nearest = np.minimum(actual[:, 1], 10.0 - actual[:, 0])
    assert np.abs(contour_error(path, s, actual).error_mm - nearest).max() < 1e-9


def test_outside_a_corner_the_error_is_the_distance_from_it():
    path = parse_gcode("G1 X10\nG1 Y10", blend_mm=0.0)
    found = contour_error(path, [9.0, 10.0, 20.0], [[13.0, -4.0], [10.5, 2.0], [10.0, 12.0]])
    assert found.foot_mm == pytest.approx([10.0, 12.0, 20.0], abs=1e-9)
    assert np.abs(found.error_mm) == pytest.approx([5.0, 0.5, 2.0], abs=1e-9)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.name)
@pytest.mark.parametrize("size_mm", [0.02, 0.3, 3.0])
def test_the_second_order_formula_is_exact_within_its_bound(path, size_mm):
    s, actual = reached(path, size_mm)
    off = np.abs(estimate(path, s, actual, Estimate.SECOND_ORDER) - contour_error(path, s, actual).error_mm)
    bound = second_order_bound(path, s, actual)
    stated = np.isfinite(bound)
    assert stated.mean() > 0.98
    assert (off[stated] <= bound[stated] + 1e-10).all()
    line = np.abs(estimate(path, s, actual, Estimate.LINE) - contour_error(path, s, actual).error_mm)
    assert np.median(bound[stated]) < 0.2 * np.median(line)


def test_at_the_centre_of_curvature_the_formula_has_no_answer():
    path = circle(10.0)
    assert np.isnan(estimate(path, [0.0], [[-1.0, 0.5]], Estimate.SECOND_ORDER)).all()
    assert np.isinf(second_order_bound(path, [0.0], [[5.0, 0.5]])).all()


def test_the_printed_formula_depends_on_the_unit_of_length():
    """In mm and in m the same points have different errors: the dimensions of the printed formula do not fit."""
    in_mm, in_m = circle(100.0), circle(0.1)
    s, actual = reached(in_mm, 1.0, 500)
    for formula in Estimate:
        one = estimate(in_mm, s, actual, formula)
        other = 1000.0 * estimate(in_m, s / 1000.0, actual / 1000.0, formula)
        assert np.allclose(one, other, rtol=1e-9, atol=1e-9, equal_nan=True) == (formula is not Estimate.AS_PRINTED)


def test_points_that_do_not_fit_are_refused():
    path = circle()
    for actual in ([[1.0, 2.0, 3.0]], [[1.0, 2.0]] * 2, [[math.nan, 0.0]], [[1e300, 0.0]]):
        with pytest.raises(ArgumentError, match="actual_mm"):
            contour_error(path, [0.0], actual)
