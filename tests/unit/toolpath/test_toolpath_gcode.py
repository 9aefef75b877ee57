import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from rtec.errors import ArgumentError, FileFormatError
from rtec.toolpath import parse_gcode, read_gcode, read_path

QUARTER = 5.0 * math.pi


@pytest.mark.parametrize(
    "program, length_mm, end",
    [
        ("G0 X10\nG3 X0 Y10 I-10", QUARTER, (0, 10)),
        ("G0 X10\nG3 X0 Y10 R10", QUARTER, (0, 10)),
        ("G0 X10\nG2 X0 Y10 I-10", 3 * QUARTER, (0, 10)),
        ("G0 X10\nG3 X20 Y10 R-10", 3 * QUARTER, (20, 10)),
        ("G0 X10\nG2 I-10 J0", 4 * QUARTER, (10, 0)),
        ("G90 G0 X10\nG91 G3 X-10 Y10 I-10", QUARTER, (0, 10)),
        ("G20 G91 G1 X1 (inch)\nG21 X-5.4 ; mm\nM2\nX100 nonsense", 25.4 + 5.4, (20, 0)),
        ("%\nN10 G17 G90 G94\nN20 g01 x3 y4 f100\n%", 5.0, (3, 4)),
    ],
)
def test_moves_are_as_long_as_they_should_be(program, length_mm, end):
    path = parse_gcode(program, blend_mm=0.0)
    assert path.length_mm == pytest.approx(length_mm, rel=1e-12)
    assert path.points([path.length_mm])[0] == pytest.approx(end, abs=1e-10)


def test_an_arc_keeps_its_radius_and_the_side_of_its_turn():
    for word, sign in (("G2", -1.0), ("G3", 1.0)):
        path = parse_gcode(f"{word} X7 Y3 R20", blend_mm=0.0)
        s = np.linspace(0.0, path.length_mm, 100)
        assert np.allclose(path.curvature(s), sign / 20.0, rtol=1e-9)


def test_a_rising_arc_is_a_helix():
    path = parse_gcode("G0 X10 Z1\nG3 X10 I-10 Z6", blend_mm=0.0)
    assert path.dimensions == 3
    s = np.linspace(0.0, path.length_mm, 1000)
    angle = 2.0 * math.pi * s / path.length_mm
    helix = np.column_stack([10.0 * np.cos(angle), 10.0 * np.sin(angle), 1.0 + 5.0 * s / path.length_mm])
    assert np.abs(path.points(s) - helix).max() < 1e-8
    assert path.length_mm == pytest.approx(math.hypot(20.0 * math.pi, 5.0), abs=1e-8)


@pytest.mark.parametrize("tolerance_mm", [1.0, 0.05, 1e-3])
@pytest.mark.parametrize(
    "program",
    ["G1 X50\nG1 X60 Y40", "G1 X50\nG3 X70 Y20 J20\nG1 Y60", "G1 X50\nG2 X60 Y-5 R30", "G1 X20 Z3\nX40 Y9\nX50 Z9"],
)
def test_blended_corners_keep_their_tolerance_and_have_no_jump_of_curvature(program, tolerance_mm):
    sharp, path = parse_gcode(program, blend_mm=0.0), parse_gcode(f"G64 P{tolerance_mm}\n{program}", blend_mm=0.0)
    assert sharp.corners_mm.size
    assert not path.corners_mm.size
    sharp_points = cKDTree(sharp.points(np.linspace(0.0, sharp.length_mm, 1_000_001)))
    off = sharp_points.query(path.points(np.linspace(0.0, path.length_mm, 20_001)))[0].max()
    assert 0.03 * tolerance_mm < off <= 1.005 * tolerance_mm
    assert path.length_mm < sharp.length_mm
    ends = [path.points([0.0, path.length_mm]), sharp.points([0.0, sharp.length_mm])]
    assert np.allclose(*ends, atol=1e-12)


def test_a_turn_on_the_spot_stays_a_corner():
    path = parse_gcode("G1 X10\nX0\nY5", blend_mm=0.1)
    assert path.corners_mm.tolist() == [10.0]


def test_g61_ends_blending():
    path = parse_gcode("G64 P0.1\nG1 X10\nG1 Y10\nG61 G1 X0\nG1 Y0")
    assert path.corners_mm == pytest.approx([path.length_mm - 10.0], abs=1e-9)
    assert path.closed


def test_feeds_are_limits_of_their_blocks():
    path = parse_gcode("G0 X5\nG1 X10 F600\nG0 X20\nG1 X30\nG20 F10 X2", blend_mm=0.0)
    assert path.points([0.0])[0] == pytest.approx([5.0, 0.0])  # the rapid before leads to the beginning
    assert path.feed_limit_mm_s([1.0, 6.0, 16.0, 26.0]).tolist() == pytest.approx([10.0, math.inf, 10.0, 25.4 / 6])
    assert path.feed_limit_mm_s([5.0], side=-1).tolist() == [10.0]
    assert parse_gcode("G1 X1").feed_limit_mm_s([0.5]).tolist() == [math.inf]


@pytest.mark.parametrize(
    "line, said",
    [
        ("G1 X1 T3", "T3 is not understood"),
        ("G1 X1 M3", "M3 is not understood"),
        ("G18", "G18 is not understood"),
        ("#1=3", "not understood"),
        ("X1", "a move before"),
        ("G1 X1 X2", "X stands twice"),
        ("G0 G1 X1", "G0 and G1 contradict"),
        ("G1 X1e9", "not understood"),
        ("G1 X999999", "within 100000 mm"),
        ("G1 X1 F0", "feed of 0"),
        ("G1 X1 I3", "straight line"),
        ("I3", "without an arc"),
        ("G1 X1 P3", "P without G64"),
        ("G64 P-1", "tolerance of -1"),
        ("G2 X5", "without a centre"),
        ("G2 X5 I1 R3", "with two"),
        ("G2 X10 R1", "radius 1 mm with ends 10 mm apart"),
        ("G2 R1 X0 Y0", "0 mm apart"),
        ("G2 X10 I3", "begins with radius 3 mm and ends with 7 mm"),
        ("G2 X0 Y0 I0", "radius 0 mm"),
    ],
)
def test_what_is_not_understood_is_named_with_its_line(line, said):
    with pytest.raises(FileFormatError, match=said) as caught:
        parse_gcode(f"(first)\n{line}", source="part.nc")
    assert "part.nc, line 2: " in str(caught.value)


def test_a_program_without_a_feed_move_is_no_path(tmp_path):
    file = tmp_path / "part.NGC"
    file.write_text("G0 X10\nM30\n")
    with pytest.raises(FileFormatError, match="no feed move"):
        read_path(str(file))
    file.write_text("G1 X10 Y5\n")
    assert read_gcode(file).name == "part.NGC"
    with pytest.raises(ArgumentError, match="blend_mm"):
        read_gcode(file, blend_mm=-1.0)
