"""PC and box inside the loop: start-up, doubts, the switch, Data Valid and latency."""

from rtec.axis import Encoder, Servo
from rtec.injector import Design
from rtec.machine import Machine, closed_loop, run_machine, straight_pass
from rtec.predictors import LatheNetwork, UnidirectionalTable
from rtec.requester.settings import HandshakeSettings
from rtec.requester.status import Status
from tests.machines import LIMITS, box_of

LATHE = LatheNetwork()
THERE_AND_BACK = straight_pass([30.0, 26.0], 20.0, LIMITS, dwell_s=1.5)


def machine(design=Design.B, **parts):
    box = box_of(design)
    return Machine(**{"axis_error": LATHE, "model": LATHE, "injector": box, "encoder": Encoder(home_state=1)} | parts)


def test_the_switch_says_nothing_where_nothing_is_wanted():
    perfect = UnidirectionalTable(positions_mm=[0, 50], errors_mm=[0, 0], backlash_mm=0.0)
    result = run_machine(machine(switch_on=False, model=perfect, axis_error=perfect), THERE_AND_BACK)
    assert (result.status, result.pending_steps) == (Status.OK, 0)


def final(result):
    return (result.insertions.completed, result.encoder_counts, result.controller_counts, result.pending_steps)


def test_words_that_are_being_updated_are_read_again():
    # the words change 0.1 ms before each look, and are not valid for 0.3 ms
    busy = run_machine(machine(handshake=HandshakeSettings(update_ps=300_000_000)), THERE_AND_BACK)
    plain = run_machine(machine(), THERE_AND_BACK)
    assert plain.not_valid == 0
    assert busy.not_valid == 2 * busy.exchanges + 2  # two looks in vain for each; the first one asks for home
    assert final(busy) == final(plain)
    assert busy.audit


def test_the_pc_sees_the_last_count_before_the_axis_is_taken_for_resting(monkeypatch):
    monkeypatch.setattr(closed_loop, "_slices", lambda *_: 1)  # nothing but the machine itself bounds the skipping
    # 21 µm back is just more than the hysteresis of the direction, and the axis stops dead on the last count
    motion = straight_pass([30.0, 29.979], 20.0, LIMITS, dwell_s=1.5)
    abrupt = machine(servo=Servo(lag_s=0.0))
    skipped, computed = run_machine(abrupt, motion), run_machine(abrupt, motion, skip_rest=False)
    assert final(skipped) == final(computed)
    assert skipped.insertions == computed.insertions
    assert skipped.insertions.completed > 80  # the reverse error
