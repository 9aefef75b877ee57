"""The PC as a node: what it does when the start goes wrong, and that it never stops without a reason."""

import pytest
from node_oracle import (
    CORRECTIONS,
    ENABLE,
    EXPECTED,
    GO_HOME,
    HOLD,
    POSITION,
    PROBE,
    REQUEST,
    SETUP,
    SETUP_A,
    STATUS,
    Request,
    sealed,
)

from rtec.errors import ArgumentError
from rtec.link.frame import Frame
from rtec.predictors import LatheNetwork, StepModel, UnidirectionalTable
from rtec.requester.pc_node import PcNode
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.setup import Setup
from rtec.requester.status import Status
from rtec.requester.supervision import HoldReason, SupervisionLimits

MS = 10**9
NOT_HOMED, RUNNING, FATAL = 0, 1, 2
SWITCH_ON = 8


class Desk:
    """A PC and a hand that plays the box."""

    def __init__(self, setup=None, error_mm=0.004, **limits):
        table = UnidirectionalTable(positions_mm=[-50.0, 50.0], errors_mm=[error_mm] * 2, backlash_mm=0.0)
        self.pc = PcNode(
            HandshakeSettings(), SupervisionLimits(**limits), axis=1, predictor=table, count_mm=0.001,
            step_counts=4, word_limit=127,
            setup=setup,
        )  # fmt: skip
        self.sequence = 0
        self.judged = 0

    def say(self, kind, *body):
        data = sealed(kind + 1, bytes([0, self.sequence % 256, *body]))
        self.pc.receive(Frame(identifier=kind + 1, data=data), at_ps=self.pc.due_ps - MS)

    def cycle(
        self, state, *, code=None, position=0, counted=None, position_lost=False, valid=1, totals=0, completed=None,
        switch=SWITCH_ON,
    ):  # fmt: skip
        """Let the box say its three words, and the PC take its turn; return its requests."""
        self.sequence += 1
        code = code if code is not None else Status.NOT_HOMED if state == NOT_HOMED else Status.OK
        total = totals.to_bytes(2, "little", signed=True)
        self.say(STATUS, code, state | switch, 9, 0, 0, 0)
        done = total if completed is None else completed.to_bytes(2, "little", signed=True)
        self.say(CORRECTIONS, *done, *total, 9, self.judged)
        counted = position if counted is None else counted
        rest = ((counted & 0x7FFF) << 1 | valid).to_bytes(2, "little")
        if not position_lost:
            self.say(POSITION, *position.to_bytes(4, "little", signed=True), *rest)
        return self.turn()

    def turn(self):
        frames = self.pc.turn(at_ps=self.pc.due_ps)
        requests = [Request.of(frame.data) for frame in frames if frame.identifier == REQUEST + 1]
        if requests:
            self.judged = requests[-1].sequence
        return requests


@pytest.fixture
def desk():
    return Desk()


def active(desk):
    desk.cycle(NOT_HOMED, valid=0)
    desk.cycle(RUNNING)
    assert desk.pc.view.state is PcState.ACTIVE


def node_at(home_mm, predictor, margin_mm=0.0):
    desk = Desk()
    desk.pc = PcNode(
        HandshakeSettings(), SupervisionLimits(), axis=1, predictor=predictor, count_mm=0.001,
        step_counts=4, word_limit=127,
        home_mm=home_mm, margin_mm=margin_mm,
    )  # fmt: skip
    desk.cycle(NOT_HOMED, valid=0)
    desk.cycle(RUNNING)
    return desk


@pytest.mark.parametrize("error_mm", [0.004, -0.004])
def test_the_limit_of_the_deviation_holds_on_both_sides(error_mm):
    active(Desk(error_mm=error_mm, limit_mm=0.004))
    desk = Desk(error_mm=error_mm, limit_mm=0.003)
    desk.cycle(NOT_HOMED, valid=0)
    (request,) = desk.cycle(RUNNING)
    assert (desk.pc.view.state, desk.pc.view.reason) == (PcState.HOLD, HoldReason.DEVIATION_LIMIT)
    assert request.total == 0


@pytest.mark.parametrize("probing", [False, True])
def test_a_total_that_stays_unfinished_holds_the_machine_unless_it_probes(probing):
    desk = Desk(completion_timeout_ps=300 * MS)
    active(desk)
    desk.cycle(RUNNING, totals=1, completed=0)  # the box has said so 1 ms before the turn
    if probing:
        desk.pc.probe(True)
    for _ in range(29):
        desk.cycle(RUNNING, totals=1, completed=0)
    assert desk.pc.view.state is PcState.ACTIVE
    desk.cycle(RUNNING, totals=1, completed=0)
    late = (PcState.ACTIVE, HoldReason.NONE) if probing else (PcState.HOLD, HoldReason.NOT_COMPLETED)
    assert (desk.pc.view.state, desk.pc.view.reason) == late


