"""Faults in the closed loop, where PC and box exchange words: with the box's model, and with its program."""

import pytest

from rtec.board import Microcontroller
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.machine import Ending, Machine, run_machine, straight_pass
from rtec.machine.faults import Fault, FaultKind, Trigger
from rtec.requester.status import Status
from tests.machines import LIMITS, SLOPE, box_of

S = 10**12
ONE_SECOND = {"from_ps": 1 * S, "until_ps": 2 * S}


@pytest.fixture(params=[False, True], ids=["model", "firmware"])
def firmware(request):
    return request.param


def run(*faults, firmware=False, design=Design.C, skip_rest=True, motion=None, **parts):
    """Go to 4 mm at 1 mm/s with a box of a design."""
    box = box_of(design)
    processor = Microcontroller.named("8051-12mhz") if firmware else None
    parts = {"axis_error": SLOPE, "model": SLOPE, "injector": box, "microcontroller": processor} | parts
    motion = straight_pass([4.0], 1.0, LIMITS) if motion is None else motion
    return run_machine(Machine(faults=faults, **parts), motion, skip_rest=skip_rest)


def at_axis(kind, **when):
    return Fault(kind=kind, place=1, **(ONE_SECOND | when))


def fired(result):
    return [activation.times for activation in result.fired]


def test_a_box_that_starts_again_has_lost_its_home_and_the_pc_holds(firmware):
    result = run(at_axis(FaultKind.BOX_RESTARTED), firmware=firmware)
    assert (result.ending, result.status) == (Ending.HELD, Status.NOT_HOMED)
    assert 1.0 < result.simulated_s < 1.02
    assert fired(result) == [1]
    assert result.insertions.completed == 0
    # what was inserted before stands on the controller's side, and no total accounts for it any more
    assert result.audit_counts == 2 * 4


def test_a_dead_box_passes_the_lines_and_the_axis_goes_on_uncorrected(firmware):
    result = run(at_axis(FaultKind.POWER_LOST, until_ps=None), firmware=firmware)
    assert result.ending is Ending.FINISHED
    assert result.insertions.completed == 4
    assert result.audit


def test_without_a_pc_the_total_stays_as_it_was(firmware):
    result = run(Fault(kind=FaultKind.PC_KILLED, from_ps=1 * S), firmware=firmware)
    assert result.ending is Ending.FINISHED
    assert result.insertions.completed == 4  # 8 um at not quite half a millimetre
    assert fired(result) == [1]
    assert result.audit


def test_a_line_that_is_cut_loses_counts_that_the_audit_finds(firmware):
    result = run(at_axis(FaultKind.CABLE_OPEN), firmware=firmware)
    assert fired(result)[0] > 0
    # box and controller see the same dead lines; the drive goes on until they live again
    assert result.audit_counts < -1000
    assert result.insertions.completed * 2 + result.audit_counts == (result.controller_counts - result.encoder_counts)


def test_an_old_position_asks_for_an_old_correction(firmware):
    """The controller goes on; the PC reads where the axis was a second before, and catches up when that is over."""
    stale = run(at_axis(FaultKind.STALE_DATA_VALID, until_ps=None), firmware=firmware)
    assert fired(stale)[0] > 100
    assert stale.wanted_steps == stale.insertions.completed == 4
    assert stale.audit
    over = run(at_axis(FaultKind.STALE_DATA_VALID), firmware=firmware)
    assert over.wanted_steps == over.insertions.completed == 39


def test_the_open_switch_keeps_corrections_back_until_it_is_closed(firmware):
    thrown = run(at_axis(FaultKind.SWITCH_THROWN, until_ps=None), firmware=firmware)
    assert thrown.status is Status.DISABLED
    assert thrown.insertions.completed == 4
    back = run(at_axis(FaultKind.SWITCH_THROWN), firmware=firmware)
    assert back.insertions.completed == 39
    assert back.audit


