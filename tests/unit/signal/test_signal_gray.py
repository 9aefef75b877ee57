import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.signal import ILLEGAL, STATES, count_deltas, levels_of_states, states_of_levels


def test_states_carry_levels_and_numbers():
    assert [(s.number, s.state, s.level) for s in STATES] == [(1, 0, 0), (2, 1, 1), (3, 2, 3), (4, 3, 2)]


def test_arrays_convert_both_ways_as_uint8():
    levels = levels_of_states(np.array([3, 2, 1, 0]))
    assert levels.dtype == np.uint8
    assert levels.tolist() == [2, 3, 1, 0]
    assert states_of_levels(levels).tolist() == [3, 2, 1, 0]


def test_count_deltas_of_one_turn_each_way_and_a_jump():
    assert count_deltas([1, 3, 2, 0, 2, 3, 1, 0, 3, 3], initial=0).tolist() == [1] * 4 + [-1] * 4 + [ILLEGAL, 0]
    assert count_deltas([], initial=2).tolist() == []


@pytest.mark.parametrize("convert", [levels_of_states, states_of_levels])
@pytest.mark.parametrize("bad", [[0, 4], [-1], [0.0], ["1"], [[0]], 2, [10**30], [[0], [1, 2]]])
def test_values_that_are_no_state_are_refused(convert, bad):
    with pytest.raises(ArgumentError, match=r"^(states|levels)"):
        convert(bad)


def test_error_names_index_and_value():
    with pytest.raises(ArgumentError, match=r"states\[2\]: 7 is not valid; use a whole number from 0 to 3"):
        levels_of_states([0, 1, 7])