def test_positions_of_the_predictor_begin_at_home():
    lathe = LatheNetwork()
    desk = node_at(254.0, lathe)
    for position in (0, 1500, 3000):
        desk.cycle(RUNNING, position=position, totals=desk.pc.view.requested)
        assert desk.pc.position_mm == pytest.approx(254.0 + position / 1000)
        assert desk.pc.view.target == pytest.approx(lathe.error_mm(desk.pc.position_mm, 1) / 0.004, abs=0.6)


@pytest.mark.parametrize(("margin_mm", "state"), [(0.0, PcState.HOLD), (1.0, PcState.ACTIVE)])
def test_beyond_its_ends_a_predictor_is_asked_within_the_margin_only(margin_mm, state):
    table = UnidirectionalTable(positions_mm=[10.0, 20.0], errors_mm=[0.004, 0.004], backlash_mm=0.0)
    desk = node_at(10.0, table, margin_mm)
    desk.cycle(RUNNING, position=-900, totals=1)
    assert desk.pc.view.state is state
    with pytest.raises(ArgumentError, match="10 to 20 mm, the range of the predictor"):
        node_at(0.0, table)


def test_a_predictor_that_is_refused_leaves_the_other_at_work(desk):
    desk.cycle(NOT_HOMED, valid=0)
    desk.cycle(RUNNING)
    with pytest.raises(ArgumentError, match="temperature_bed"):
        desk.pc.predict_by(StepModel(function=max, inputs=("temperature_bed",), range_mm=(-1.0, 1.0)))
    desk.cycle(RUNNING, position=5000, totals=1)
    assert (desk.pc.view.state, desk.pc.view.target) == (PcState.ACTIVE, 1)


def test_the_start_in_order(desk):
    assert desk.turn() == []
    (home,) = desk.cycle(NOT_HOMED, valid=0)
    assert (home.flags, home.total, home.session) == (GO_HOME, 0, 9)
    (first,) = desk.cycle(RUNNING)
    assert (first.flags, first.total) == (ENABLE, 1)  # 4 µm are a step
    view = desk.pc.view
    assert (view.state, view.connected, view.box_state.name, view.switch_on) == (
        PcState.ACTIVE,
        True,
        "RUNNING",
        True,
    )


def test_a_box_that_runs_without_its_doing_hears_nothing(desk):
    for _ in range(5):
        assert desk.cycle(RUNNING) == []
    assert desk.pc.view.state is PcState.WAITING


def test_a_home_position_that_was_missed_ends_in_silence(desk):
    desk.cycle(NOT_HOMED, valid=0)
    for position in (40, 41, 43):
        assert desk.cycle(RUNNING, position=position) == []
    assert desk.pc.view.state is PcState.WAITING


def test_a_home_position_said_before_the_axis_moved_on_counts(desk):
    desk.cycle(NOT_HOMED, valid=0)
    desk.sequence += 1
    desk.say(POSITION, *bytes(4), 1, 0)
    (request,) = desk.cycle(RUNNING, position=40)
    assert (request.flags, desk.pc.view.state) == (ENABLE, PcState.ACTIVE)


@pytest.mark.parametrize("totals", [5, -3, 20_000])
def test_it_starts_from_totals_of_zero_only(desk, totals):
    desk.cycle(NOT_HOMED, valid=0)
    for _ in range(2):
        requests = desk.cycle(RUNNING, totals=totals)
        assert not any(request.flags & ENABLE for request in requests)
    (request,) = desk.cycle(RUNNING)
    assert (request.flags, request.total) == (ENABLE, 1)


def test_a_box_that_is_not_heard_any_more_is_none(desk):
    desk.cycle(NOT_HOMED, valid=0)
    for _ in range(4):
        assert len(desk.turn()) == 1
    for _ in range(3):
        requests = desk.turn()
    assert requests == []
    assert not desk.pc.view.connected


@pytest.mark.parametrize("active", [False, True])
def test_doubts_of_a_box_that_runs_are_a_reason_to_hold(desk, active):
    desk.cycle(NOT_HOMED, valid=0)
    if active:
        desk.cycle(RUNNING)
    desk.cycle(RUNNING, code=Status.I_STILL_DONT_BELIEVE_YOU)
    assert (desk.pc.view.state, desk.pc.view.reason) == (PcState.HOLD, HoldReason.BOX_STILL_DOUBTS)
    assert desk.pc.view.held_ps is not None


