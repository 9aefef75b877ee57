"""Skipping what cannot change is exact, and the audit holds, for any short program on any machine."""

import numpy as np
from hypothesis import given, settings, strategies as st

from rtec.axis import Dwell, Encoder, Limits, Move, Program, Servo, plan
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine import Laser, Machine, MeasuringRun, run_machine
from rtec.predictors import BidirectionalTable
from rtec.requester.settings import HandshakeSettings

LIMITS = Limits(max_speed_mm_s=60.0, max_acceleration_mm_s2=800.0, rapid_mm_s=60.0)
MS = 1_000_000_000
SAME = (
    "ending", "insertions", "received", "encoder_counts", "controller_counts", "wanted_steps", "pending_steps",
    "beyond_word_steps", "status", "refused", "exchanges", "not_valid", "audit_counts", "following_max_mm",
    "ticks", "simulated_s",
)  # fmt: skip


@st.composite
def tasks(draw):
    """A few moves, each followed by a dwell that is read."""
    blocks, targets = [Dwell(seconds=0.05)], []
    for _ in range(draw(st.integers(1, 4))):
        target = draw(st.floats(-3.0, 3.0).map(lambda x: round(x, 3)))
        blocks.append(Move(target_mm=target, feed_mm_s=draw(st.floats(1.0, 50.0))))
        blocks.append(Dwell(seconds=draw(st.floats(0.3, 1.5))))
        targets.append(target)
    motion = plan(Program(blocks=tuple(blocks)), LIMITS)
    last = np.arange(2, len(blocks), 2)
    return MeasuringRun(
        motion=motion,
        target_mm=np.array(targets),
        direction=np.ones(len(targets), np.int8),
        run=np.arange(len(targets)),
        begins_ps=motion.block_end_ps[last - 1],
        ends_ps=motion.block_end_ps[last],
    )


@st.composite
def tables(draw):
    positions = [-3.0, -1.0, 0.5, 3.0]
    forward = draw(st.lists(st.floats(-0.05, 0.05), min_size=4, max_size=4))
    play = draw(st.lists(st.floats(0.0, 0.1), min_size=4, max_size=4))
    return BidirectionalTable(
        forward_positions_mm=positions,
        forward_errors_mm=forward,
        reverse_positions_mm=positions,
        reverse_errors_mm=[low + gap for low, gap in zip(forward, play, strict=True)],
    )


@st.composite
def machines(draw):
    error = draw(tables())
    design = draw(st.sampled_from([None, *Design]))
    box = None
    if design is not None:
        timing = Timing.of(design, draw(st.sampled_from([Processor.MCS51, Processor.FAST])))
        box = InjectorSettings(design=design, timing=timing, real_edges=draw(st.sampled_from(RealEdges)))
    box_ms, pc_ms = draw(st.sampled_from([(1.0, 10.0), (0.7, 10.0), (1.0, 9.7), (1.3, 3.9)]))
    return Machine(
        axis_error=error,
        model=draw(st.sampled_from([error, BidirectionalTable.sampled_from(error, [-2.0, 2.0])])),
        injector=box,
        encoder=Encoder(home_state=draw(st.integers(0, 3))),
        servo=Servo(
            period_ps=draw(st.sampled_from([MS, 700_000_001])),
            deadband_counts=draw(st.sampled_from([0.0, 0.5, 40.0])),
            lag_s=draw(st.sampled_from([0.0, 0.01])),
            gain_per_s=draw(st.sampled_from([16.0, 60.0])),
        ),
        handshake=HandshakeSettings(
            box_period_ps=round(box_ms * MS),
            pc_period_ps=round(pc_ms * MS),
            update_ps=draw(st.sampled_from([0, 20_000_000, 500_000_000])),
            latency_ps=round(draw(st.sampled_from([0.0, 0.1, 4.5, 10.0])) * MS),
        ),
        laser=Laser(window_mm=draw(st.sampled_from([0.01, 0.3])), dwell_s=0.2),
        switch_on=draw(st.sampled_from([True, True, True, False])),
    )


