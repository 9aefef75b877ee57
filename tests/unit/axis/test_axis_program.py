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
        "overshoot_mm": [lambda: Program.back_and_forth([1, 2], feed_mm_s=1, overshoot_mm=value)],
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


def test_back_and_forth_overshoots_at_each_turn_and_repeats():
    program = Program.back_and_forth([1.0, 2.0, 3.0], feed_mm_s=5, dwell_s=6, overshoot_mm=0.5, runs=2)
    there_and_back = [1.0, 2.0, 3.0, 3.5, 3.0, 2.0, 1.0, 0.5]
    assert program.start_mm == 0.5
    assert [block.target_mm for block in program.blocks[::2]] == there_and_back * 2
    assert set(program.blocks[1::2]) == {Dwell(seconds=6)}


def test_back_and_forth_without_overshoot_or_dwell_turns_at_the_targets():
    program = Program.back_and_forth(np.array([4.0, 1.0]), feed_mm_s=5)
    assert program.start_mm == 4.0
    assert [block.target_mm for block in program.blocks] == [4.0, 1.0, 1.0, 4.0]


def test_back_and_forth_falling_overshoots_downwards():
    program = Program.back_and_forth([4.0, 1.0], feed_mm_s=5, overshoot_mm=1)
    assert [program.start_mm, program.blocks[2].target_mm] == [5.0, 0.0]


def test_back_and_forth_gives_the_12488_readings_of_the_thesis():
    inch = 25.4
    targets = [(1 + 0.025 * index) * inch for index in range(1561)]
    program = Program.back_and_forth(targets, feed_mm_s=50 * inch / 60, dwell_s=6, overshoot_mm=0.1 * inch, runs=4)
    visits = [block.target_mm for block in program.blocks if isinstance(block, Move)]
    turns = [40.1 * inch, 0.9 * inch]
    assert len([x for x in visits if min(abs(x - turn) for turn in turns) > 1e-9]) == 12_488
    assert len(visits) == 12_488 + 8


@pytest.mark.parametrize("targets", [[], [1.0], [1.0, 1.0], [1.0, 3.0, 2.0], [3.0, 1.0, 2.0]])
def test_back_and_forth_refuses_targets_out_of_order(targets):
    with pytest.raises(ArgumentError, match="strictly rising or strictly falling"):
        Program.back_and_forth(targets, feed_mm_s=1)


@pytest.mark.parametrize("runs", [0, -1, 1.5, True, "3", 10**9])
def test_back_and_forth_refuses_runs_that_are_no_count(runs):
    with pytest.raises(ArgumentError, match="runs"):
        Program.back_and_forth([1.0, 2.0], feed_mm_s=1, runs=runs)
