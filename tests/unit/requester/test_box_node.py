"""The box as a node: what it says at home, what its switch keeps it from, and what keeps its watch alive."""

import pytest
from node_oracle import (
    CORRECTIONS,
    ENABLE,
    GO_HOME,
    LARGE,
    POSITION,
    REQUEST,
    RESET,
    STATUS,
    Request,
    is_right,
    signed,
)

from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.link.frame import Frame
from rtec.machine.station import Move, Station, StationSettings
from rtec.requester import BoxState, Status

MS = 10**9


class Desk:
    """A box and a hand that sends it requests in order."""

    def __init__(self, moves=()):
        timing = Timing.of(Design.A, Processor.MCS51)
        injector = InjectorSettings(design=Design.A, timing=timing, real_edges=RealEdges.HOLD)
        self.station = Station(StationSettings(axis=1, injector=injector), moves)
        self.sequence = 0
        self.sent = []

    def wait(self, time_ms):
        self.sent = self.station.advance(until_ps=self.station.now_ps + time_ms * MS)
        return self.sent

    def ask(self, total=0, flags=ENABLE, wait_ms=5):
        self.sequence += 1
        data = Request(self.sequence % 256, total, flags, 1, self.station.view.session).packed(1)
        self.station.receive(Frame(identifier=REQUEST + 1, data=data))
        return self.wait(wait_ms)

    def home(self):
        self.ask(flags=GO_HOME)
        assert self.station.view.box_state is BoxState.RUNNING

    def said(self, kind):
        return [(t_ps, frame.data) for t_ps, frame in self.sent if frame.identifier == kind + 1]


@pytest.fixture
def desk():
    desk = Desk()
    desk.wait(13)
    return desk


def test_the_home_position_is_said_at_once(desk):
    asked_ps = desk.station.now_ps
    desk.ask(flags=GO_HOME, wait_ms=2)
    (t_ps, position), *_ = desk.said(POSITION)
    assert t_ps - asked_ps <= MS  # the next reading, not the next cycle
    assert is_right(POSITION + 1, position)
    assert (signed(position[2:6]), position[6] & 1) == (0, 1)
    assert {frame.identifier for _, frame in desk.sent} == {STATUS + 1, CORRECTIONS + 1, POSITION + 1}


def test_an_axis_that_has_left_home_meanwhile_is_not_homed(desk):
    """Told to take home at the switch, pushed off it before its next reading."""
    desk.ask(flags=GO_HOME, wait_ms=0)
    desk.station._state.node.at_home = 0
    desk.station._state.encoder.count += 50
    desk.wait(5)
    assert desk.station.view.box_state is BoxState.NOT_HOMED


def homed_again(desk):
    """Correct by two steps, lose the link, acknowledge twice, and home again with the axis back at its switch."""
    desk.home()
    desk.ask(2)
    desk.wait(300)
    assert (desk.station.view.status, desk.station.view.completed) == (Status.LINK_LOST, 2)
    desk.station.go_home()
    desk.wait(500)
    for _ in range(2):
        desk.ask(flags=RESET)
    assert desk.station.view.box_state is BoxState.NOT_HOMED
    return desk.ask(flags=GO_HOME, wait_ms=2)


def test_totals_at_home_are_zero_from_the_first_word_on(desk):
    homed_again(desk)
    totals = [(signed(data[2:4]), signed(data[4:6])) for _, data in desk.said(CORRECTIONS)]
    assert totals
    assert set(totals) == {(0, 0)}


def test_a_large_correction_passes_right_after_home(desk):
    """NISTIR 4832: at restart with a hot machine."""
    homed_again(desk)
    desk.ask(40, ENABLE | LARGE)
    assert (desk.station.view.requested, desk.station.view.status) == (40, Status.OK)


def test_what_is_added_up_agrees_with_the_word_over_a_homing_elsewhere():
    desk = Desk([Move(target_mm=2.0, speed_mm_s=20.0)])
    desk.wait(13)
    desk.home()
    for _ in range(60):
        desk.ask()
    desk.station.restart()
    desk.station.go(0.0, 20.0)
    desk.wait(5)
    desk.station.go_home()
    frames = desk.wait(2000)
    frames += desk.ask(flags=GO_HOME)
    assert desk.station.view.box_state is BoxState.RUNNING
    words = [frame.data for _, frame in frames if frame.identifier == POSITION + 1]
    assert min(signed(data[2:6]) for data in words) < -1000  # what the box counts from where it was switched on
    for data in words:
        assert (signed(data[6:8]) >> 1) % (1 << 15) == signed(data[2:6]) % (1 << 15)
    assert signed(words[-1][2:6]) == 0


def test_the_switch_says_so_where_a_total_of_zero_is_kept_from_it(desk):
    desk.home()
    desk.ask(1, wait_ms=10)
    assert desk.station.view.completed == 1
    desk.station.switch(False)
    desk.ask(0, wait_ms=10)
    assert (desk.station.view.completed, desk.station.view.status) == (1, Status.DISABLED)
    desk.station.switch(True)
    desk.ask(0, wait_ms=10)
    assert (desk.station.view.completed, desk.station.view.status) == (0, Status.OK)


@pytest.mark.parametrize(("flags", "ends"), [(ENABLE, "RUNNING"), (GO_HOME, "FATAL"), (0, "FATAL")])
def test_only_a_request_for_a_total_keeps_the_watch_alive(desk, flags, ends):
    desk.home()
    for _ in range(12):
        desk.ask(flags=flags, wait_ms=10)
    assert desk.station.view.box_state.name == ends
    assert ends == "RUNNING" or desk.station.view.status is Status.LINK_LOST