@settings(max_examples=60, deadline=None)
@given(machine=machines(), task=tasks())
def test_skipping_at_rest_is_exact(machine, task):
    skipped, computed = run_machine(machine, task), run_machine(machine, task, skip_rest=False)
    assert {name: getattr(skipped, name) for name in SAME} == {name: getattr(computed, name) for name in SAME}
    # a reading that moves is summed in other portions: the last digits of a sum of small differences
    np.testing.assert_allclose(skipped.deviation_mm, computed.deviation_mm, rtol=0, atol=1e-14, equal_nan=True)
    assert computed.ticks_skipped == 0


def test_a_reading_that_is_cut_short_has_no_rest_beyond_its_end():
    # the axis creeps until shortly before the dwell ends, sooner than the laser has looked for as long as it would
    blocks = (
        Dwell(seconds=0.05), Move(target_mm=1.0, feed_mm_s=1.0), Dwell(seconds=0.3046875),
        Move(target_mm=1.0, feed_mm_s=1.0), Dwell(seconds=1.0),
    )  # fmt: skip
    motion = plan(Program(blocks=blocks), LIMITS)
    task = MeasuringRun(
        motion=motion, target_mm=np.ones(2), direction=np.ones(2, np.int8), run=np.arange(2),
        begins_ps=motion.block_end_ps[[1, 3]], ends_ps=motion.block_end_ps[[2, 4]],
    )  # fmt: skip
    servo = Servo(gain_per_s=16.0, lag_s=0.0, deadband_counts=0.0)
    machine = Machine(servo=servo, laser=Laser(window_mm=0.01, dwell_s=0.2))
    skipped, computed = run_machine(machine, task), run_machine(machine, task, skip_rest=False)
    assert skipped.ticks_skipped > 500
    np.testing.assert_allclose(skipped.deviation_mm, computed.deviation_mm, rtol=0, atol=1e-14)
    assert computed.deviation_mm[0] < computed.deviation_mm[1] - 0.0005


@settings(max_examples=40, deadline=None)
@given(machine=machines(), task=tasks())
def test_controller_encoder_and_corrections_agree(machine, task):
    result = run_machine(machine, task)
    off = result.controller_counts - result.encoder_counts - result.insertions.completed * result.step_counts
    assert off in (result.audit_counts, 0)  # what only the monitor has seen is reported, too
    if machine.injector is None or machine.injector.real_edges is RealEdges.HOLD:
        assert result.audit
    assert result.refused == 0
    assert result.insertions.completed == result.insertions.requested or machine.injector.design is Design.ORIGINAL


@settings(max_examples=25, deadline=None)
@given(machine=machines(), task=tasks())
def test_the_true_position_stays_within_the_play(machine, task):
    trace = run_machine(machine, task, trace_every=1).trace
    x_mm, true_mm = trace[:, 2], trace[:, 3]
    error = machine.axis_error
    assert (true_mm >= x_mm + error.error_mm(x_mm, 1) - 1e-9).all()
    assert (true_mm <= x_mm + error.error_mm(x_mm, -1) + 1e-9).all()
    # the speed changes evenly in a tick. Within one in which it turns, after a third of its change, the axis ends
    # behind where it began by 1/6 of the change times the tick, 1/18 of it having pushed the slide ahead before that
    moves_mm, ticks_s = np.diff(x_mm), np.diff(trace[:, 0])
    speed = [0.0]
    for move_mm, tick_s in zip(moves_mm, ticks_s, strict=True):
        speed.append(2.0 * move_mm / tick_s - speed[-1])
    turned_mm = np.where(np.multiply(speed[:-1], speed[1:]) < 0.0, np.abs(np.diff(speed)) * ticks_s, 0.0)
    steepest = 1.0 + 0.2 / 1.5  # mm a mm, of the curves drawn
    assert (moves_mm * np.diff(true_mm) >= -steepest * turned_mm**2 / 108.0 - 1e-12).all()
