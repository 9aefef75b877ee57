import numpy as np
import pytest
from signal_oracle import FORWARD, decode_step, text

from rtec.signal import ILLEGAL, NEVER
from rtec.signal._kernels import DELTA, count_delta, count_of_one_line, level_of_state, state_of_level


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
