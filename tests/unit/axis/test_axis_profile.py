import math
import time

import numpy as np
import pytest
from profile_oracle import extremes

from rtec.axis.profile import Limits, MotionSegments, ProfileShape, plan
from rtec.axis.program import Dwell, Move, Program, Rapid
from rtec.errors import ArgumentError

LIMITS = Limits(max_speed_mm_s=50, max_acceleration_mm_s2=100, rapid_mm_s=40, max_jerk_mm_s3=1000)
MS = 10**9


def ends_mm(motion):
    """Return the planned position at the end of each piece."""
    return np.append(motion.x0_mm[1:], motion.end_mm) if motion.x0_mm.size else motion.x0_mm


def one_move(target, feed, shape, start=0.0):
    return plan(Program(blocks=(Move(target_mm=target, feed_mm_s=feed),), start_mm=start), LIMITS, shape)


def test_blocks_dwells_and_moves_of_no_length():
    program = Program(
        blocks=(
            Dwell(seconds=2),
            Move(target_mm=15, feed_mm_s=20),
            Dwell(seconds=0),
            Move(target_mm=15, feed_mm_s=20),
            Dwell(seconds=1.5),
            Move(target_mm=5, feed_mm_s=20),
        ),
        start_mm=5,
    )
    motion = plan(program, LIMITS)
    assert motion.block.tolist() == [0, 1, 1, 1, 4, 5, 5, 5]
    assert motion.block_end_ps.tolist() == [x * MS for x in (2000, 2700, 2700, 2700, 4200, 4900)]
    assert motion.total_ps == 4900 * MS
    for dwell, x in [(0, 5.0), (4, 15.0)]:
        state = motion.x0_mm, motion.v0_mm_s, motion.a0_mm_s2, motion.j0_mm_s3
        assert [array[dwell] for array in state] == [x, 0, 0, 0]
    assert motion.position_at(motion.block_end_ps).tolist() == [5, 15, 15, 15, 15, 5]
    assert ends_mm(motion).tolist() == [5, 7, 13, 15, 15, 13, 7, 5]


@pytest.mark.parametrize("blocks", [(), (Dwell(seconds=0),), (Move(target_mm=3, feed_mm_s=1),)])
def test_program_of_no_length_rests_at_its_start(blocks):
    motion = plan(Program(blocks=blocks, start_mm=3), LIMITS)
    assert (motion.total_ps, motion.start_ps.size, motion.block_end_ps.tolist()) == (0, 0, [0] * len(blocks))
    assert motion.position_at([-5, 0, 5]).tolist() == [3, 3, 3]
    assert motion.velocity_at([0, 5]).tolist() == motion.acceleration_at([0, 5]).tolist() == [0, 0]
    assert ends_mm(motion).size == 0
    reached = extremes(motion)
    assert (reached.min_mm, reached.max_mm, reached.speed_mm_s) == (3, 3, 0)


@pytest.mark.parametrize("times", [0.5, [1.0, 2.0], "now", 2**70, np.array([1], dtype=np.uint64)])
def test_times_must_be_whole_picoseconds(times):
    with pytest.raises(ArgumentError, match="t_ps"):
        one_move(10, 20, ProfileShape.TRAPEZOIDAL).position_at(times)


def test_feed_above_the_largest_speed_is_refused():
    blocks = (Dwell(seconds=1), Move(target_mm=1, feed_mm_s=51))
    with pytest.raises(ArgumentError, match=r"feed_mm_s of blocks\[1\]: 51.0 is not valid; .* 50 mm/s"):
        plan(Program(blocks=blocks), LIMITS)


def test_jerk_limited_shape_needs_a_jerk():
    limits = Limits(max_speed_mm_s=50, max_acceleration_mm_s2=100, rapid_mm_s=40)
    with pytest.raises(ArgumentError, match="max_jerk_mm_s3"):
        plan(Program(blocks=()), limits, ProfileShape.JERK_LIMITED)


@pytest.mark.parametrize(
    "blocks",
    [
        (Dwell(seconds=8.64e6), Dwell(seconds=1)),
        (Dwell(seconds=8.64e6),) * 3,
        (Move(target_mm=1e5, feed_mm_s=1e-9),),
        (Move(target_mm=1e5, feed_mm_s=1e-9), Dwell(seconds=8e6)) * 5,
    ],
)
def test_more_than_100_days_are_refused(blocks):
    with pytest.raises(ArgumentError, match="100 days"):
        plan(Program(blocks=blocks), LIMITS)


