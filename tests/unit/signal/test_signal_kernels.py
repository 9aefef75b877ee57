import numpy as np
import pytest
from signal_oracle import FORWARD, decode_step, text

from rtec.signal import ILLEGAL, NEVER
from rtec.signal._kernels import DELTA, count_delta, count_of_one_line, level_of_state, merge, state_of_level


@pytest.mark.parametrize("state", range(4))
def test_level_of_state_is_the_reports_table_and_its_own_inverse(state):
    assert text(level_of_state(state)) == FORWARD[state]
    assert state_of_level(level_of_state(state)) == state


@pytest.mark.parametrize("before", range(4))
@pytest.mark.parametrize("after", range(4))
def test_count_delta_agrees_with_decoder(before, after):
    expected = decode_step(text(before), text(after))
    expected = ILLEGAL if expected == "illegal" else expected
    assert count_delta(before, after) == expected
    assert count_delta(np.uint8(before), np.uint8(after)) == expected
    if before ^ after in (1, 2):
        assert count_of_one_line(before, after) == expected
    assert DELTA[before * 4 + after] == expected


def test_delta_table_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        DELTA[0] = 1


def test_never_leaves_room_for_a_sum_of_two():
    assert NEVER + NEVER - 1 <= np.iinfo(np.int64).max


def test_merge_stops_before_the_horizon_and_can_be_resumed():
    times, levels = np.zeros(4, np.int64), np.zeros(4, np.uint8)
    pair = np.arange(4, dtype=np.uint8)
    a, b = np.array([10, 30]), np.array([20, 30])
    assert merge(a, b, 30, 0, 0, 0, pair, times, levels) == (1, 1, 2, 1, 1, 3)
    assert times[:2].tolist() == [10, 20]
    assert levels[:2].tolist() == [1, 3]
    assert merge(a[1:], b[1:], NEVER, 1, 1, 3, pair, times, levels) == (1, 1, 1, 0, 0, 0)
    assert times[0] == 30
