import dataclasses
import math
from fractions import Fraction

import numpy as np
import pytest

from rtec.axis.program import Dwell, Move, Program, Rapid, number_within
from rtec.errors import ArgumentError

HOSTILE = [math.nan, math.inf, -math.inf, 10**400, "10", None, True, 1j, [1.0], b"\0"]


@pytest.mark.parametrize("value", HOSTILE)
def test_every_number_refuses_what_is_no_finite_number(value):
    makers = {
        "target_mm": [lambda: Move(target_mm=value, feed_mm_s=1.0), lambda: Rapid(target_mm=value)],
        "feed_mm_s": [lambda: Move(target_mm=1.0, feed_mm_s=value)],
        "seconds": [lambda: Dwell(seconds=value)],
        "start_mm": [lambda: Program(blocks=(), start_mm=value)],
    }
    for name, calls in makers.items():
        for call in calls:
            with pytest.raises(ArgumentError, match=name):
                call()


@pytest.mark.parametrize(
    "call",
    [
        lambda: Move(target_mm=0, feed_mm_s=0),
        lambda: Move(target_mm=0, feed_mm_s=-1),
        lambda: Move(target_mm=0, feed_mm_s=1.1e4),
        lambda: Move(target_mm=1.1e5, feed_mm_s=1),
        lambda: Rapid(target_mm=-1.1e5),
        lambda: Dwell(seconds=-1e-12),
        lambda: Dwell(seconds=8.64e6 + 1),
        lambda: Program(blocks=(Dwell(seconds=0),), start_mm=1e6),
    ],
)
def test_values_beyond_their_range_are_refused(call):
    with pytest.raises(ArgumentError, match=r"is too (small|large); use "):
        call()


def test_fractions_and_numpy_numbers_become_floats():
    assert number_within("x", Fraction(1, 4), 0, 1) == 0.25
    move = Move(target_mm=np.float32(0.5), feed_mm_s=np.int64(3))
    assert (type(move.target_mm), type(move.feed_mm_s)) == (float, float)


@pytest.mark.parametrize(("seconds", "dwell_ps"), [(0, 0), (6, 6 * 10**12), (0.1, 10**11), (1e-12, 1), (2.4e-12, 2)])
def test_dwell_is_whole_picoseconds(seconds, dwell_ps):
    assert Dwell(seconds=seconds).dwell_ps == dwell_ps
    assert type(Dwell(seconds=seconds).dwell_ps) is int


def test_blocks_are_frozen_and_compare_by_value():
    move = Move(target_mm=1, feed_mm_s=2)
    with pytest.raises(dataclasses.FrozenInstanceError):
        move.target_mm = 3.0
    assert move == Move(target_mm=1.0, feed_mm_s=2.0)
    assert Dwell(seconds=1) != Dwell(seconds=2)


def test_program_keeps_a_list_as_a_tuple():
    blocks = [Rapid(target_mm=1)]
    program = Program(blocks=blocks)
    blocks.append(Rapid(target_mm=2))
    assert program.blocks == (Rapid(target_mm=1),)


@pytest.mark.parametrize(
    ("blocks", "name"), [((Dwell(seconds=1), 5.0), r"blocks\[1\]"), (7, "blocks"), ("G", "blocks")]
)
def test_program_refuses_what_is_no_block(blocks, name):
    with pytest.raises(ArgumentError, match=name):
        Program(blocks=blocks)
