import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from profile_oracle import extremes

from rtec.axis import Dwell, Encoder, Move, Program, Window
from rtec.axis.motion import NAMES, MotionKind, motion_named, motion_of, programme_motion
from rtec.errors import ArgumentError

WINDOW = Window(begin_ps=4_000_000, end_ps=9_000_000, pause_ps=2_000_000_000, every_ps=2_000_000)
WITHOUT_FILE = [MotionKind(name) for name in NAMES]
COUNTS = Encoder(count_mm=1.0)


@settings(max_examples=40, deadline=None)
@given(
    kind=st.sampled_from(WITHOUT_FILE),
    hertz=st.floats(10.0, 1e6),
    gain=st.floats(1e4, 1e10),
    corrections=st.integers(1, 12),
    travel=st.integers(8, 40),
    direction=st.sampled_from([1, -1]),
    seed=st.integers(0, 9),
)
def test_any_motion_keeps_its_limits_and_ends_where_its_edges_say(
    kind, hertz, gain, corrections, travel, direction, seed
):
    motion = motion_of(
        kind, counts=travel * corrections, frequency_hz=hertz, corrections=corrections, acceleration_hz_s=gain,
        direction=direction,
        window=WINDOW, seed=seed,
    )  # fmt: skip
    reached = extremes(motion.segments)
    assert motion.top_hz <= hertz * (1 + 1e-9)
    assert reached.acceleration_mm_s2 <= 4 * gain * (1 + 1e-9)
    stream = COUNTS.edges(motion.segments)
    assert stream.counts().illegal == 0
    assert stream.counts().net == math.floor(motion.segments.end_mm + 0.5)
    assert (
        motion.requests_ps.size == corrections
        and (np.diff(motion.requests_ps) > 0).all()
        and motion.requests_ps[0] >= 1
    )


@pytest.mark.parametrize("kind", [MotionKind.REVERSAL, MotionKind.ADVERSARY])
def test_requests_lie_on_the_grid_and_after_a_rest(kind):
    motion = motion_of(
        kind, counts=800, frequency_hz=1e3, corrections=40, acceleration_hz_s=1e7, window=WINDOW, seed=4
    )
    assert not (motion.requests_ps % WINDOW.every_ps).any()
    assert np.diff(motion.requests_ps).min() >= WINDOW.pause_ps


def test_aimed_crossings_fall_into_every_tenth_of_an_insertion_behind_a_turn():
    motion = motion_of(MotionKind.REVERSAL, counts=8 * 400, frequency_hz=1e4, corrections=400, window=WINDOW)
    edges = COUNTS.edges(motion.segments).times_ps
    length = WINDOW.end_ps - WINDOW.begin_ps
    asked = motion.requests_ps
    # two of four are aimed by the window after the request ...
    near = (edges[None, :] - asked[:, None] - WINDOW.begin_ps) / length
    at_rest = near[(near > 0) & (near < 1)]
    assert np.histogram(at_rest, bins=10, range=(0, 1))[0].min() > 0
    # ... two turn so close behind an edge that it comes again within the insertion which this edge begins
    apart = np.diff(edges)
    close = apart[apart < WINDOW.end_ps]
    assert np.histogram(close, bins=10, range=(0, WINDOW.end_ps))[0].min() > 0


def test_each_attack_depends_on_its_number_and_seed_alone():
    def attacks(first, corrections, seed):
        return motion_of(
            MotionKind.ADVERSARY,
            counts=8 * corrections,
            frequency_hz=1e5,
            corrections=corrections,
            window=WINDOW,
            seed=seed,
            first=first,
        )

    def shape(motion):
        return np.diff(COUNTS.edges(motion.segments).times_ps).tolist()

    all_three, last = attacks(0, 3, 5), attacks(2, 1, 5)
    assert len(shape(last)) and np.abs(np.array(shape(all_three)[-len(shape(last)) :]) - shape(last)).max() <= 4_000
    assert shape(attacks(0, 3, 5)) == shape(all_three) != shape(attacks(0, 3, 6))


def test_dither_crosses_four_lines_by_swings_of_all_sizes():
    motion = motion_of(MotionKind.DITHER, counts=4000, frequency_hz=1e4, corrections=0)
    stream = COUNTS.edges(motion.segments)
    apart = np.diff(stream.times_ps)
    assert apart.min() >= 100_000
    assert np.histogram(np.log10(apart), bins=6)[0].min() > 100
    assert len(stream) == 4003  # and three lines on the way from one to the next


def test_a_programme_runs_its_fastest_feed_at_the_frequency():
    program = Program(
        blocks=(Move(target_mm=2.0, feed_mm_s=10.0), Dwell(seconds=0.5), Move(target_mm=1.0, feed_mm_s=5.0))
    )
    motion = programme_motion(program, frequency_hz=20e3, corrections=3)
    # 80 000 counts/s are 10 mm/s: 8000 counts a mm
    assert len(COUNTS.edges(motion.segments)) == 16_000 + 8_000
    assert motion.segments.end_mm == pytest.approx(8000.0)
    assert motion.top_hz == pytest.approx(20e3)


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"counts": 0}, "cycles"),
        ({"frequency_hz": math.nan}, "frequency_hz"),
        ({"acceleration_hz_s": 0.0}, "acceleration_hz_s"),
        ({"corrections": 100_001}, "corrections"),
        ({"counts": 70, "corrections": 10}, "cycles"),
        ({"window": None}, "window"),
        ({"kind": MotionKind.DITHER, "counts": 1_000_001}, "cycles"),
        ({"kind": MotionKind.RAMP, "counts": 1 << 30, "frequency_hz": 0.001}, "cycles"),
        ({"kind": MotionKind.PROGRAMME}, "motion"),
    ],
)
def test_what_cannot_be_is_refused(change, name):
    given_ = {
        "kind": MotionKind.REVERSAL,
        "counts": 800,
        "frequency_hz": 1e4,
        "corrections": 10,
        "window": WINDOW,
    } | change
    with pytest.raises(ArgumentError) as caught:
        motion_of(given_.pop("kind"), **given_)
    assert caught.value.name == name


@pytest.mark.parametrize(("text", "hint"), [("revresal", "did you mean 'reversal'?"), ("up", ""), ("", "")])
def test_an_unknown_motion_is_refused(text, hint):
    with pytest.raises(ArgumentError, match="steady, ramp, reversal, dither, adversary, or a G-code file") as caught:
        motion_named(text)
    assert caught.value.hint == hint


def test_a_programme_without_a_feed_is_refused():
    with pytest.raises(ArgumentError, match="no feed move"):
        programme_motion(Program(blocks=(Dwell(seconds=1.0),)), frequency_hz=1e3, corrections=1)
