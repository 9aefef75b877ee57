import gc
import weakref
from itertools import count

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.signal import Gate, LevelStream, merge_chunks, merge_lines

A = LevelStream([10, 20], initial=0)
B = LevelStream([15, 25], initial=0)


@pytest.mark.parametrize(
    ("gate", "times", "initial"),
    [
        (Gate.OR, [10, 25], 0),
        (Gate.AND, [15, 20], 0),
        (Gate.XOR, [10, 15, 20, 25], 0),
        ((1, 0, 0, 0), [10, 25], 1),
        ((0, 1, 0, 0), [10, 15], 0),
        ((1, 1, 1, 1), [], 1),
    ],
)
def test_overlapping_pulses_through_each_gate(gate, times, initial):
    assert merge_lines(gate, A, B) == LevelStream(times, initial)


@pytest.mark.parametrize(
    ("gate", "times"),
    [(Gate.OR, [10, 30]), (Gate.AND, []), (Gate.XOR, [10, 30])],
)
def test_pulse_that_begins_as_the_other_ends_leaves_no_glitch(gate, times):
    assert merge_lines(gate, LevelStream([10, 20], 0), LevelStream([20, 30], 0)).times_ps.tolist() == times


def test_opposite_toggles_at_one_time_cancel_or_act_once():
    up, down = LevelStream([5], 0), LevelStream([5], 1)
    assert merge_lines(Gate.XOR, up, down) == LevelStream([], 1)
    assert merge_lines(Gate.XOR, up, up) == LevelStream([], 0)
    assert merge_lines(Gate.AND, up, up) == up


def test_chunks_need_not_be_cut_alike():
    pieces = merge_chunks(Gate.XOR, A.chunks(1), [LevelStream([], 0), B, LevelStream([], 0), LevelStream([40], 0)])
    assert LevelStream.concatenate(pieces) == LevelStream([10, 15, 20, 25, 40], 0)


def test_toggles_at_one_time_meet_across_a_cut():
    pieces = merge_chunks(Gate.XOR, LevelStream([10, 11], 0).chunks(1), [LevelStream([11, 12], 0)])
    assert LevelStream.concatenate(pieces) == LevelStream([10, 12], 0)


def test_quiet_inputs_still_give_the_level():
    assert list(merge_chunks(Gate.OR, [LevelStream([], 1)], [LevelStream([], 0)])) == [LevelStream([], 1)]


def test_used_pieces_are_let_go():
    """Of an endless input no more is kept than the piece at hand and the one just merged."""
    pieces = []

    def endless():
        for k in count(step=10):
            times = np.array([k, k + 1])
            pieces.append(weakref.ref(times))
            yield LevelStream(times, 0)
            del times

    merged = merge_chunks(Gate.OR, endless(), [LevelStream([5], 0)])
    first = [next(merged) for _ in range(2)]
    assert LevelStream.concatenate(first) == LevelStream([0, 1, 5], 0)
    endless_high = merge_chunks(Gate.XOR, endless(), [LevelStream([5], 0)])
    for _ in range(50):
        next(endless_high)
    gc.collect()
    assert sum(piece() is not None for piece in pieces[-50:]) <= 3


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: merge_lines((0, 1, 1), A, B), "gate: a table of 3 outputs"),
        (lambda: merge_lines((0, 1, 1, 2), A, B), r"gate\[3\]: 2"),
        (lambda: merge_chunks(Gate.OR, [], [B]), "a_chunks: an empty sequence"),
        (lambda: merge_chunks(Gate.OR, [A], iter(())), "b_chunks: an empty sequence"),
        (lambda: list(merge_chunks(Gate.OR, [A, A], [B])), r"a_chunks\[1\].times_ps\[0\]: 10 ps"),
        (lambda: list(merge_chunks(Gate.OR, [A], [B, LevelStream([40], 1)])), r"b_chunks\[1\].initial: 1"),
    ],
)
def test_wrong_input_is_one_clear_error(call, message):
    with pytest.raises(ArgumentError, match=message):
        call()
