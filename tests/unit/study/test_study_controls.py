"""Tables of controls, read back and applied as the manuals say: value = error, so that it is subtracted."""

import re

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors import BidirectionalTable
from rtec.study.controls import (
    HEIDENHAIN_POINTS,
    SINUMERIK_POINTS,
    even_table,
    heidenhain_axis,
    heidenhain_lines,
    sinumerik_axis,
    sinumerik_lines,
    sinumerik_shift_lines,
)

PLACES = np.linspace(-20.0, 280.0, 6001)


def errors(x, way):
    return 0.005 * np.sin(2 * np.pi * x / 30.0) + 4e-5 * x + way * (0.003 + 1e-5 * x)


MACHINE = BidirectionalTable.on_grid(PLACES, errors(PLACES, 1), errors(PLACES, -1))
FINE = np.linspace(-20.0, 280.0, 3333)


def sinumerik(most=SINUMERIK_POINTS):
    table = even_table(MACHINE, -20.0, 280.0, within_mm=1e-4, most=most, both_ways=False)
    return table, list(sinumerik_lines(table, "AX2", ("first", "µ")))


def test_a_sinumerik_that_subtracts_the_table_keeps_what_is_said():
    table, lines = sinumerik()
    said = {found[1]: float(found[2]) for line in lines if (found := re.fullmatch(r"\$AA_ENC_COMP(.*)=(.*)", line))}
    first, step, last = said.pop("_MIN[0,AX2]"), said.pop("_STEP[0,AX2]"), said.pop("_MAX[0,AX2]")
    assert said.pop("_IS_MODULO[0,AX2]") == 0
    values = [said[f"[0,{k},AX2]"] for k in range(len(said))]
    assert last == pytest.approx(first + step * (len(values) - 1), abs=1e-6) and len(values) <= SINUMERIK_POINTS
    positions = first + step * np.arange(len(values))
    left = np.array([errors(FINE, way) - np.interp(FINE, positions, values) for way in (1, -1)])
    assert np.abs(left).max() == pytest.approx(table.left_max_mm, abs=2e-5)
    assert np.sqrt(np.mean(left**2)) == pytest.approx(table.left_rms_mm, rel=0.02)
    assert table.left_max_mm == pytest.approx(0.003 + 1e-5 * 280.0, abs=2e-4)  # half of the reversal error
    assert lines[0] == "%_N_AX2_EEC_INI" and lines[1] == "CHANDATA(1)" and lines[-1] == "M17"
    assert lines[2:4] == ["; first", "; u"]


def test_a_heidenhain_that_subtracts_the_column_of_its_direction_keeps_what_is_said():
    table = even_table(MACHINE, -20.0, 280.0, within_mm=5e-4, most=HEIDENHAIN_POINTS, both_ways=True)
    begin, head, *rows, end = heidenhain_lines(table, "Y", "Y_20.COM")
    assert (begin, head.split(), end) == ("BEGIN Y_20.COM MM", ["NR", "AXISPOS", "BACKLASH", "Y"], "[END]")
    found = np.array([list(map(float, row.split())) for row in rows])
    assert found[:, 0].tolist() == list(range(len(rows))) and len(rows) <= HEIDENHAIN_POINTS
    left = [errors(FINE, way) - np.interp(FINE, found[:, 1], found[:, k]) for way, k in ((1, 3), (-1, 2))]
    assert np.abs(left).max() == pytest.approx(table.left_max_mm, abs=2e-5)
    assert table.left_max_mm < 5.6e-4
    assert len({len(row) for row in [head[: head.index("Y")] + " " * 7, *rows]}) == 1  # columns stand in line


def test_with_too_few_points_more_is_left_and_said():
    few, many = sinumerik(most=9)[0], sinumerik()[0]
    assert few.forward_mm.size == 9 and few.left_rms_mm > many.left_rms_mm
    drawn = np.interp(FINE, few.position_mm, few.forward_mm)
    left = max(float(np.abs(errors(FINE, way) - drawn).max()) for way in (1, -1))
    assert few.left_max_mm == pytest.approx(left, abs=2e-5)


def test_a_shift_is_a_setting():
    assert list(sinumerik_shift_lines(-0.0125, "AX1", ("hot",)))[-2:] == [
        "$SA_TEMP_COMP_ABS_VALUE[AX1]=-0.012500",
        "M17",
    ]


@pytest.mark.parametrize(
    ("named", "wrong"),
    [(sinumerik_axis, "W"), (sinumerik_axis, "X;"), (heidenhain_axis, "AX1"), (heidenhain_axis, "")],
)
def test_an_axis_that_a_control_does_not_know_is_refused(named, wrong):
    with pytest.raises(ArgumentError, match="--axis"):
        named(wrong)
