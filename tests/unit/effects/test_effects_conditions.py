"""The conditions of readings: columns of one length, parts that keep their time, distances since reversal."""

import numpy as np
import pytest

from rtec.effects import Conditions, distance_since_reversal
from rtec.errors import ArgumentError


def bare(rows=6, **others):
    facts = {"position": np.arange(float(rows)), "position_unit": "mm", "run": np.ones(rows, dtype=np.int64)}
    return Conditions(**{**facts, **others})


def walked_since_reversal(position, direction, run):
    """The same, reading by reading."""
    gone, begin = [], position[0]
    for i in range(len(position)):
        if i == 0 or direction[i] != direction[i - 1] or run[i] != run[i - 1]:
            begin = position[i]
        gone.append(abs(position[i] - begin))
    return gone


@pytest.mark.parametrize(
    "others",
    [
        {"direction": np.ones(5)},
        {"time_s": np.zeros(7)},
        {"temperatures": {"nut": np.zeros(3)}},
        {"position": np.zeros((6, 1))},
        {"position": np.empty(0), "run": np.empty(0, dtype=np.int64)},
    ],
    ids=["short direction", "long time", "temperature", "two-dimensional", "empty"],
)
def test_columns_that_do_not_fit_are_refused(others):
    with pytest.raises(ArgumentError, match="columns of one shape"):
        bare(**others)


def test_clock_is_time_or_row_order():
    assert bare().clock_unit == "reading"
    assert bare(first_row=10).clock.tolist() == [10, 11, 12, 13, 14, 15]
    timed = bare(time_s=np.arange(6) * 2.5)
    assert (timed.clock_unit, timed.clock[2]) == ("s", 5.0)


def test_places_are_distinct_beyond_the_rounding_of_files():
    c = bare(position=np.array([5.0, 0.0, 5.0 + 1e-7, 100.0, 5.001, 0.0]))
    assert c.places.tolist() == pytest.approx([0.0, 5.0, 5.001, 100.0], abs=1e-7)
    assert bare(position=np.full(6, 7.0)).places.tolist() == [7.0]


@pytest.mark.parametrize("direction, both", [([1, 1, -1], True), ([1, 0, 1], False), ([0, -1, -1], False)])
def test_both_directions(direction, both):
    assert bare(3, direction=np.array(direction, dtype=np.float64)).both_directions is both
    assert not bare().both_directions


def test_parts_keep_their_columns_and_their_place_in_time(bidirectional):
    heat = {"nut": np.linspace(20.0, 25.0, 210)}
    c = bidirectional(temperatures=heat, screw_pitch=6.35, time_s=None)
    rows = np.array([3, 60, 61, 209])
    part = c.take(rows).take(np.array([False, True, True, True]))
    rows = rows[1:]
    assert part.position.tolist() == c.position[rows].tolist()
    assert part.run.tolist() == c.run[rows].tolist()
    assert part.since_reversal.tolist() == c.since_reversal[rows].tolist()
    assert part.temperatures["nut"].tolist() == heat["nut"][rows].tolist()
    assert part.clock.tolist() == rows.tolist()
    assert part.screw_pitch == 6.35


def test_distance_since_reversal_against_a_walk(bidirectional):
    c = bidirectional()
    gone = distance_since_reversal(c.position, c.direction, c.run)
    assert gone.tolist() == walked_since_reversal(c.position, c.direction, c.run)
    assert gone.max() == pytest.approx(394.0)
    assert gone[42] == 0.0, "a run begins as after a reversal"


def test_a_run_in_the_same_direction_begins_anew():
    position, run = np.array([0.0, 5.0, 10.0, 1.0, 7.0]), np.array([1, 1, 1, 2, 2])
    assert distance_since_reversal(position, np.ones(5), run).tolist() == [0.0, 5.0, 10.0, 0.0, 6.0]


def test_places_of_the_axis_reversed_are_the_places_reversed():
    position = np.array([0.0, 1e-5, 50.0, 100.0 - 2e-5, 100.0])
    here, there = (
        Conditions(position=x, position_unit="mm", run=np.ones(5, dtype=np.int64)) for x in (position, -position)
    )
    assert here.places.size == 3
    assert np.array_equal(there.places, -here.places[::-1])
