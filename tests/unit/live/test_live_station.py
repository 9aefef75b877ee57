"""What an operator's orders do at an axis, and what the box says of the frames that it does not take."""

import pytest

from rtec.errors import ArgumentError
from rtec.link.frame import Frame
from rtec.live.orders import carry_out, parse_order
from rtec.live.words import box_words
from rtec.machine.station import Alarm
from rtec.requester.status import BoxState, Status


def order(pair, *texts):
    for text in texts:
        carry_out(parse_order(text), pair.box.stations)


def start_up_anew(pair, make):
    """Let another PC acknowledge a box that has stopped for good, and take the axis home."""
    from rtec.live.pc_loop import PcLoop

    pair.far.inbox.clear()
    pair.pc, pair.pc_lives = PcLoop(make().pc.nodes, pair.far), True
    pair.pc.nodes[0].acknowledge()


@pytest.mark.parametrize("seconds", [1.0, 4.0])
def test_an_old_move_never_comes_back(together, seconds):
    """Interrupted on its way, or carried out: after another homing the axis stands still."""
    pair = together()
    pair.run(0.3)
    order(pair, "go 30 mm")
    pair.run(seconds)
    pair.pc_lives = False
    pair.run(0.3)
    assert pair.box.stations[0].view.status is Status.LINK_LOST
    order(pair, "home")
    pair.run(8.0)
    start_up_anew(pair, together)
    pair.run(3.0)
    view = pair.box.stations[0].view
    assert view.box_state is BoxState.RUNNING
    assert view.position_mm == pytest.approx(0.0, abs=0.02)


def test_a_move_interrupted_by_a_restart_is_forgotten_and_said(together):
    """Of the orders of a script, the one given after the restart counts."""
    pair = together()
    pair.run(0.3)
    order(pair, "go 30 mm")
    pair.run(0.5)
    order(pair, "restart")
    pair.run(0.5)
    station = pair.box.stations[0]
    assert (station.moves_forgotten, station.view.speed_mm_s) == (1, 0.0)
    order(pair, "home")
    pair.run(3.0)
    order(pair, "go 2 mm")
    start_up_anew(pair, together)
    pair.run(1.0)
    assert station.view.position_mm == pytest.approx(2.0, abs=0.02)
    assert station.moves_forgotten == 1


def test_go_is_refused_while_the_machine_is_held(together):
    pair = together()
    pair.run(0.3)
    order(pair, "fault lines-swapped", "go 30 mm")
    pair.run(2.0)
    assert pair.box.stations[0].view.alarm is not Alarm.NONE
    with pytest.raises(ArgumentError, match=r"the machine is held.*home"):
        order(pair, "go 5 mm")


@pytest.mark.parametrize("fault", ["cable-open", "lines-swapped", "line-broken"])
def test_clear_and_home_at_once_take_the_axis_home(together, fault):
    """The lines jump back when the fault ends; the controller must not take that for another alarm."""
    pair = together()
    pair.run(0.3)
    order(pair, "go 30 mm", f"fault {fault}")
    pair.run(2.0)
    station = pair.box.stations[0]
    assert station.view.held
    order(pair, "clear", "home")
    pair.run(9.0)
    assert (station.view.alarm, station.view.position) == (Alarm.NONE, 0)
    start_up_anew(pair, together)
    pair.run(1.0)
    assert (station.view.box_state, station.view.completed) == (BoxState.RUNNING, 3)


def test_a_lost_link_names_the_frames_that_were_refused(together):
    pair = together()
    pair.run(0.3)
    good = next(frame for _, frame in reversed(pair.far.sent) if frame.identifier == 0x201)
    bad = Frame(identifier=0x201, data=bytes([good.data[0] ^ 1]) + good.data[1:])
    pair.pc_lives = False
    begin_ps = pair.clock.now_ps
    for k in range(10):
        pair.near.put(bad, at_ps=begin_ps + k * 10**9)
    for k, frame in enumerate((good, Frame(identifier=0x203, data=bytes(8)), Frame(identifier=0x201, data=b"\x01"))):
        pair.near.put(frame, at_ps=begin_ps + (20 + k) * 10**9)
    pair.run(0.2)
    assert box_words(pair.box.stations[0].view) == (
        "stopped for good, hold contact open: no valid request from the PC for longer than the watchdog timeout; "
        "heard and not taken: 10 x 0x201 (checksum wrong), 1 x 0x201 (sequence counter repeated), "
        "1 x 0x203 (for axis 3), 1 x 0x201 (1 bytes instead of 8)"
    )


def test_a_lost_link_says_where_nothing_was_heard(together):
    pair = together()
    pair.run(0.3)
    pair.pc_lives = False
    pair.run(0.2)
    assert box_words(pair.box.stations[0].view).endswith("watchdog timeout; nothing was heard")