def test_probing_corrects_nothing_and_what_was_due_comes_after_it(firmware):
    probing = run(firmware=firmware, probing=((1 * S, 20 * S),))
    assert probing.insertions.completed == 4
    assert probing.status is Status.PROBING
    over = run(firmware=firmware, probing=((1 * S, 2 * S),))
    assert over.insertions.completed == 39
    assert over.status is Status.OK


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (Fault(kind=FaultKind.FRAME_LOST, from_ps=0), "frame lost"),
        (Fault(kind=FaultKind.CLOCK_JUMP_BACK, from_ps=0, delay_ps=S), "PC clock jumps back"),
        (Fault(kind=FaultKind.GLITCHES, place=2, from_ps=0), "axis 1, the only one"),
    ],
)
def test_what_cannot_happen_here_is_refused(fault, said):
    with pytest.raises(ArgumentError, match=said):
        run(fault)


def test_without_a_box_only_lines_can_fail():
    bare = {"injector": None, "microcontroller": None}
    with pytest.raises(ArgumentError, match="faults of the lines"):
        run(at_axis(FaultKind.POWER_LOST), **bare)
    result = run(at_axis(FaultKind.GLITCHES), **bare)
    assert fired(result)[0] > 50


WHEN_AT_REST = [
    ((at_axis(FaultKind.BOX_RESTARTED, from_ps=S // 10),), ()),
    ((at_axis(FaultKind.POWER_LOST, from_ps=47 * S // 10, until_ps=49 * S // 10),), ()),
    ((at_axis(FaultKind.SWITCH_THROWN, from_ps=S // 10, until_ps=2 * S),), ()),
    ((at_axis(FaultKind.STALE_DATA_VALID, from_ps=45 * S // 10, until_ps=48 * S // 10),), ()),
    ((at_axis(FaultKind.CABLE_OPEN, from_ps=0, until_ps=S // 100),), ()),
    ((), ((47 * S // 10, 49 * S // 10),)),
]


@pytest.mark.parametrize(("faults", "probing"), WHEN_AT_REST)
def test_an_axis_at_rest_that_is_skipped_over_meets_every_fault(faults, probing, firmware):
    """It stands at home for most of a second, and at 4 mm in the end."""
    motion = straight_pass([0.0, 4.0], 1.0, LIMITS, dwell_s=0.8)
    skipped, computed = (
        run(*faults, firmware=firmware, probing=probing, motion=motion, skip_rest=skip) for skip in (True, False)
    )
    assert computed.ticks_skipped == 0
    assert skipped.ticks_skipped > 0 or skipped.ending is Ending.HELD
    for name in ("ending", "status", "simulated_s", "insertions", "audit_counts", "fired", "wanted_steps", "refused"):
        assert getattr(skipped, name) == getattr(computed, name), name


def test_away_from_home_nobody_takes_the_place_for_home(firmware):
    result = run(at_axis(FaultKind.POWER_LOST, from_ps=0, until_ps=5 * S), firmware=firmware)
    assert result.status is Status.NOT_HOMED
    assert result.insertions.completed == 0
    assert result.ending is Ending.FINISHED


WAITING = {"trigger": Trigger.WHILE_INSERTING}
FOR_GOOD = {"until_ps": None}


@pytest.mark.parametrize(
    ("faults", "probing"),
    [
        ((at_axis(FaultKind.POWER_LOST), at_axis(FaultKind.POWER_LOST, from_ps=3 * S // 2, until_ps=4 * S)), ()),
        (
            (
                at_axis(FaultKind.STALE_DATA_VALID),
                at_axis(FaultKind.TORN_POSITION, from_ps=3 * S // 2, until_ps=None),
            ),
            (),
        ),
        ((at_axis(FaultKind.LINE_BROKEN, **FOR_GOOD), at_axis(FaultKind.CABLE_OPEN, from_ps=2 * S, **FOR_GOOD)), ()),
        ((at_axis(FaultKind.POWER_LOST, **WAITING), at_axis(FaultKind.SWITCH_THROWN, **WAITING)), ()),
        ((), ((1 * S, 3 * S), (2 * S, 4 * S))),
    ],
)
def test_what_overlaps_is_refused(faults, probing):
    with pytest.raises(ArgumentError, match="one that begins when this is over"):
        run(*faults, probing=probing)


def test_an_open_switch_cannot_be_thrown():
    with pytest.raises(ArgumentError, match="a switch that is closed"):
        run(at_axis(FaultKind.SWITCH_THROWN), switch_on=False)