@pytest.mark.parametrize("shape", ProfileShape)
def test_extreme_limits_and_moves_stay_finite(shape):
    for speed, acceleration, jerk in [(1e4, 1e6, 1e10), (1e4, 1e6, 1e-6), (1e-9, 1e-6, 1e10), (1e4, 1e-6, 1e10)]:
        limits = Limits(
            max_speed_mm_s=speed, max_acceleration_mm_s2=acceleration, rapid_mm_s=speed, max_jerk_mm_s3=jerk
        )
        for distance in (5e-324, 1e-300, 1e-15, 1e-4):
            motion = plan(Program(blocks=(Rapid(target_mm=distance),)), limits, shape)
            assert motion.end_mm == distance
            assert all(np.isfinite(getattr(motion, name)).all() for name in ("x0_mm", "v0_mm_s", "a0_mm_s2"))


@pytest.mark.parametrize("name", ["max_speed_mm_s", "max_acceleration_mm_s2", "rapid_mm_s", "max_jerk_mm_s3"])
@pytest.mark.parametrize("value", [0, -1, math.nan, math.inf, "5", True, 10**400])
def test_limits_refuse_what_is_no_positive_number(name, value):
    numbers = {"max_speed_mm_s": 50, "max_acceleration_mm_s2": 100, "rapid_mm_s": 40, "max_jerk_mm_s3": 1000}
    with pytest.raises(ArgumentError, match=name):
        Limits(**{**numbers, name: value})


def test_rapid_above_the_largest_speed_is_refused():
    with pytest.raises(ArgumentError, match="rapid_mm_s: 60"):
        Limits(max_speed_mm_s=50, max_acceleration_mm_s2=100, rapid_mm_s=60)


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"duration_ps": np.array([5, 0])}, "duration_ps"),
        ({"start_ps": np.array([0, 6])}, "start_ps"),
        ({"start_ps": [0, 5]}, "start_ps"),
        ({"x0_mm": np.array([0, 1])}, "x0_mm"),
        ({"v0_mm_s": np.zeros(3)}, "v0_mm_s"),
        ({"block": np.zeros((2, 1), np.int64)}, "block"),
    ],
)
def test_segments_that_do_not_join_are_refused(changes, name):
    zeros = dict.fromkeys(["x0_mm", "v0_mm_s", "a0_mm_s2", "j0_mm_s3"], np.zeros(2))
    good = {"start_ps": np.array([0, 5]), "duration_ps": np.array([5, 3]), "block": np.array([0, 1])} | zeros
    rest = {"block_end_ps": np.array([5, 8]), "end_mm": 0.0}
    assert MotionSegments(**good, **rest).total_ps == 8
    with pytest.raises(ArgumentError, match=name):
        MotionSegments(**{**good, **changes}, **rest)


@pytest.mark.parametrize("shape", ProfileShape)
def test_the_thesis_program_joins_everywhere_and_plans_quickly(shape):
    inch = 25.4
    targets = [(1 + 0.025 * index) * inch for index in range(1561)]
    places = [*targets, 40.1 * inch, *reversed(targets), 0.9 * inch] * 4
    blocks = [block for x in places for block in (Move(target_mm=x, feed_mm_s=50 * inch / 60), Dwell(seconds=6))]
    program = Program(blocks=blocks, start_mm=0.9 * inch)
    before = time.process_time()
    motion = plan(program, LIMITS, shape)
    assert time.process_time() - before < 1.0
    reached = motion.position_at(motion.block_end_ps[::2])
    assert reached.tolist() == [block.target_mm for block in program.blocks[::2]]
    tau = motion.duration_ps / 1e12
    end = motion.x0_mm + tau * (motion.v0_mm_s + tau * (motion.a0_mm_s2 / 2 + tau * motion.j0_mm_s3 / 6))
    assert np.abs(end - ends_mm(motion)).max() < 1e-9
    assert motion.total_ps > 12_496 * 6 * 10**12
