"""PC and box inside the loop: start-up, doubts, the switch, Data Valid and latency."""

import numpy as np
import pytest

from rtec.axis import Encoder, Limits, Servo
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine import Ending, Machine, _loop_kernels, closed_loop, run_machine, straight_pass
from rtec.machine.faults import fault_records
from rtec.machine.laser_readings import end_ps
from rtec.predictors import LatheNetwork, UnidirectionalTable
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.status import Status

MS = 1_000_000_000
LIMITS = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
LATHE = LatheNetwork()
THERE_AND_BACK = straight_pass([30.0, 26.0], 20.0, LIMITS, dwell_s=1.5)


def machine(design=Design.B, **parts):
    box = InjectorSettings(
        design=design, timing=Timing.of(design, Processor.MCS51), real_edges=RealEdges.HOLD
    )  # fmt: skip
    return Machine(**{"axis_error": LATHE, "model": LATHE, "injector": box, "encoder": Encoder(home_state=1)} | parts)


NO_FAULTS = fault_records([])


class Paused:
    """A machine that runs up to a time and lets the test look into it."""

    def __init__(self, parts, motion):
        self.state = parts.state()
        self.end_ps = end_ps(motion)
        _, self._arrays = closed_loop._arrays(parts, motion, motion)
        self._models = parts.bound_models()

    def run(self, until_ps):
        no_trace = closed_loop._trace(0, 0)
        _loop_kernels.run(self.state, until_ps, *self._arrays, *self._models, no_trace, None, NO_FAULTS)
        return self.state


def test_nothing_is_requested_before_home_was_read():
    paused = Paused(machine(), THERE_AND_BACK)
    state = paused.run(5 * MS)
    assert (state.pc.state, state.node.box.state) == (PcState.WAITING, 0)
    # the PC's first look finds the box without a home; the error there would be 12 µm
    state = paused.run(15 * MS)
    assert state.pc.state == PcState.WAITING
    assert (state.pc.requests, state.pc.sent, state.injector.requested, state.injector.inserted) == (0, 0, 0, 0)
    state = paused.run(16 * MS)
    assert state.pc.state == PcState.ACTIVE
    assert (state.pc.position, state.pc.sent) == (0, 3)
    state = paused.run(18 * MS)
    assert state.node.box.accepted == 3


def test_the_request_slews_by_the_window_every_10_ms():
    paused = Paused(machine(), THERE_AND_BACK)
    accepted = [int(paused.run(t * MS).node.box.accepted) for t in range(20, 70, 10)]
    # the lathe's forward error at 1 inch, in steps of Design B: four windows of three steps and what is left
    assert accepted == [3, 6, 9, 12, round(float(LATHE.error_mm(25.4, 1)) / 0.001)]


def corrupted(samples):
    """Run with one word of the PC changed on its way for so many samples of the box."""
    paused = Paused(machine(), THERE_AND_BACK)
    state = paused.run(2_400 * MS)
    right = int(state.node.down.word0)
    state.node.down.word0 = right + 50
    paused.run((2_400 + samples) * MS)
    if state.node.down.word0 == right + 50:
        state.node.down.word0 = right
    return paused.run(paused.end_ps)


@pytest.mark.parametrize("samples", [1, 2])
def test_a_wrong_word_is_refused_and_forgiven(samples):
    state = corrupted(samples)
    assert state.node.box.refused == samples
    assert state.status == _loop_kernels.FINISHED
    assert state.node.box.status == Status.OK
    assert state.injector.completed == state.pc.target  # nothing of it was inserted


def test_a_third_wrong_word_holds_the_machine():
    state = corrupted(3)
    assert state.node.box.refused == 3
    assert state.status == _loop_kernels.HELD
    assert state.pc.state == PcState.HOLD
    assert state.node.box.status == Status.I_STILL_DONT_BELIEVE_YOU


