"""The box as a node: what it says at home, what its switch forbids, and what resets its watchdog."""

import pytest
from node_oracle import (
    CORRECTIONS,
    ENABLE,
    EXPECTED,
    GO_HOME,
    LARGE,
    POSITION,
    REQUEST,
    RESET,
    SETUP,
    SETUP_A,
    STATUS,
    Request,
    is_right,
    sealed,
    signed,
)

from rtec.axis.command import Move
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.link.frame import Frame
from rtec.machine.faults import FaultKind
from rtec.machine.station import Alarm, Station, StationSettings
from rtec.requester.status import BoxState, Status
from rtec.requester.supervision import SupervisionLimits

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

    def expect(self, word):
        self.sequence += 1
        data = sealed(EXPECTED + 1, bytes([0, self.sequence % 256, *word]))
        self.station.receive(Frame(identifier=EXPECTED + 1, data=data))

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
    assert {frame.identifier for _, frame in desk.sent} == {SETUP + 1, STATUS + 1, CORRECTIONS + 1, POSITION + 1}


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


# set up differently

SETUP_C = (3 | 10_000 << 4 | 20_000 << 24).to_bytes(6, "little")


def test_the_setup_is_said_until_the_axis_is_homed(desk):
    assert [data[2:] for _, data in desk.said(SETUP)] == [SETUP_A, SETUP_A]  # at 1 ms and 11 ms
    desk.home()
    assert len(desk.said(SETUP)) == 1
    desk.ask(wait_ms=30)
    assert desk.said(SETUP) == []


@pytest.mark.parametrize("first", ["expected", "request"])
def test_a_pc_that_expects_another_box_cannot_take_the_axis_home(desk, first):
    if first == "request":
        desk.ask(flags=GO_HOME, wait_ms=0)
    desk.expect(SETUP_C)
    if first == "expected":
        desk.ask(flags=GO_HOME, wait_ms=0)
    desk.wait(5)
    view = desk.station.view
    assert (view.box_state, view.status) == (BoxState.NOT_HOMED, Status.SETUP_DIFFERS)
    assert str(view.expected) == "design c, step 2 µm, cycle 10 ms"
    desk.expect(SETUP_A)
    desk.home()


def test_what_was_expected_long_ago_is_forgotten(desk):
    """The PC that was wrong has gone; one that says nothing of a setup comes after it."""
    desk.expect(SETUP_C)
    desk.wait(40)
    desk.ask(flags=GO_HOME)
    assert desk.station.view.status is Status.SETUP_DIFFERS
    desk.wait(10)  # 55 ms after it
    desk.home()


def test_a_box_that_runs_stops_for_good_where_the_pc_expects_another(desk):
    desk.expect(SETUP_A)
    desk.home()
    desk.expect(SETUP_A)
    desk.ask()
    assert desk.station.view.box_state is BoxState.RUNNING
    desk.expect(SETUP_C)
    desk.ask()
    assert (desk.station.view.box_state, desk.station.view.status) == (BoxState.FATAL, Status.SETUP_DIFFERS)


def test_the_cycle_that_is_said_is_that_on_the_bus():
    """An axis that runs five times as fast as the clock: 50 ms of its time are 10 ms of the bus."""
    settings = StationSettings(supervision=SupervisionLimits(cycle_ps=50 * MS, watchdog_ps=250 * MS, speed=5.0))
    assert settings.setup.word.to_bytes(6, "little") == SETUP_A


# a stopped drive


def test_a_drive_that_the_controller_has_stopped_stops_the_box_for_good(desk):
    desk.home()
    desk.station.begin(FaultKind.LINES_SWAPPED)
    desk.station.go(30.0, 20.0)
    for _ in range(60):
        frames = desk.ask(wait_ms=10)
        if desk.station.view.box_state is BoxState.FATAL:
            break
    view = desk.station.view
    assert (view.alarm, view.status) == (Alarm.FOLLOWING, Status.DRIVE_STOPPED)
    (data,) = [data for _, data in desk.said(STATUS) if data[2] == 13][:1]
    assert frames and data[3] & 7 == 2


def test_before_home_a_stopped_drive_means_nothing(desk):
    desk.station._state.alarm = int(Alarm.FOLLOWING)
    desk.wait(10)
    assert desk.station.view.status is Status.NOT_HOMED
    desk.home()
    assert desk.station.view.alarm is Alarm.NONE