@pytest.mark.parametrize(("totals", "state"), [(0, PcState.ACTIVE), (1, PcState.HOLD)])
def test_a_switch_that_keeps_a_step_in_holds_the_machine(desk, totals, state):
    """The PC asks for zero: nothing is wrong where nothing is in, but a step that cannot be taken out is."""
    desk.pc.predict_by(UnidirectionalTable(positions_mm=[-50.0, 50.0], errors_mm=[0.0, 0.0], backlash_mm=0.0))
    desk.cycle(NOT_HOMED, valid=0)
    desk.cycle(RUNNING)
    if totals:
        desk.pc.predict_by(UnidirectionalTable(positions_mm=[-50.0, 50.0], errors_mm=[0.004, 0.004], backlash_mm=0.0))
        (request,) = desk.cycle(RUNNING)
        assert request.total == 1
        desk.pc.predict_by(UnidirectionalTable(positions_mm=[-50.0, 50.0], errors_mm=[0.0, 0.0], backlash_mm=0.0))
        (request,) = desk.cycle(RUNNING, totals=1)
        assert request.total == 0
    assert desk.pc.view.state is PcState.ACTIVE
    desk.cycle(RUNNING, totals=totals, code=Status.DISABLED, switch=0)
    assert desk.pc.view.state is state
    assert totals == 0 or desk.pc.view.reason is HoldReason.CORRECTIONS_DISABLED


def test_more_steps_than_a_request_can_say_hold_the_machine(desk):
    """127 steps of 4 um: what is beyond them would be missing, and nobody would know."""
    active(desk)
    for steps, state in ((127, PcState.ACTIVE), (128, PcState.HOLD)):
        errors = [0.004 * steps, 0.004 * steps]
        desk.pc.predict_by(UnidirectionalTable(positions_mm=[-50.0, 50.0], errors_mm=errors, backlash_mm=0.0))
        desk.cycle(RUNNING)
        assert desk.pc.view.state is state
    assert desk.pc.view.reason is HoldReason.BEYOND_WORD


@pytest.mark.parametrize(("state", "code"), [(5, 0), (RUNNING, 12), (RUNNING, Status.LINK_LOST), (RUNNING, 1)])
def test_a_status_that_no_box_has_holds_the_machine(desk, state, code):
    active(desk)
    desk.cycle(state, code=code)
    assert desk.pc.view.reason is HoldReason.STATUS_WRONG


@pytest.mark.parametrize("lost", [1, 2, 3])
def test_a_frozen_word_is_found_whatever_else_is_lost(desk, lost):
    """The word stands at 0 while what the box adds up goes on; of every four positions some are lost."""
    active(desk)
    for k in range(1, 20):
        desk.cycle(RUNNING, position=0, counted=50 * k, position_lost=k % 4 < lost)
        if desk.pc.view.state is PcState.HOLD:
            break
    # with many lost, none that can be is heard for too long
    assert desk.pc.view.reason in (HoldReason.POSITION_IMPLAUSIBLE, HoldReason.BOX_SILENT)
    assert k <= 6


def test_a_latch_of_the_past_is_no_latch(desk):
    active(desk)

    def say_latch(sequence, trips, position):
        body = bytes([0, sequence, *position.to_bytes(4, "little", signed=True), trips, 9])
        desk.pc.receive(Frame(identifier=PROBE + 1, data=sealed(PROBE + 1, body)), at_ps=desk.pc.due_ps - MS)

    say_latch(1, 1, 1111)
    say_latch(2, 2, 2222)
    say_latch(1, 1, 1111)  # played again
    assert (desk.pc.view.counters.trips, desk.pc.view.counters.trip_position_counts) == (2, 2222)
    assert desk.pc.view.counters.frames_refused == 1


# set up differently


@pytest.fixture
def set_up():
    return Desk(Setup(design="a", step_mm=0.004, cycle_ps=10 * MS))


def test_it_says_what_it_expects_before_it_takes_the_axis_home(set_up):
    set_up.say(SETUP, *SETUP_A)
    set_up.sequence += 1
    set_up.say(STATUS, Status.NOT_HOMED, NOT_HOMED | SWITCH_ON, 9, 0, 0, 0)
    expected, request = set_up.pc.turn(at_ps=set_up.pc.due_ps)
    assert (expected.identifier, expected.data[2:]) == (EXPECTED + 1, SETUP_A)
    assert Request.of(request.data).flags == GO_HOME
    active(set_up)
    assert all(frame.identifier == REQUEST + 1 for frame in set_up.pc.turn(at_ps=set_up.pc.due_ps))


