"""Tables: the thesis's own, by hand, and everything that a table refuses."""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rtec.errors import ArgumentError
from rtec.predictors import FORWARD, REVERSE, BidirectionalTable, LatheNetwork, NoError, UnidirectionalTable

NAN = float("nan")

# thesis, Tables 3-1 to 3-3; the unit there is the inch, here it does not matter
ONE_WAY = UnidirectionalTable(
    positions_mm=[0, 1, 2, 3, 4, 5], errors_mm=[-0.001, -0.001, -0.001, 0, 0.001, 0.001], backlash_mm=-0.003
)
BOTH_WAYS = BidirectionalTable(
    forward_positions_mm=[0, 1, 2, 3, 4],
    forward_errors_mm=[0.001, 0.001, 0, -0.001, -0.002],
    reverse_positions_mm=[4, 3, 2, 1, 0],
    reverse_errors_mm=[-0.004, -0.003, -0.002, -0.001, -0.001],
)


@pytest.mark.parametrize(
    ("position", "forward"),
    [(0, -0.001), (2, -0.001), (2.25, -0.00075), (3, 0), (3.5, 0.0005), (5, 0.001), (-7, -0.001), (99, 0.001)],
)
def test_one_direction_and_backlash(position, forward):
    assert_allclose(ONE_WAY.error_mm(position, FORWARD), forward, atol=1e-17)
    assert_allclose(ONE_WAY.error_mm(position, REVERSE), forward - 0.003, atol=1e-17)


@pytest.mark.parametrize(
    ("position", "forward", "reverse"),
    [
        (0, 0.001, -0.001),
        (0.5, 0.001, -0.001),
        (1.75, 0.00025, -0.00175),
        (3, -0.001, -0.003),
        (4, -0.002, -0.004),
        (4.1, -0.002, -0.004),
        (-0.1, 0.001, -0.001),
    ],
)
def test_both_directions(position, forward, reverse):
    assert_allclose(BOTH_WAYS.error_mm(position, FORWARD), forward, atol=1e-17)
    assert_allclose(BOTH_WAYS.error_mm(position, REVERSE), reverse, atol=1e-17)


def test_a_descending_reverse_listing_is_turned_round():
    assert BOTH_WAYS.reverse_positions_mm.tolist() == [0, 1, 2, 3, 4]
    assert BOTH_WAYS.reverse_errors_mm.tolist() == [-0.001, -0.001, -0.002, -0.003, -0.004]


def test_directions_may_have_points_of_their_own():
    table = BidirectionalTable(
        forward_positions_mm=[0, 10],
        forward_errors_mm=[0, 1],
        reverse_positions_mm=[2, 4, 12],
        reverse_errors_mm=[5, 7, 7],
    )
    assert table.error_mm([5, 3, 0], [FORWARD, REVERSE, REVERSE]).tolist() == [0.5, 6.0, 5.0]
    assert table.range_mm == (2.0, 10.0)


@pytest.mark.parametrize(
    ("positions", "name", "value"),
    [
        ([0, 2, 1, 3], "positions_mm, row 3", "1 after 2"),
        ([0, 1, NAN, 3], "positions_mm, row 3", "nan"),
        ([0, 1, None, 3], "positions_mm, row 3", "nan"),
        ([0, 1, 2, 2e6], "positions_mm, row 4", "2e+06"),
        ([0], "positions_mm", "a column of 1"),
        ([], "positions_mm", "a column of 0"),
        ([[0, 1], [2, 3]], "positions_mm", "an array of shape (2, 2)"),
        (["a", "b"], "positions_mm", "['a', 'b']"),
        ([0, 1, 2], "errors_mm", "a column of 4"),
    ],
)
def test_bad_positions_name_row_and_value(positions, name, value):
    with pytest.raises(ArgumentError) as caught:
        UnidirectionalTable(positions_mm=positions, errors_mm=[0, 0, 0, 0], backlash_mm=0)
    assert (caught.value.name, str(caught.value.value)) == (name, value)


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"reverse_positions_mm": [2, 0, 1]}, "reverse_positions_mm, row 2"),
        ({"reverse_positions_mm": [0, NAN, 2]}, "reverse_positions_mm, row 2"),
        ({"reverse_errors_mm": [0, 0]}, "reverse_errors_mm"),
        ({"forward_errors_mm": [0, 0, NAN]}, "forward_errors_mm, row 3"),
        ({"forward_positions_mm": [2, 1, 0]}, "forward_positions_mm, row 2"),
        ({"reverse_positions_mm": [2, 3, 4]}, "reverse_positions_mm"),
    ],
)
def test_bad_bidirectional_tables(changes, name):
    good = {f"{way}_positions_mm": [0, 1, 2] for way in ("forward", "reverse")}
    good |= {f"{way}_errors_mm": [0, 0, 0] for way in ("forward", "reverse")}
    BidirectionalTable(**good)
    with pytest.raises(ArgumentError) as caught:
        BidirectionalTable(**{**good, **changes})
    assert caught.value.name == name


def test_a_table_of_the_lathe_is_exact_on_its_grid():
    lathe = LatheNetwork()
    grid = (1.0 + np.arange(1561) * 0.025) * 25.4
    table = BidirectionalTable.sampled_from(lathe, grid)
    for direction in (FORWARD, REVERSE):
        assert_allclose(table.error_mm(grid, direction), lathe.error_mm(grid, direction), rtol=1e-15)
    middle = (grid[:-1] + grid[1:]) / 2
    between = (table.error_mm(grid[:-1], FORWARD) + table.error_mm(grid[1:], FORWARD)) / 2
    assert_allclose(table.error_mm(middle, FORWARD), between, rtol=1e-9)


def test_tables_are_frozen_values():
    positions = np.array([0.0, 1.0])
    table = UnidirectionalTable(positions_mm=positions, errors_mm=[0, 1], backlash_mm=0)
    positions[1] = 9.0
    assert table.range_mm == (0.0, 1.0)
    with pytest.raises(ValueError, match="read-only"):
        table.positions_mm[0] = 5.0
    assert table == dataclasses.replace(table)
    assert table != dataclasses.replace(table, backlash_mm=1.0)
    assert table != NoError()
