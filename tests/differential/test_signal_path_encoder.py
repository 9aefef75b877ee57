"""Edges solved for from the motion, against lines followed by dense sampling and bisection."""

import numpy as np
import pytest
from encoder_oracle import Disc, Segment, edges
from hypothesis import assume, given, settings, strategies as st

from rtec.axis import Dwell, Encoder, Imperfections, Limits, MotionSegments, Move, ProfileShape, Program, plan

compiles = settings(deadline=None, max_examples=60)
PER_REV = 400


def motion_of(segments):
    """Make motion segments of an oracle's segments in counts, for an encoder of 1 mm a count."""
    column = [np.array([getattr(one, name) for one in segments]) for name in ("x", "v", "a", "j")]
    last = segments[-1]
    return MotionSegments(
        start_ps=np.array([one.start_ps for one in segments], dtype=np.int64),
        duration_ps=np.array([one.duration_ps for one in segments], dtype=np.int64),
        x0_mm=column[0],
        v0_mm_s=column[1],
        a0_mm_s2=column[2],
        j0_mm_s3=column[3],
        block=np.zeros(len(segments), dtype=np.int64),
        block_end_ps=np.array([last.start_ps + last.duration_ps], dtype=np.int64),
        end_mm=float(last.at(last.duration_ps / 1e12)),
    )


@st.composite
def flaws(draw):
    lag = draw(st.floats(-60, 60))
    longer = st.floats(-0.05, 0.05)
    if draw(st.booleans()):
        return Disc(home=draw(st.integers(0, 3)))
    return Disc(
        lag_deg=lag,
        longer_a=draw(longer),
        longer_b=draw(longer),
        eccentric=draw(st.sampled_from([0.0, 0.7, 3.0])),
        eccentric_deg=draw(st.floats(-180, 180)),
        counts_per_rev=PER_REV,
        home=draw(st.integers(0, 3)),
    )


def encoder_of(disc, count_mm=1.0):
    flaws_ = Imperfections(
        phase_error_deg=disc.lag_deg,
        duty_error_a=disc.longer_a,
        duty_error_b=disc.longer_b,
        eccentricity_counts=disc.eccentric,
        eccentricity_deg=disc.eccentric_deg,
    )
    return Encoder(count_mm=count_mm, counts_per_rev=disc.counts_per_rev, home_state=disc.home, imperfections=flaws_)


def check(disc, encoder, segments, motion):
    stream = encoder.edges(motion)
    start, expected = edges(disc, segments)
    if any(abs(speed) < 1e-3 for *_, speed in expected):
        return  # a turn that just touches a line has no definite edge
    assert stream.initial == start[0] + 2 * start[1]
    level, made = stream.initial, []
    for t, ab in zip(stream.times_ps.tolist(), stream.levels.tolist(), strict=True):
        changed = level ^ ab
        assert changed in (1, 2)
        made.append((t, "A" if changed == 1 else "B", ab & 1 if changed == 1 else ab >> 1))
        level = ab
    assert [(track, to) for _, track, to in made] == [(track, to) for _, track, to, _ in expected]
    for (t, *_), (goal, *_, speed) in zip(made, expected, strict=True):
        # half a picosecond of rounding, and what float64 knows of the position
        assert abs(t - goal) <= 1.0 + 1e12 * 4e-12 / abs(speed), (t, goal, speed)


@st.composite
def free_motion(draw):
    """Segments that join in position and velocity, with reversals inside; the speeds are those of a slow axis."""
    segments, t = [], draw(st.sampled_from([0, 10**12]))
    x, v = draw(st.floats(-30, 30)), draw(st.floats(-40, 40))
    for _ in range(draw(st.integers(1, 4))):
        duration = draw(st.integers(10**10, 10**12))
        a = draw(st.sampled_from([0.0, 60.0, -60.0, 17.3, -200.0]))
        j = draw(st.sampled_from([0.0, 0.0, 500.0, -500.0, 90.5]))
        segments.append(Segment(t, duration, x, v, a, j))
        s = duration / 1e12
        x, v, t = segments[-1].at(s), segments[-1].speed(s), t + duration
    return segments


@compiles
@given(flaws(), free_motion())
def test_edges_of_any_motion_are_the_oracles(disc, segments):
    check(disc, encoder_of(disc), segments, motion_of(segments))


@compiles
@given(
    flaws(),
    st.lists(st.one_of(st.none(), st.floats(-0.03, 0.03)), min_size=1, max_size=4),
    st.sampled_from(list(ProfileShape)),
)
def test_edges_of_a_program_are_the_oracles(disc, targets, shape):
    blocks = tuple(
        Dwell(seconds=0.25) if target is None else Move(target_mm=round(target, 4) + 3e-5, feed_mm_s=0.4)
        for target in targets
    )
    limits = Limits(max_speed_mm_s=1.0, max_acceleration_mm_s2=2.0, rapid_mm_s=1.0, max_jerk_mm_s3=40.0)
    motion = plan(Program(blocks=blocks), limits, shape=shape)
    assume(motion.start_ps.size > 0)
    segments = [
        Segment(int(t), int(d), x * 1000, v * 1000, a * 1000, j * 1000)
        for t, d, x, v, a, j in zip(
            motion.start_ps, motion.duration_ps, motion.x0_mm, motion.v0_mm_s, motion.a0_mm_s2, motion.j0_mm_s3,
            strict=True,
        )
    ]  # fmt: skip
    check(disc, encoder_of(disc, count_mm=0.001), segments, motion)


@pytest.mark.parametrize("x", [0.2, 0.45, 0.75, -3.6, 7.3])
def test_the_level_at_the_start_is_that_of_the_lines_around_it(x):
    # B's lines lie two thirds of a count late: between its nominal and its real line, rounding would be wrong
    disc = Disc(lag_deg=60.0)
    segments = [Segment(0, 10**12, x, 3.0, 0.0, 0.0)]
    check(disc, encoder_of(disc), segments, motion_of(segments))
