from dataclasses import replace
from pathlib import Path

import pytest

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology import (
    AxisMeasure,
    Comment,
    Dwell,
    MachineAxis,
    MeasuringPlan,
    Move,
    Setup,
    Stop,
    StopKind,
    measuring_program,
    parse_program,
)
from rtec.metrology.number_format import vb_format

LISTING = (Path(__file__).parent / "appendix_b_listing.txt").read_text(encoding="utf-8").splitlines()
"""The listing printed in the thesis, Appendix B, for the parameters of Figure 4.3."""

FIGURE_4_3 = MeasuringPlan(
    start_inch=1, end_inch=7, increment_inch=1, dwell_s=2, runs=3, feed_inch_min=50, overshoot_inch=0.1
)
CALIBRATION = replace(FIGURE_4_3, end_inch=40, increment_inch=0.025, dwell_s=6, runs=4)
PREAMBLE = ["G70", "G01G59G90G94", "G53Z1.0F50."]


def test_listing_of_the_thesis_comes_out_line_for_line():
    assert len(LISTING) == 105
    assert measuring_program(FIGURE_4_3) == LISTING


def test_calibration_has_12488_readings_at_1561_targets():
    assert CALIBRATION.number_of_readings == 12488
    assert CALIBRATION.targets_inch.size == 1561
    assert CALIBRATION.targets_inch[[0, 1, -1]].tolist() == [1.0, 1.025, 40.0]


def test_added_up_positions_are_formatted_to_four_decimals():
    program = measuring_program(replace(CALIBRATION, runs=1))
    moves = [line for line in program if line.startswith("G53")]
    assert moves[3:6] == ["G53Z1.025", "G53Z1.05", "G53Z1.075"]
    assert moves[3 + 1559 : 3 + 1563] == ["G53Z40.0", "G53Z40.1", "G53Z40.0", "G53Z39.975"]
    assert moves[-1] == "G53Z1.0"


@pytest.mark.parametrize(
    ("value", "pattern", "text"),
    [
        (50.0, "##.#", "50."),
        (0.1, "##.#", ".1"),
        (12.25, "##.#", "12.3"),  # half away from zero, not to even
        (2.5, "##", "3"),
        (123.0, "##", "123"),
        (0.0, "##", ""),
        (0.00005, "##0.0###", "0.0001"),
        (1.00005, "##0.0###", "1.0001"),  # the double lies below: Visual Basic looks at 15 digits
        (1.0000000000000002, "##0.0###", "1.0"),
        (-0.9, "##0.0###", "-0.9"),
        (-1e-16, "##0.0###", "0.0"),
        (1234.5, "##0.0###", "1234.5"),
        (7.0, "000.00", "007.00"),
    ],
)
def test_visual_basic_format(value, pattern, text):
    assert vb_format(value, pattern) == text


@pytest.mark.parametrize(("value", "pattern"), [(1.0, "0,0"), (float("nan"), "0"), (1e15, "0")])
def test_visual_basic_format_refuses(value, pattern):
    with pytest.raises(ArgumentError):
        vb_format(value, pattern)


def test_diameter_axis_gets_g07_first_and_the_letter_follows_the_number():
    axis = MachineAxis(number=1, measure=AxisMeasure.DIAMETER)
    program = measuring_program(replace(FIGURE_4_3, axis=axis))
    assert program[:2] == ["G07", "G70"]
    assert program[3] == "G53X1.0F50."


BAD_IN_ORDER = [
    ("axis.number", {"axis": MachineAxis(number=0)}),
    ("axis.number", {"axis": MachineAxis(number=2, letters="XZ")}),
    ("start_inch", {"start_inch": 7}),
    ("start_inch", {"start_inch": -0.5}),
    ("end_inch", {"end_inch": 41.5}),
    ("increment_inch", {"increment_inch": 0.00009}),
    ("increment_inch", {"increment_inch": 6.5}),
    ("increment_inch", {"increment_inch": 0.7}),
    ("dwell_s", {"dwell_s": 0.9}),
    ("dwell_s", {"dwell_s": 99.5}),
    ("runs", {"runs": 0}),
    ("runs", {"runs": 100}),
    ("runs", {"runs": 1.5}),
    ("feed_inch_min", {"feed_inch_min": 0.05}),
    ("feed_inch_min", {"feed_inch_min": 50.1}),
    ("overshoot_inch", {"overshoot_inch": 0}),
    ("overshoot_inch", {"overshoot_inch": 1.01}),
    ("overshoot_inch", {"start_inch": 0, "overshoot_inch": 0.1}),
    ("overshoot_inch", {"end_inch": 41, "overshoot_inch": 0.1}),
]


