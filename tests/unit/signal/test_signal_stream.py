import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.signal import NEVER, EdgeStream
from rtec.signal.stream import Counts

CYCLE = EdgeStream([10, 20, 30, 40], [1, 3, 2, 0], initial=0)


def test_counts_of_forward_backward_and_illegal():
    assert CYCLE.counts() == Counts(net=4, illegal=0)
    assert EdgeStream([1, 2], [2, 3], initial=0).counts() == Counts(net=-2, illegal=0)
    assert EdgeStream([1, 2, 3], [3, 0, 1], initial=0).counts() == Counts(net=1, illegal=2)
    assert EdgeStream([], [], initial=3).counts() == Counts(net=0, illegal=0)


def test_level_is_the_new_one_at_the_time_of_the_edge():
    assert [CYCLE.level_at(t) for t in (-5, 9, 10, 19, 20, 39, 40, 10**9)] == [0, 0, 1, 1, 3, 2, 0, 0]
    assert CYCLE.levels_at([30, 10]).tolist() == [2, 1]


def test_window_is_half_open_and_starts_at_the_level_before():
    part = CYCLE.window(20, 40)
    assert part == EdgeStream([20, 30], [3, 2], initial=1)
    assert CYCLE.window(41, 50) == EdgeStream([], [], initial=0)
    assert CYCLE.window(20, 20) == EdgeStream([], [], initial=1)


def test_from_states():
    assert EdgeStream.from_states([10, 20, 30, 40], [1, 2, 3, 0], initial_state=0) == CYCLE
    assert CYCLE != "a stream"


def test_shortest_separation():
    assert EdgeStream([10, 25, 32], [1, 3, 2], initial=0).min_separation_ps() == 7
    assert EdgeStream([10], [1], initial=0).min_separation_ps() is None


def test_arrays_are_typed_read_only_and_not_copied():
    times = np.array([1, 2], dtype=np.int64)
    stream = EdgeStream(times, [1, 3], initial=0)
    assert (stream.times_ps.dtype, stream.levels.dtype) == (np.int64, np.uint8)
    assert np.shares_memory(stream.times_ps, times)
    assert times.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        stream.times_ps[0] = 0
    with pytest.raises(ValueError, match="read-only"):
        stream.levels[0] = 0


@pytest.mark.parametrize(
    ("times", "levels", "initial", "message"),
    [
        ([1, 5, 5], [1, 3, 2], 0, r"times_ps\[2\]: 5 ps after 5 ps is not valid"),
        ([1, 5, 4], [1, 3, 2], 0, r"times_ps\[2\]: 4 ps after 5 ps is not valid"),
        ([1.0, 2.0], [1, 3], 0, r"times_ps\[0\]: .*float64"),
        ([True], [1], 0, r"times_ps\[0\]: .*bool"),
        ([10**400], [1], 0, r"times_ps\[0\]: 1000"),
        ([10**5000], [1], 0, r"times_ps\[0\]: a number of thousands of digits"),
        ([2**63, 2**63 + 5], [1, 3], 0, r"times_ps\[0\]: 9223372036854775808 ps"),
        ([0, 2**63], [1, 3], 0, r"times_ps\[0\]"),
        ([NEVER], [1], 0, r"times_ps\[0\]: 4611686018427387904 ps"),
        ([[1, 2]], [1], 0, r"times_ps: an array of shape \(1, 2\)"),
        ([1, 2], [1, 4], 0, r"levels\[1\]: 4 is not valid; use a whole number from 0 to 3"),
        ([1, 2], [1, -1], 0, r"levels\[1\]: -1"),
        ([1, 2, 3], [1, 3, 3], 0, r"levels\[2\]: 3 is not valid; use a level other than the one before"),
        ([1], [2], 2, r"levels\[0\]: 2 is not valid; use a level other than the initial"),
        ([1, 2], [1], 0, r"levels: 1 values"),
        ([], [], 4, r"initial: 4"),
        ([], [], 1.0, r"initial: 1.0"),
        ([], [], None, r"initial: None"),
        pytest.param([], [], 10**5000, r"initial: a number of thousands of digits", id="5000 digits"),
    ],
)
def test_broken_invariant_is_one_clear_error(times, levels, initial, message):
    with pytest.raises(ArgumentError, match=message):
        EdgeStream(times, levels, initial)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: CYCLE.window(20, 10), "stop_ps: 10 ps"),
        (lambda: CYCLE.window(1.5, 10), "start_ps: 1.5"),
        (lambda: CYCLE.shift(2**62), r"times_ps\[0\]"),
        (lambda: CYCLE.shift(2**63), "delay_ps: 9223372036854775808 ps"),
        (lambda: CYCLE.level_at(0.5), "t_ps: 0.5"),
        (lambda: CYCLE.levels_at([0.5]), r"t_ps\[0\]"),
        (lambda: EdgeStream.concatenate([]), "chunks: an empty sequence"),
        (lambda: EdgeStream.concatenate([CYCLE, CYCLE.shift(30)]), r"chunks\[1\].times_ps\[0\]: 40 ps"),
        (lambda: EdgeStream.concatenate([CYCLE, EdgeStream([], [], 1)]), r"chunks\[1\].initial: 1"),
        (
            lambda: EdgeStream.concatenate([CYCLE, EdgeStream([], [], 0), CYCLE.shift(30)]),
            r"chunks\[2\].times_ps\[0\]: 40 ps",
        ),
    ],
)
def test_wrong_call_is_one_clear_error(call, message):
    with pytest.raises(ArgumentError, match=message):
        call()
