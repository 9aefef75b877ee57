"""The open path in motion: the fused loop against its stages one after the other, and what aimed crossings show."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from rtec.axis import Dwell, Encoder, Imperfections, Move, Program
from rtec.axis.motion import MotionKind
from rtec.board import Microcontroller
from rtec.controller import Receiver
from rtec.errors import ArgumentError
from rtec.injector import Design, Injector, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine import OpenPath, simulate, with_motion
from rtec.machine.in_motion import insertion_at_rest

MOVING = [MotionKind.RAMP, MotionKind.REVERSAL, MotionKind.DITHER, MotionKind.ADVERSARY]
STEP = {Design.ORIGINAL: 4, Design.A: 4, Design.B: 1, Design.C: 2}
GOVERNED = Program(
    blocks=(Move(target_mm=3.0, feed_mm_s=10.0), Dwell(seconds=0.004), Move(target_mm=-1.0, feed_mm_s=4.0))
)


def path_of(design, *, processor=Processor.FAST, latch=RealEdges.HOLD, **changes):
    box = InjectorSettings(design=design, timing=Timing.of(design, processor), real_edges=latch)
    return OpenPath(injector=box, **{"frequency_hz": 20e3, "cycles": 120, "corrections": 40} | changes)


def by_stages(path):
    """Run the same job by the faces: the encoder's own edges, the box, the receiver, each on its own."""
    stream = replace(path.encoder, count_mm=1.0).edges(path.motion.segments)
    sign = 1 if path.corrections > 0 else -1
    box, out, done = Injector(path.injector, initial=path.encoder.level_at_home), [], 0
    for k, asked in enumerate(path.motion.requests_ps.tolist(), 1):
        upto = int(np.searchsorted(stream.times_ps, asked))
        out.append(box.process(stream.part(done, upto), until_ps=asked))
        box.request(sign * k, at_ps=asked)
        done = upto
    end = path.motion.total_ps + 10**12
    out.append(box.process(stream.part(done, len(stream)), until_ps=end))
    receiver = Receiver(path.receiver, initial=path.encoder.level_at_home)
    for part in out:
        receiver.process(part)
    return stream, box.insertions, receiver.result(at_ps=end)


FLAWED = Imperfections(phase_error_deg=10.0, duty_error_a=0.02, jitter_ps=20_000)


@pytest.mark.one_in(7)
@pytest.mark.parametrize(
    ("design", "processor", "latch"), list(itertools.product(Design, Processor, RealEdges)), ids=str
)
@pytest.mark.parametrize("kind", [*MOVING, MotionKind.PROGRAMME])
def test_the_loop_is_its_stages(design, processor, latch, kind):
    flaws = FLAWED if kind in (MotionKind.RAMP, MotionKind.PROGRAMME) else Imperfections(duty_error_b=0.03)
    path = path_of(
        design, processor=processor, latch=latch, encoder=Encoder(imperfections=flaws, home_state=1, seed=9),
        corrections=-40 if design is Design.C else 40, direction=-1 if design is Design.A else 1,
    )  # fmt: skip
    path = with_motion(path, kind, program=GOVERNED if kind is MotionKind.PROGRAMME else None, seed=3)
    stream, insertions, received = by_stages(path)
    result = simulate(path)
    assert result.insertions == insertions
    assert result.received == received
    assert (result.edges, result.encoder_counts) == (len(stream), stream.counts().net)


def test_the_loop_is_its_stages_with_glitches():
    flaws = Imperfections(glitch_probability=0.1, glitch_ps=70_000)
    path = with_motion(path_of(Design.C, encoder=Encoder(imperfections=flaws, seed=8)), MotionKind.RAMP)
    stream, insertions, received = by_stages(path)
    result = simulate(path)
    assert result.glitches > 20
    assert (result.insertions, result.received) == (insertions, received)
    assert len(stream) == result.edges + 2 * result.glitches


@settings(max_examples=30, deadline=None)
@given(
    design=st.sampled_from(Design),
    kind=st.sampled_from(MOVING),
    hertz=st.floats(100.0, 500e3),
    corrections=st.integers(-30, 30),
    direction=st.sampled_from([1, -1]),
    home=st.integers(0, 3),
    seed=st.integers(0, 99),
)
def test_held_edges_leave_every_count_right_in_any_motion(design, kind, hertz, corrections, direction, home, seed):
    path = path_of(
        design, frequency_hz=hertz, corrections=corrections, direction=direction, encoder=Encoder(home_state=home)
    )
    moved = with_motion(path, kind, seed=seed)
    result = simulate(moved)
    # the count is the position's, and each completed step has added its counts
    assert result.encoder_counts == round(moved.motion.segments.end_mm)
    assert result.controller_counts == result.encoder_counts + STEP[design] * result.insertions.completed
    assert result.received.illegal_transitions == 0
    if design is not Design.ORIGINAL:  # which waits for state 00
        assert result.insertions.completed == corrections


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
@pytest.mark.parametrize("kind", [MotionKind.REVERSAL, MotionKind.DITHER, MotionKind.ADVERSARY])
def test_plain_gates_miscount_where_a_turn_falls_into_an_insertion(design, kind):
    path = path_of(design, latch=RealEdges.MERGE, cycles=800, corrections=200)
    result = simulate(with_motion(path, kind))
    assert result.insertions.real_inside > 0
    assert not result.good and not result.audit


def test_an_insertion_at_rest_is_measured_as_its_words_say():
    # the report: 4 us from the look to the first change, three more changes a microsecond apart
    slow = insertion_at_rest(path_of(Design.ORIGINAL, processor=Processor.MCS51))
    assert (slow.begin_ps, slow.end_ps, slow.every_ps) == (4_000_000, 7_000_000, 2_000_000)
    fast = insertion_at_rest(path_of(Design.C, corrections=-3, encoder=Encoder(home_state=2)))
    assert (fast.begin_ps, fast.end_ps, fast.every_ps) == (125_000, 250_000, 1)


def test_the_firmware_moves_too():
    path = path_of(Design.C, corrections=12, cycles=60, microcontroller=Microcontroller.named("8051-12mhz"))
    result = simulate(with_motion(path, MotionKind.ADVERSARY, seed=2))
    assert result.good and result.insertions.completed == 12
    assert result.insertions.real_inside is None


def test_what_cannot_be_is_refused():
    with pytest.raises(ArgumentError, match="two cycles for each correction"):
        with_motion(path_of(Design.C, cycles=10, corrections=6), MotionKind.REVERSAL)
    moved = with_motion(path_of(Design.C), MotionKind.RAMP)
    with pytest.raises(ArgumentError, match="use 40, as the motion asks"):
        replace(moved, corrections=3)


def test_progress_is_a_share_of_the_time():
    seen = []
    long = path_of(Design.C, cycles=1_500_000, corrections=3, frequency_hz=500e3)
    simulate(with_motion(long, MotionKind.RAMP), progress=seen.append)
    assert seen == sorted(seen) and seen[-1] == 1.0
    # three chunks of 2 000 000 edges, evenly in time at nearly constant speed
    assert seen[:2] == pytest.approx([1 / 3, 2 / 3], abs=0.01)
