"""Direction, runs, cells and clock of readings at rest."""

import numpy as np
import pytest

from rtec.effects import Observable
from rtec.errors import FileFormatError


def rows(*columns):
    """Return rows of a CSV file."""
    return "\n".join(",".join(f"{value}" for value in row) for row in zip(*columns, strict=True)) + "\n"


def notes(data):
    return "\n".join(data.notes)


BIDIRECTIONAL = [0, 1, 2, 2, 1, 0]


def test_direction_column_goes_before_the_motion(load):
    data = load("direction,target_mm,actual_mm\n" + rows([-1] * 6, BIDIRECTIONAL, BIDIRECTIONAL))
    assert data.conditions.direction.tolist() == [-1] * 6
    data = load("target_mm,actual_mm\n" + rows(BIDIRECTIONAL, BIDIRECTIONAL))
    assert data.conditions.direction.tolist() == [1, 1, 1, -1, -1, -1]
    assert "sign of the motion" in notes(data)
    assert data.conditions.since_reversal.tolist() == [0, 1, 2, 0, 1, 2]


def test_no_direction_where_nothing_tells(load):
    assert load("time_s,deviation_um\n0,1\n1,2\n2,3\n").conditions.direction is None
    data = load("time_s,target_mm,deviation_um\n0,5,1\n100,5,2\n200,5,3\n")
    assert data.conditions.direction is None
    assert data.conditions.since_reversal is None
    assert "no direction" in notes(data)
    # one reading a run, or one run that moves and one that does not
    for text in ("1,5,1\n2,6,2\n3,7,3\n", "1,5,1\n1,6,2\n2,7,3\n2,7,3\n"):
        assert load("run,target_mm,deviation_um\n" + text).conditions.direction is None


def test_positions_held_in_one_sweep(load):
    data = load("actual_count,current_a\n" + rows(range(0, 160, 16), range(10)))
    assert data.observable is Observable.DRIVE
    assert not data.conditions.moving
    assert data.conditions.direction.tolist() == [1] * 10
    assert data.conditions.velocity is None
    assert not data.has_repeats


def test_cells_are_targets_and_directions_visited_by_several_runs(load):
    run = [1] * 6 + [2] * 5
    target = [*BIDIRECTIONAL, 0, 1.0000001, 2, 2, 1]
    data = load("run,target_mm,actual_mm\n" + rows(run, target, target))
    # forward 0, 1, 2 and back 2, 1 twice; back to 0 in one run only
    assert data.cell.tolist() == [0, 1, 2, 3, 4, -1, 0, 1, 2, 3, 4]


def test_another_feed_is_another_cell(load):
    run, feed = [1] * 3 + [2] * 3 + [3] * 3, [600] * 3 + [60] * 3 + [600] * 3
    data = load("run,target_mm,feed_mm_min,deviation_um\n" + rows(run, [0, 1, 2] * 3, feed, range(9)))
    assert data.cell.tolist() == [0, 1, 2, -1, -1, -1, 0, 1, 2]
    np.testing.assert_allclose(data.conditions.velocity, [10] * 3 + [1] * 3 + [10] * 3)
    assert not data.conditions.moving


def test_feed_takes_the_direction(load):
    data = load("target_mm,feed_mm_s,deviation_um\n" + rows(BIDIRECTIONAL, [2] * 6, range(6)))
    assert data.conditions.velocity.tolist() == [2, 2, 2, -2, -2, -2]
    assert data.conditions.acceleration is None


def test_time_of_readings_at_rest(load):
    run, clock = [1, 1, 1, 2, 2, 2], [5, 6, 8, 2, 3, 4]
    data = load("run,time_min,target_mm,deviation_um\n" + rows(run, clock, [0, 1, 2] * 2, range(6)))
    # the runs follow each other after the median interval, a minute
    assert data.conditions.time_s.tolist() == [0, 60, 180, 240, 300, 360]
    assert "starts again with each run" in notes(data)
    assert data.units.clock == "s"
    data = load("run,time_min,target_mm,deviation_um\n" + rows(run, [5, 6, 6, 7, 8, 9], [0, 1, 2] * 2, range(6)))
    assert data.conditions.time_s.tolist() == [0, 60, 60, 120, 180, 240]
    assert "starts again" not in notes(data)
    # without a column, the runs are found first, and their clocks chained
    data = load("time_min,target_mm,deviation_um\n" + rows([0, 1, 2, 0, 1, 2], [0, 1, 2] * 2, range(6)))
    assert data.conditions.time_s.tolist() == [0, 60, 120, 180, 240, 300]


@pytest.mark.parametrize("run", [None, [1, 1, 1, 1], [1, 1, 2, 2]])
def test_time_running_backwards_names_the_line(load, run):
    names = "time_s,target_mm,deviation_um\n"
    columns = [[0, 10, 30, 20], [0, 1, 2, 3], [1, 2, 3, 4]]
    text = names + rows(*columns) if run is None else "run," + names + rows(run, *columns)
    lines = text.split("\n")
    text = "\n".join(["# a: b", *lines[:2], "", *lines[2:]])
    with pytest.raises(FileFormatError, match=r"line 7: time runs backwards: 20 s after 30 s") as caught:
        load(text)
    assert caught.value.line == 7


def test_time_as_coordinate_chains_runs_too(load):
    data = load("run,time_s,deviation_arcsec\n" + rows([1, 1, 1, 2, 2, 2], [0, 2, 4, 0, 2, 4], range(6)))
    assert data.conditions.position.tolist() == [0, 2, 4, 6, 8, 10]
    assert data.conditions.time_is_coordinate
    assert data.conditions.revolution is None
    assert not data.has_repeats