@pytest.mark.parametrize("begins", [False, True])
@pytest.mark.parametrize(
    ("design", "cycle_us", "step"),
    [(3, 10_000, 20_000), (1, 20_000, 40_000), (1, 10_000, 20_000), (2, 10_000, 40_000)],
)
def test_a_box_that_is_set_up_differently_holds_the_machine(set_up, design, cycle_us, step, begins):
    if begins:
        active(set_up)
    set_up.say(SETUP, *(design | cycle_us << 4 | step << 24).to_bytes(6, "little"))
    frames = set_up.pc.turn(at_ps=set_up.pc.due_ps)
    assert (set_up.pc.view.state, set_up.pc.view.reason) == (PcState.HOLD, HoldReason.SETUP_DIFFERS)
    assert {frame.identifier for frame in frames} == {HOLD, EXPECTED + 1, REQUEST + 1}
    assert Request.of(frames[-1].data).flags == 0


def test_a_box_that_says_nothing_of_its_setup_is_taken_as_it_is(set_up):
    active(set_up)
    assert set_up.pc.view.box_setup is None


def test_a_pc_that_expects_nothing_takes_every_box(desk):
    desk.say(SETUP, *bytes(5), 1)
    active(desk)


def test_a_refusal_of_the_box_is_heard_too(set_up):
    set_up.cycle(NOT_HOMED, code=Status.SETUP_DIFFERS, valid=0)
    assert set_up.pc.view.reason is HoldReason.SETUP_DIFFERS


def test_a_refusal_of_another_pc_is_not_for_this_one(set_up):
    set_up.say(SETUP, *SETUP_A)
    (request,) = set_up.cycle(NOT_HOMED, code=Status.SETUP_DIFFERS, valid=0)
    assert request.flags == GO_HOME


@pytest.mark.parametrize(
    ("code", "reason"),
    [(Status.DRIVE_STOPPED, HoldReason.DRIVE_STOPPED), (Status.SETUP_DIFFERS, HoldReason.SETUP_DIFFERS)],
)
def test_a_box_that_has_stopped_for_good_says_why(desk, code, reason):
    active(desk)
    desk.cycle(FATAL, code=code)
    assert (desk.pc.view.state, desk.pc.view.reason) == (PcState.HOLD, reason)


@pytest.mark.parametrize(
    ("box", "pc", "options"),
    [
        (("a", 0.004, 10), ("c", 0.002, 10), "--design"),
        (("a", 0.004, 10), ("a", 0.002, 10), "--count"),
        (("a", 0.004, 10), ("c", 0.004, 10), "--design and --count"),
        (("a", 0.004, 10), ("a", 0.004, 20), "--cycle"),
        (("a", 0.004, 10), ("c", 0.001, 20), "--design, --count and --cycle"),
        (("original", 0.004, 10), ("a", 0.004, 10), "--design"),
        (("a", 0.004, 10), ("a", 0.004, 10), ""),
        (("mine", 0.004, 10), ("a", 0.002, 10), "--design and --count"),
    ],
)
def test_the_options_that_make_two_setups_alike(box, pc, options):
    one, other = (Setup(design=d, step_mm=s, cycle_ps=c * MS) for d, s, c in (box, pc))
    assert one.options_that_differ(other) == options
    assert (one.word == other.word) == (options == "")


def test_the_hold_of_another_pc_holds_this_one(desk):
    active(desk)
    other = Desk()
    active(other)
    other.cycle(FATAL, code=Status.DRIVE_STOPPED)
    (hold,) = (frame for frame in other.pc.turn(at_ps=other.pc.due_ps) if frame.identifier == HOLD)
    desk.pc.receive(hold, at_ps=desk.pc.due_ps - MS)
    assert (desk.pc.view.state, desk.pc.view.reason) == (PcState.HOLD, HoldReason.ANOTHER_PC)


def test_a_box_of_a_new_session_is_noticed_by_its_status_alone(desk):
    active(desk)
    desk.sequence += 1
    desk.say(STATUS, Status.OK, RUNNING | SWITCH_ON, 10, 0, 0, 0)
    assert (desk.pc.view.state, desk.pc.view.reason) == (PcState.HOLD, HoldReason.BOX_RESTARTED)


def test_a_box_that_has_lost_its_home_is_noticed_in_its_old_session(desk):
    active(desk)
    desk.cycle(NOT_HOMED)
    assert (desk.pc.view.state, desk.pc.view.reason) == (PcState.HOLD, HoldReason.BOX_RESTARTED)
