"""The contour error that models of motion predict, and a feed that is lowered by it."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors.linear_models import ServoLag
from rtec.predictors.motion_file import KnownMotion, head_of
from rtec.toolpath import circle
from rtec.toolpath.contouring import run_contour

RADIUS_MM = 40.0


def lag(um_per_mm_s, names=("velocity", "acceleration"), unit="um", observe="following_error"):
    model = ServoLag(names=names, period_s=1e-3, unit=unit, per_velocity=um_per_mm_s)
    return KnownMotion(model=model, head=head_of(model, observe), name="servo lag")


@pytest.fixture(scope="module")
def free():
    return run_contour(circle(RADIUS_MM), "ball-screw", models={"x": lag(2.0), "y": lag(2.0)})


def test_axes_that_lag_alike_run_on_a_smaller_circle(free):
    v = free.plan.at(free.time_s)[1]
    steady = (free.s_mm > 60.0) & (free.s_mm < 180.0)
    # behind by t = 2 us/mm per mm/s: r' = sqrt(r^2 + (v t)^2), outwards along the tangent
    off = np.hypot(RADIUS_MM, 2e-3 * v) - RADIUS_MM
    assert np.abs(free.predicted_mm)[steady] == pytest.approx(off[steady], rel=0.02)
    rms_um, share = free.prediction
    assert rms_um == pytest.approx(1e3 * np.sqrt(np.mean((free.predicted_mm - free.contour_mm) ** 2)))
    assert share == pytest.approx(1e-3 * rms_um / free.following_mm.max())


def test_a_deviation_in_mm_predicts_the_same(free):
    models = {"x": lag(-2e-3, unit="mm", observe="deviation"), "y": lag(2.0)}
    again = run_contour(circle(RADIUS_MM), "ball-screw", models=models)
    assert again.predicted_mm == pytest.approx(free.predicted_mm, abs=1e-9)


def test_a_model_that_expects_far_too_much_is_slower_than_a_constant_feed_which_is_taken(free):
    limit = 0.9 * free.worst_mm
    by_drive = run_contour(circle(RADIUS_MM), "ball-screw", limit_mm=limit)
    timid = {letter: lag(20.0) for letter in "xy"}
    run = run_contour(circle(RADIUS_MM), "ball-screw", limit_mm=limit, models=timid)
    assert run.limits_held
    assert run.worst_mm <= limit
    assert by_drive.plan.time_s < run.plan.time_s == run.steady[1]


@pytest.mark.parametrize(
    ("models", "says"),
    [
        ({"x": lag(2.0)}, "none of axis y"),
        ({"x": lag(2.0), "y": lag(2.0, names=("velocity", "acceleration", "current"))}, "with the input current"),
        ({"x": lag(2.0), "y": lag(2.0, unit="A", observe="current")}, "the following error, in um or mm"),
    ],
)
def test_models_that_cannot_predict_a_plan(models, says):
    with pytest.raises(ArgumentError, match=says):
        run_contour(circle(RADIUS_MM), "ball-screw", models=models)