def test_a_box_that_believes_less_than_the_pc_holds_the_machine(monkeypatch):
    fill = HandshakeSettings.fill_box

    def narrow(self, box, *, switch_on=True):
        fill(self, box, switch_on=switch_on)
        box.window = 1

    monkeypatch.setattr(HandshakeSettings, "fill_box", narrow)
    result = run_machine(machine(), THERE_AND_BACK)
    assert result.ending is Ending.HELD
    assert result.status is Status.I_STILL_DONT_BELIEVE_YOU
    assert result.refused == 3
    assert result.insertions.inserted == 0
    assert result.simulated_s < 0.1
    assert result.audit


def test_the_switch_forbids_corrections():
    result = run_machine(machine(switch_on=False), THERE_AND_BACK)
    assert result.ending is Ending.FINISHED
    assert result.status is Status.DISABLED
    assert result.insertions.inserted == 0
    assert result.pending_steps == result.wanted_steps > 80
    assert result.audit
    assert result.controller_counts == result.encoder_counts


def test_the_switch_says_nothing_where_nothing_is_wanted():
    perfect = UnidirectionalTable(positions_mm=[0, 50], errors_mm=[0, 0], backlash_mm=0.0)
    result = run_machine(machine(switch_on=False, model=perfect, axis_error=perfect), THERE_AND_BACK)
    assert (result.status, result.pending_steps) == (Status.OK, 0)


def final(result):
    return (result.insertions.completed, result.encoder_counts, result.controller_counts, result.pending_steps)


@pytest.mark.parametrize("latency_ms", [0, 0.1, 3, 9])
def test_latency_changes_nothing_in_the_end(latency_ms):
    parts = machine(handshake=HandshakeSettings(latency_ps=round(latency_ms * MS)))
    result = run_machine(parts, THERE_AND_BACK)
    assert final(result) == final(run_machine(machine(), THERE_AND_BACK))
    assert (result.refused, result.status, result.audit) == (0, Status.OK, True)


def test_words_that_are_being_updated_are_read_again():
    # the words change 0.1 ms before each look, and are not valid for 0.3 ms
    busy = run_machine(machine(handshake=HandshakeSettings(update_ps=300_000_000)), THERE_AND_BACK)
    plain = run_machine(machine(), THERE_AND_BACK)
    assert plain.not_valid == 0
    assert busy.not_valid == 2 * busy.exchanges + 2  # two looks in vain for each; the first one asks for home
    assert final(busy) == final(plain)
    assert busy.audit


def test_large_steps_of_the_request_are_taken_in_windows_only():
    steps = np.diff([int(t) for t in _accepted_at_every_ms()])
    assert np.abs(steps).max() == 3


def _accepted_at_every_ms():
    paused = Paused(machine(), THERE_AND_BACK)
    return [paused.run(t * MS).node.box.accepted for t in range(1, 4_500)]


def test_the_pc_sees_the_last_count_before_the_axis_is_taken_for_resting(monkeypatch):
    monkeypatch.setattr(closed_loop, "_slices", lambda *_: 1)  # nothing but the machine itself bounds the skipping
    # 21 µm back is just more than the hysteresis of the direction, and the axis stops dead on the last count
    motion = straight_pass([30.0, 29.979], 20.0, LIMITS, dwell_s=1.5)
    abrupt = machine(servo=Servo(lag_s=0.0))
    skipped, computed = run_machine(abrupt, motion), run_machine(abrupt, motion, skip_rest=False)
    assert final(skipped) == final(computed)
    assert skipped.insertions == computed.insertions
    assert skipped.insertions.completed > 80  # the reverse error


def test_probing_stops_the_corrections():
    paused = Paused(machine(), THERE_AND_BACK)
    state = paused.run(1_000 * MS)
    state.pc.probing = 1
    state = paused.run(1_020 * MS)
    before = int(state.injector.inserted)
    assert state.node.box.status == Status.PROBING
    state = paused.run(3_000 * MS)  # through the reversal
    assert state.injector.inserted == before
    state.pc.probing = 0
    state = paused.run(paused.end_ps)
    assert state.injector.completed == state.pc.target


def test_a_wider_window_slews_faster():
    wide = Paused(machine(handshake=HandshakeSettings(window_steps=20)), THERE_AND_BACK)
    assert wide.run(20 * MS).node.box.accepted == round(float(LATHE.error_mm(25.4, 1)) / 0.001)
