"""Several axes in one program: straight lines that all of them follow together."""

import pytest

from rtec.axis.command import Move
from rtec.axis.servo import Servo
from rtec.errors import ArgumentError
from rtec.machine.cell import Cell
from rtec.machine.faults import Fault, FaultKind
from rtec.machine.station import Alarm, StationSettings
from rtec.predictors import NoError

MS, S = 10**9, 10**12
COUNT_MM = StationSettings().encoder.count_mm
THERE = Move(target_mm=(30.0, 40.0), speed_mm_s=10.0, rest_s=0.5)
TRIANGLE = [THERE, Move(target_mm=(30.0, 0.0), speed_mm_s=20.0), Move(target_mm=(0.0, 0.0), speed_mm_s=20.0)]


def cell_with(lines, *faults, axes=2):
    return Cell([StationSettings(axis=axis + 1) for axis in range(axes)], lines, NoError(), faults=faults)


def places(cell):
    return [axis.view.position_mm for axis in cell.axes]


def test_both_axes_are_on_the_line_at_every_time():
    cell = cell_with([THERE])
    for k in range(1, 60):
        cell.run(until_ps=100 * k * MS)
        x, y = places(cell)
        assert abs(4.0 * x - 3.0 * y) / 5.0 < COUNT_MM
    assert (x, y) == pytest.approx((30.0, 40.0), abs=0.001)


def test_a_line_takes_as_long_as_its_length_asks_for():
    """length / speed + speed / acceleration, at the default of 500 mm/s², but for the 4 ms between two looks."""
    cell = cell_with(TRIANGLE)
    over = [0] * 4
    while over[3] == 0:
        cell.run(until_ps=cell.now_ps + 4 * MS)
        moves = {axis.view.counters.moves for axis in cell.axes}
        assert len(moves) == 1  # nobody is ahead of the other
        over[max(moves)] = over[max(moves)] or cell.now_ps
    assert over[2] - over[1] == pytest.approx(2.04 * S, abs=8 * MS)
    assert over[3] - over[2] == pytest.approx(1.54 * S, abs=8 * MS)


@pytest.mark.parametrize("axis", [1, 2])
def test_where_one_box_dies_both_axes_stop_on_the_line(axis):
    cell = cell_with([THERE], Fault(kind=FaultKind.POWER_LOST, place=axis, from_ps=2_012_345_678_901))
    cell.run(until_ps=4 * S)
    x, y = places(cell)
    assert abs(4.0 * x - 3.0 * y) / 5.0 < COUNT_MM
    assert 10.0 < x < 20.0
    assert cell.held_ps is not None
    assert [outcome.view.alarm for outcome in cell.axes] == [Alarm.NONE, Alarm.NONE]
    assert [outcome.view.speed_mm_s for outcome in cell.axes] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("moves", "said"),
    [
        ([Move(target_mm=(1.0,), speed_mm_s=1.0)], "1 axes"),
        ([THERE, [Move(target_mm=1.0, speed_mm_s=1.0)]], "lines alone"),
    ],
)
def test_what_is_no_program_of_all_axes_is_refused(moves, said):
    with pytest.raises(ArgumentError, match=said):
        cell_with(moves)


def test_axes_that_do_not_accelerate_alike_cannot_follow_lines():
    stations = [StationSettings(), StationSettings(axis=2, servo=Servo(period_ps=500_000_000))]
    with pytest.raises(ArgumentError, match="one acceleration"):
        Cell(stations, [THERE], NoError())
