"""The machine with the real firmware in its box: what the behavioural box does, it does, and every count is right."""

from dataclasses import replace

import pytest

from rtec.board import Microcontroller
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.machine import Machine, run_machine, straight_pass
from rtec.machine.closed_loop import Ending
from rtec.predictors import BidirectionalTable
from rtec.requester.settings import HandshakeSettings
from rtec.requester.status import Status
from tests.machines import LIMITS, box_of

# 0.2 mm over 40 mm of travel, and 30 um of play
ERROR = BidirectionalTable(
    forward_positions_mm=[-1.0, 41.0],
    forward_errors_mm=[0.0, 0.1],
    reverse_positions_mm=[-1.0, 41.0],
    reverse_errors_mm=[0.03, 0.13],
)
TWELVE_MHZ = Microcontroller.named("8051-12mhz")


def machine(design, microcontroller=TWELVE_MHZ, **changes):
    box = box_of(design)
    return Machine(axis_error=ERROR, model=ERROR, injector=box, microcontroller=microcontroller, **changes)


def motion(dwell_s=1.0):
    return straight_pass([20.0, 10.0], 5.0, LIMITS, dwell_s=dwell_s)


@pytest.mark.parametrize("design", list(Design))
def test_the_same_total_is_inserted_as_by_the_model_and_every_count_is_right(design):
    real = run_machine(machine(design), motion())
    model = run_machine(machine(design, None), motion())
    assert real.ending is Ending.FINISHED
    assert real.firmware_fault is None
    assert real.audit
    assert real.audit_counts == real.pending_steps == 0
    assert real.status is Status.OK
    assert real.insertions.completed == model.insertions.completed != 0
    assert real.controller_counts == pytest.approx(10_000, abs=1)
    # both go to where the predictor sends them
    assert real.encoder_counts == pytest.approx(model.encoder_counts, abs=1)
    # a cycle is a microsecond
    assert real.cycles == pytest.approx(real.simulated_s * 1e6, rel=0.01)


@pytest.mark.parametrize("design", [Design.A, Design.B])
def test_leaving_out_what_repeats_itself_at_rest_changes_nothing(design):
    skipping, plain = (run_machine(machine(design), motion(2.0), skip_rest=skip) for skip in (True, False))
    # a round of A's lasts 256 readings, until the free-running gate timer stands where it stood
    assert skipping.cycles_skipped > 256 * 1000
    assert plain.cycles_skipped == 0
    assert abs(skipping.cycles - plain.cycles) <= 4
    for name in ("encoder_counts", "controller_counts", "insertions", "exchanges", "wanted_steps", "audit"):
        assert getattr(skipping, name) == getattr(plain, name), name


@pytest.mark.parametrize("name", ["8051-24mhz", "one-clock-25mhz", "one-clock-100mhz", "12-clock 11.0592MHz"])
def test_other_processors_do_the_same(name):
    result = run_machine(machine(Design.C, Microcontroller.named(name)), motion())
    assert result.audit
    assert result.pending_steps == 0
    assert result.insertions.completed != 0


def test_the_pc_meets_data_valid_low_now_and_then():
    result = run_machine(machine(Design.ORIGINAL), motion())
    # the words change for some 40 cycles of each 1000
    assert 0.005 < result.not_valid / result.exchanges < 0.2


@pytest.mark.parametrize("other", [{"window_steps": 5}, {"grace_readings": 1}])
def test_windows_other_than_the_firmwares_are_refused(other):
    with pytest.raises(ArgumentError, match=r"rtec\.inc"):
        machine(Design.C, handshake=replace(HandshakeSettings(), **other))
