"""Toolpaths on emulated drives: the contour error, F words, space, and a limit that is kept."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.toolpath import circle, parse_gcode
from rtec.toolpath.contouring import run_contour

RADIUS_MM = 10.0


@pytest.fixture(scope="module")
def free():
    return run_contour(circle(RADIUS_MM), "ball-screw")


def test_the_contour_error_of_a_circle_is_the_radius_less_its_own(free):
    place = [run.load_mm for run in free.axes.values()]
    centre = circle(RADIUS_MM).points(np.linspace(0.0, free.path.length_mm, 8, endpoint=False)).mean(axis=0)
    off = np.hypot(place[0] - centre[0], place[1] - centre[1]) - RADIUS_MM
    assert np.abs(free.contour_mm) == pytest.approx(np.abs(off), abs=1e-8)
    assert 1e-3 < np.abs(off).max() < 0.1
    assert free.limits_held
    assert free.document()["max_following_um"] > free.document()["max_contour_um"]


def test_a_limit_is_kept_and_is_quicker_than_a_constant_feed(free):
    limit = 0.6 * float(np.abs(free.contour_mm).max())
    run = run_contour(free.path, "ball-screw", limit_mm=limit)
    assert run.limits_held
    assert np.abs(run.contour_mm).max() <= limit
    feed, lasts = run.steady
    assert free.plan.time_s == run.unlimited_s < run.plan.time_s <= lasts
    assert feed > 0.0


def test_a_run_within_a_limit_has_the_corrector_at_any_feed(free):
    def wave(time_s):
        return 0.002 * np.sin(2.0 * np.pi * 5.0 * time_s)

    limit = 0.6 * float(np.abs(free.contour_mm).max())
    run = run_contour(free.path, "ball-screw", limit_mm=limit, corrector={"x": wave})
    x = run.axes["x"]
    assert run.limits_held
    assert x.actual_mm - x.load_mm == pytest.approx(wave(x.time_s), abs=2e-4)


def test_f_words_bound_the_feed():
    path = parse_gcode("G21 G90 G0 X0 Y0\nG1 X20 F600\nY10 F1200\n")
    plan = run_contour(path, "linear-motor").plan
    feed = plan.at(np.linspace(0.0, plan.time_s, 3001))[1]
    place = plan.at(np.linspace(0.0, plan.time_s, 3001))[0]
    assert feed[place < 19.5].max() == pytest.approx(10.0, rel=1e-3)
    assert feed[place > 20.5].max() == pytest.approx(20.0, rel=2e-3)


def test_a_path_in_space_has_a_drive_in_each_axis():
    run = run_contour(parse_gcode("G21 G90 G0 X0 Y0 Z0\nG1 X20 Y5 Z8 F3000\n"), "ball-screw")
    assert list(run.axes) == ["x", "y", "z"]
    assert run.axes["z"].command_mm[-1] == pytest.approx(8.0)
    assert set(run.shares) >= {"velocity z", "jerk x"}


def test_what_a_corrector_inserts_moves_the_carriage():
    path = parse_gcode("G21 G90 G0 X0 Y0\nG1 X20 Y5 F3000\n")
    plain = run_contour(path, "linear-motor")
    moved = run_contour(path, "linear-motor", corrector={"x": lambda time_s: np.full(time_s.shape, 0.010)})
    settled = slice(-20, None)
    off = moved.axes["x"].load_mm[settled] - plain.axes["x"].load_mm[settled]
    assert np.abs(off) == pytest.approx(0.010, abs=1e-4)


def test_a_path_that_takes_hours_is_refused():
    with pytest.raises(ArgumentError, match="at most 5000 s"):
        run_contour(parse_gcode("G21 G90 G0 X0 Y0\nG1 X100 F0.1\n"), "ball-screw")


@pytest.mark.parametrize(("drive", "limit"), [("belt", None), ("ball-screw", 0.0), ("ball-screw", float("nan"))])
def test_drives_and_limits_that_are_none(drive, limit):
    with pytest.raises(ArgumentError):
        run_contour(circle(RADIUS_MM), drive, limit_mm=limit)
