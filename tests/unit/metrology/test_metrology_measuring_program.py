from dataclasses import replace
from pathlib import Path

import pytest

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology import Dwell, MachineAxis, MeasuringPlan, Move, measuring_program, parse_program
from rtec.metrology.measuring_plan import AxisMeasure
from rtec.metrology.measuring_program import Stop

LISTING = (Path(__file__).parent / "appendix_b_listing.txt").read_text(encoding="utf-8").splitlines()
"""The listing printed in the thesis, Appendix B, for the parameters of Figure 4.3."""

FIGURE_4_3 = MeasuringPlan(
    start_mm=25.4, end_mm=177.8, increment_mm=25.4, dwell_s=2, runs=3, feed_mm_s=50 * 25.4 / 60, overshoot_mm=2.54
)
CALIBRATION = replace(FIGURE_4_3, end_mm=1016, increment_mm=0.635, dwell_s=6, runs=4)
PREAMBLE = ["G70", "G01G59G90G94", "G53Z1.0F50."]


def test_listing_of_the_thesis_comes_out_line_for_line():
    assert len(LISTING) == 105
    assert measuring_program(FIGURE_4_3) == LISTING


def test_calibration_has_12488_readings_at_1561_targets():
    assert CALIBRATION.number_of_readings == 12488
    assert CALIBRATION.targets_mm.size == 1561
    assert CALIBRATION.targets_mm[[0, 1, -1]].tolist() == [25.4, 1.025 * 25.4, 1016.0]


def test_added_up_positions_are_formatted_to_four_decimals():
    program = measuring_program(replace(CALIBRATION, runs=1))
    moves = [line for line in program if line.startswith("G53")]
    assert moves[3:6] == ["G53Z1.025", "G53Z1.05", "G53Z1.075"]
    assert moves[3 + 1559 : 3 + 1563] == ["G53Z40.0", "G53Z40.1", "G53Z40.0", "G53Z39.975"]
    assert moves[-1] == "G53Z1.0"


@pytest.mark.parametrize(
    ("start", "text"),
    [
        (1.00005, "1.0001"),  # half away from zero; the double lies below: Visual Basic looks at 15 digits
        (1.0000000000000002, "1.0"),
        (-0.9, "-0.9"),
        (-1e-12, "0.0"),
        (1234.5, "1234.5"),
        (7.0, "7.0"),
    ],
)
def test_positions_are_written_as_visual_basic_does(start, text):
    axis = MachineAxis(minimum_mm=-25400.0, maximum_mm=76200.0)
    plan = replace(FIGURE_4_3, axis=axis, start_mm=start * 25.4, end_mm=start * 25.4 + 25.4, increment_mm=25.4)
    assert measuring_program(plan)[2] == f"G53Z{text}F50."


@pytest.mark.parametrize(
    ("feed", "dwell", "words"), [(50.0, 2, ("F50.", "F2")), (0.1, 99, ("F.1", "F99")), (12.25, 2.5, ("F12.3", "F3"))]
)
def test_feeds_and_dwells_are_written_as_visual_basic_does(feed, dwell, words):
    program = measuring_program(replace(FIGURE_4_3, feed_mm_s=feed * 25.4 / 60, dwell_s=dwell))
    assert program[2:5] == [f"G53Z1.0{words[0]}", f"G53Z0.9{words[0]}", f"G04{words[1]}"]


def test_diameter_axis_gets_g07_first_and_the_letter_follows_the_number():
    axis = MachineAxis(number=1, measure=AxisMeasure.DIAMETER)
    program = measuring_program(replace(FIGURE_4_3, axis=axis))
    assert program[:2] == ["G07", "G70"]
    assert program[3] == "G53X1.0F50."


BAD_IN_ORDER = [
    ("axis.number", {"axis": MachineAxis(number=0)}),
    ("axis.number", {"axis": MachineAxis(number=2, letters="XZ")}),
    ("start_mm", {"start_mm": 177.8}),
    ("start_mm", {"start_mm": -12.7}),
    ("end_mm", {"end_mm": 1054.1}),
    ("increment_mm", {"increment_mm": 0.002286}),
    ("increment_mm", {"increment_mm": 165.1}),
    ("increment_mm", {"increment_mm": 17.78}),
    ("dwell_s", {"dwell_s": 0.9}),
    ("dwell_s", {"dwell_s": 99.5}),
    ("runs", {"runs": 0}),
    ("runs", {"runs": 100}),
    ("runs", {"runs": 1.5}),
    ("feed_mm_s", {"feed_mm_s": 0.05 * 25.4 / 60}),
    ("feed_mm_s", {"feed_mm_s": 50.1 * 25.4 / 60}),
    ("overshoot_mm", {"overshoot_mm": 0}),
    ("overshoot_mm", {"overshoot_mm": 25.654}),
    ("overshoot_mm", {"start_mm": 0, "overshoot_mm": 2.54}),
    ("overshoot_mm", {"end_mm": 1041.4, "overshoot_mm": 2.54}),
]


@pytest.mark.parametrize(("name", "change"), BAD_IN_ORDER)
def test_each_check_of_the_macro(name, change):
    with pytest.raises(ArgumentError) as caught:
        replace(FIGURE_4_3, **change)
    assert caught.value.name == name


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "7", None, True])
def test_plan_refuses_what_is_no_finite_number(value):
    with pytest.raises(ArgumentError, match="end_mm"):
        replace(FIGURE_4_3, end_mm=value)


def test_limits_of_the_axis_are_inside_what_the_program_can_hold():
    with pytest.raises(ArgumentError, match="maximum_mm"):
        MachineAxis(
            maximum_mm=25399999999999998359587093526626148720968505660346122272342291215210864321374549541092518606234628656373463881042549326096892509792208835712207230403770941782687872698745773848999207043467869602135151743572784578126668858886903666218398765910855443048115292538713277783997927096305962578851971144351744
        )
    with pytest.raises(ArgumentError, match="maximum_mm"):
        MachineAxis(minimum_mm=76.2, maximum_mm=76.2)


def test_a_million_targets_are_the_limit():
    axis = MachineAxis(minimum_mm=-127000, maximum_mm=127000)
    with pytest.raises(ArgumentError, match="1000000 targets"):
        replace(FIGURE_4_3, axis=axis, end_mm=101600, increment_mm=0.00254)


def test_parser_reads_the_listing_of_the_thesis():
    blocks = parse_program(LISTING)
    modes_and_comments = [1, 2, *(8 + 34 * run for run in range(3))]
    assert [block.line for block in blocks] == [line for line in range(1, 106) if line not in modes_and_comments]
    moves = [block for block in blocks if isinstance(block, Move)]
    forward_and_back = [2, 3, 4, 5, 6, 7, 7.1, 7, 6, 5, 4, 3, 2, 1]
    assert [move.position_mm / 25.4 for move in moves] == pytest.approx([1.0, *[0.9, 1, *forward_and_back] * 3])
    assert {(move.axis, move.feed_mm_s) for move in moves} == {("Z", 50.0 * 25.4 / 60.0)}
    assert sum(block.duration_s for block in blocks if isinstance(block, Dwell)) == 2 * (15 * 3 + 2)
    stops = [block.line for block in blocks if isinstance(block, Stop)]
    assert stops == [line for line, text in enumerate(LISTING, 1) if text.startswith(("M00", "M01"))]


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
