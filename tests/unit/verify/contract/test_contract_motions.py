"""Motions as runs of an algorithm: streams that an encoder can send, and how their insertions end."""

import itertools

import pytest

from rtec.axis import Dwell, Move, Program
from rtec.axis.motion import MotionKind
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.motions import insertion_window, motion_cases, motion_for, stream_of
from rtec.verify.contract.streams import can_be
from rtec.verify.contract.trials import Trials

PART = Program(
    blocks=(Move(target_mm=5.0, feed_mm_s=20.0), Dwell(seconds=3.0), Move(target_mm=-1.0, feed_mm_s=9.0)),
    start_mm=1.0,
)
EVERY = [
    (kind, PART if kind is MotionKind.PROGRAMME else None) for kind in MotionKind if kind is not MotionKind.CAPTURE
]


def trials_of(design=Design.C, latch=RealEdges.HOLD, processor=Processor.FAST, **limits):
    box = BuiltIn(InjectorSettings(design=design, timing=Timing.of(design, processor), real_edges=latch))
    trials = Trials(box, Contract.of(design, **limits))
    assert trials.measure_settling() is None
    return trials


@pytest.mark.parametrize(("kind", "program"), EVERY, ids=lambda value: getattr(value, "value", ""))
def test_an_encoder_within_the_contract_can_send_every_stream(kind, program):
    trials = trials_of(frequency_hz=80e3, acceleration_hz_s=2e7)
    made = list(itertools.islice(motion_cases(kind, program=program)(trials), 150))
    assert len(made) >= 24
    for case in made:
        assert can_be(case.stream, trials.contract), case.title
        assert case.stream.requests_ps.size == 1
        assert case.stream.until_ps > case.stream.last_ps
    # both directions, both signs
    assert len({(case.stream.totals[0], case.stream.moves[0]) for case in made}) == 4


@pytest.mark.parametrize("kind", [MotionKind.REVERSAL, MotionKind.DITHER, MotionKind.ADVERSARY])
@pytest.mark.parametrize("design", [Design.A, Design.C])
def test_plain_gates_fall_in_a_motion_and_held_edges_stand(design, kind):
    cases = motion_cases(kind, seed=1)
    plain, held = trials_of(design, RealEdges.MERGE), trials_of(design)
    assert plain.first_wrong(itertools.islice(cases(plain), 200))[0] is not None
    assert held.first_wrong(itertools.islice(cases(held), 200))[0] is None


def test_the_seed_draws_the_adversary():
    trials = trials_of()

    def streams(seed):
        return [str(c.stream) for c in itertools.islice(motion_cases(MotionKind.ADVERSARY, seed=seed)(trials), 5)]

    assert streams(1) == streams(1) != streams(2)


def test_a_stream_begins_in_its_state_and_goes_the_way_of_the_motion():
    motion = motion_for(MotionKind.RAMP, 0, Contract(step_counts=2, frequency_hz=1e3), direction=-1)
    stream = stream_of(motion, 3, -1)
    assert stream.state == 3 and set(stream.moves.tolist()) == {-1}
    assert stream.moves.sum() == round(motion.segments.end_mm)
    assert stream.totals.tolist() == [-1]


def test_an_insertion_at_rest_is_measured_behind_the_door():
    # Original on the 8051: 4 us from a look to the first change, 3 us of pulses; a look may be 2 us away
    window = insertion_window(trials_of(Design.ORIGINAL, processor=Processor.MCS51, frequency_hz=20e3))
    assert 4_000_000 <= window.begin_ps <= 6_000_000
    assert window.end_ps - window.begin_ps == 3_000_000