@pytest.mark.parametrize(("name", "change"), BAD_IN_ORDER)
def test_each_check_of_the_macro(name, change):
    with pytest.raises(ArgumentError) as caught:
        replace(FIGURE_4_3, **change)
    assert caught.value.name == name


def test_checks_come_in_the_order_of_the_macro():
    wrong = {
        "axis": MachineAxis(number=5),
        "start_inch": 50,
        "increment_inch": 0,
        "dwell_s": 0,
        "runs": 0,
        "feed_inch_min": 0,
        "overshoot_inch": 0,
    }
    corrected = {
        "axis": MachineAxis(),
        "start_inch": 1,
        "increment_inch": 1,
        "dwell_s": 2,
        "runs": 3,
        "feed_inch_min": 50,
    }
    for key, expected in zip([None, *corrected], ["axis.number", *list(wrong)[1:]], strict=True):
        if key is not None:
            wrong[key] = corrected[key]
        with pytest.raises(ArgumentError) as caught:
            replace(FIGURE_4_3, **wrong)
        assert caught.value.name == expected


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "7", None, True])
def test_plan_refuses_what_is_no_finite_number(value):
    with pytest.raises(ArgumentError, match="end_inch"):
        replace(FIGURE_4_3, end_inch=value)


def test_limits_of_the_axis_are_inside_what_the_program_can_hold():
    with pytest.raises(ArgumentError, match="maximum_inch"):
        MachineAxis(maximum_inch=1e300)
    with pytest.raises(ArgumentError, match="maximum_inch"):
        MachineAxis(minimum_inch=3, maximum_inch=3)


def test_a_million_targets_are_the_limit():
    axis = MachineAxis(minimum_inch=-5000, maximum_inch=5000)
    with pytest.raises(ArgumentError, match="1000000 targets"):
        replace(FIGURE_4_3, axis=axis, end_inch=4000, increment_inch=0.0001)


def test_parser_reads_the_listing_of_the_thesis():
    blocks = parse_program(LISTING)
    assert len(blocks) == 105
    assert blocks[:2] == [Setup(1, ("G70",)), Setup(2, ("G01", "G59", "G90", "G94"))]
    moves = [block for block in blocks if isinstance(block, Move)]
    forward_and_back = [2, 3, 4, 5, 6, 7, 7.1, 7, 6, 5, 4, 3, 2, 1]
    assert [move.position_inch for move in moves] == [1.0, *[0.9, 1, *forward_and_back] * 3]
    assert {(move.axis, move.feed_inch_min) for move in moves} == {("Z", 50.0)}
    assert sum(block.duration_s for block in blocks if isinstance(block, Dwell)) == 2 * (15 * 3 + 2)
    stops = [block for block in blocks if isinstance(block, Stop)]
    assert [stop.kind for stop in stops] == [StopKind.PROGRAM] + [StopKind.OPTIONAL] * 3
    assert stops[0].comment == "Program Stop for Zero Laser"
    assert blocks[7] == Comment(8, "Measurement run: 1")


def test_parser_passes_over_empty_lines_but_counts_them():
    blocks = parse_program(["G70", "", "G01G59G90G94 (modes)", "  ", "G53Z-1.5F.5"])
    assert blocks[-1] == Move(5, "Z", -1.5, 0.5)


@pytest.mark.parametrize(
    ("lines", "line", "words"),
    [
        ([*PREAMBLE, "G00Z2."], 4, "not understood"),
        ([*PREAMBLE, "G53Z2.0 (open"], 4, "not understood"),
        ([*PREAMBLE, "G53Z1e3"], 4, "not understood"),
        ([*PREAMBLE, "G53Z9999999"], 4, "not understood"),
        ([*PREAMBLE, "G04F0"], 4, "dwell of 0 s"),
        ([*PREAMBLE, "G04F-2"], 4, "dwell of -2 s"),
        ([*PREAMBLE, "G53Z2.F0"], 4, "feed of 0"),
        ([*PREAMBLE, "G53X2."], 4, "axis X after Z"),
        (["G70", "G01G59G90G94", "G53Z1.0"], 3, "before any feed"),
        (["G01G59G90G94", "G53Z1.0F5."], 2, "before the unit"),
        (["G70", "G01", "G53Z1.0F5."], 3, "before G59, G90, G94"),
        (["G70", "M30"], 2, "not understood"),
        (["G70"], None, "moves no axis"),
        ([], None, "moves no axis"),
        (["G70\0"], 1, "not understood"),
    ],
)
def test_parser_refuses(lines, line, words):
    with pytest.raises(FileFormatError, match=words) as caught:
        parse_program(lines, source="laserSub.txt")
    assert caught.value.line == line
    assert "\n" not in str(caught.value)
