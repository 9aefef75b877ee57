import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, strategies as st
from profile_oracle import move_time_s, state_after

from rtec.axis.profile import Limits, ProfileShape, plan
from rtec.axis.program import Dwell, Move, Program, Rapid

PS = 1e-12
POSITION = st.floats(-2000, 2000).map(lambda x: round(x, 6))  # no move too short to last a picosecond


def logarithmic(low, high):
    """Floats whose logarithm is spread evenly from ``low`` to ``high``."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda exponent: 10**exponent)


LIMITS = st.builds(
    lambda speed, part, acceleration, jerk: Limits(
        max_speed_mm_s=speed, rapid_mm_s=part * speed, max_acceleration_mm_s2=acceleration, max_jerk_mm_s3=jerk
    ),
    logarithmic(1, 999),
    st.floats(0.1, 1),
    logarithmic(10, 1e5),
    logarithmic(100, 1e7),
)
SHAPE = st.sampled_from(ProfileShape)


@st.composite
def programs(draw, limits):
    near = st.tuples(st.sampled_from([-1, 1]), logarithmic(1e-6, 100))
    here = start = draw(POSITION)
    blocks = []
    for kind in draw(st.lists(st.sampled_from(["near", "far", "rapid", "dwell"]), max_size=6)):
        if kind == "dwell":
            blocks.append(Dwell(seconds=draw(st.floats(0, 100))))
            continue
        sign, distance = draw(near)
        here = here + sign * distance if kind == "near" else draw(POSITION)
        feed = draw(st.floats(0.01, 1)) * limits.max_speed_mm_s
        blocks.append(Rapid(target_mm=here) if kind == "rapid" else Move(target_mm=here, feed_mm_s=feed))
    return Program(blocks=tuple(blocks), start_mm=start)


@st.composite
def planned(draw, shapes=SHAPE):
    limits, shape = draw(LIMITS), draw(shapes)
    program = draw(programs(limits))
    return program, limits, shape, plan(program, limits, shape)


def joints(motion):
    """Return for every piece the exact state at its end and the state that the next piece states."""
    columns = (motion.duration_ps, motion.x0_mm, motion.v0_mm_s, motion.a0_mm_s2, motion.j0_mm_s3)
    rows = [*zip(*(column.tolist() for column in columns), strict=True), (0, motion.end_mm, 0.0, 0.0, 0.0)]
    return [(state_after(*row), after[1:4]) for row, after in pairwise(rows)]


@given(planned())
def test_position_and_velocity_join(case):
    _, limits, _, motion = case
    for (x, v, _), (next_x, next_v, _) in joints(motion):
        assert abs(float(x) - next_x) < 1e-9
        assert abs(float(v) - next_v) <= limits.max_acceleration_mm_s2 * 3 * PS + 1e-12 * limits.max_speed_mm_s


@given(planned(st.just(ProfileShape.JERK_LIMITED)))
def test_acceleration_joins_where_jerk_is_limited(case):
    _, limits, _, motion = case
    for (_, _, a), (_, _, next_a) in joints(motion):
        bound = limits.max_jerk_mm_s3 * 3 * PS + 1e-12 * limits.max_acceleration_mm_s2
        assert abs(float(a) - next_a) <= bound


@given(planned())
def test_time_is_covered_without_gap_and_blocks_end_where_they_should(case):
    program, _, _, motion = case
    assert motion.start_ps.tolist() == [0, *np.cumsum(motion.duration_ps)[:-1]][: motion.start_ps.size]
    here, targets = program.start_mm, []
    for block in program.blocks:
        here = here if isinstance(block, Dwell) else block.target_mm
        targets.append(here)
    assert motion.position_at(motion.block_end_ps).tolist() == targets
    assert motion.end_mm == here
    assert motion.position_at(0) == program.start_mm
    for index, end_ps in enumerate(motion.block_end_ps.tolist()):
        mine = motion.block == index
        if mine.any():
            assert (motion.start_ps + motion.duration_ps)[mine][-1] == end_ps


@given(planned(), st.integers(2, 200))
def test_limits_hold_at_every_moment(case, moments):
    program, limits, shape, motion = case
    slack = 1 + 1e-12
    times = np.linspace(0, motion.total_ps, moments).astype(np.int64)
    feeds = [limits.rapid_mm_s if isinstance(b, Rapid) else getattr(b, "feed_mm_s", 0.0) for b in program.blocks]
    speed_of_piece = np.array(feeds, dtype=float)[motion.block]
    edge = limits.max_acceleration_mm_s2 * 3 * PS
    assert np.all(np.abs(motion.v0_mm_s) <= speed_of_piece * slack)
    assert np.all(np.abs(motion.velocity_at(times)) <= limits.max_speed_mm_s * slack + edge)
    bound = limits.max_acceleration_mm_s2 * slack + limits.max_jerk_mm_s3 * 3 * PS
    assert np.all(np.abs(motion.acceleration_at(times)) <= bound)
    jerks = {0.0} if shape is ProfileShape.TRAPEZOIDAL else {0.0, limits.max_jerk_mm_s3}
    assert set(np.abs(motion.j0_mm_s3).tolist()) <= jerks


@given(planned(), st.data())
def test_state_at_any_time_is_the_exact_polynomial(case, data):
    _, limits, _, motion = case
    if motion.total_ps == 0:
        return
    t = data.draw(st.integers(0, motion.total_ps - 1))
    piece = max(index for index, start in enumerate(motion.start_ps.tolist()) if start <= t)
    columns = (motion.x0_mm, motion.v0_mm_s, motion.a0_mm_s2, motion.j0_mm_s3)
    x, v, a = state_after(t - int(motion.start_ps[piece]), *(float(column[piece]) for column in columns))
    assert motion.position_at(t) == pytest.approx(float(x), abs=1e-11)
    assert motion.velocity_at(t) == pytest.approx(float(v), abs=1e-12 * limits.max_speed_mm_s)
    assert motion.acceleration_at(t) == pytest.approx(float(a), abs=1e-12 * limits.max_acceleration_mm_s2)


@given(LIMITS, SHAPE, logarithmic(1e-4, 2000), st.floats(0.01, 1))
def test_time_agrees_with_numerical_integration(limits, shape, distance, part):
    feed = part * limits.max_speed_mm_s
    jerk = None if shape is ProfileShape.TRAPEZOIDAL else limits.max_jerk_mm_s3
    motion = plan(Program(blocks=(Move(target_mm=distance, feed_mm_s=feed),)), limits, shape)
    expected = move_time_s(distance, feed, limits.max_acceleration_mm_s2, jerk)
    assert motion.total_ps * PS == pytest.approx(expected, rel=3e-6)
