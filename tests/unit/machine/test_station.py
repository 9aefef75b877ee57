"""One axis with its box on simulated time: its counts against plain decoders of what the lines do."""

from itertools import pairwise

import pytest
import signal_oracle as oracle

from rtec.errors import ArgumentError
from rtec.injector import Design, InjectorSettings, RealEdges, Timing
from rtec.link._frame_kernels import CORRECTIONS, POSITION, STATUS
from rtec.machine.faults import FaultKind
from rtec.machine.station import Move, Station, StationSettings
from rtec.predictors import UnidirectionalTable
from rtec.requester.pc_node import PcNode
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.status import BoxState, Status
from rtec.requester.supervision import HoldReason, SupervisionLimits

US, MS, S = 10**6, 10**9, 10**12
SLOPE = UnidirectionalTable(positions_mm=[-1.0, 0.0, 9.0], errors_mm=[0.0, 0.0, 0.27], backlash_mm=0.0)
"""30 um a millimetre."""


def slow(design):
    """Return an axis whose insertions are so slow that looks 100 us apart see every level."""
    timing = Timing(poll_ps=0, decide_ps=200 * US, step_ps=200 * US, recover_ps=200 * US, gate_margin=None)
    return StationSettings(injector=InjectorSettings(design=design, timing=timing, real_edges=RealEdges.HOLD))


def talk(station, pc, until_ps, look_ps=100 * US):
    """Run an axis and its PC, frames without delay, and collect the levels on both sides."""
    state = station._state
    lines, lines_out = [int(state.lines)], [int(state.injector.ab_out)]
    while station.now_ps < until_ps:
        for at_ps, frame in station.advance(until_ps=station.now_ps + look_ps):
            pc.receive(frame, at_ps=at_ps)
        if pc.due_ps <= station.now_ps:
            for frame in pc.turn(at_ps=station.now_ps):
                station.receive(frame)
        lines.append(int(state.lines))
        lines_out.append(int(state.injector.ab_out))
    return lines, lines_out


def decoded(levels):
    """Return the count and the illegal transitions by the report's state table."""
    steps = [oracle.decode_step(oracle.text(a), oracle.text(b)) for a, b in pairwise(levels)]
    return sum(step for step in steps if step != oracle.ILLEGAL), steps.count(oracle.ILLEGAL)


def requester(design):
    return PcNode(
        HandshakeSettings(), SupervisionLimits(), axis=1, predictor=SLOPE, count_mm=0.001,
        step_counts=design.step_counts, word_limit=design.word_limit,
    )  # fmt: skip


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
def test_the_counts_are_those_of_a_plain_decoder(design):
    station = Station(slow(design), [Move(target_mm=0.5, speed_mm_s=0.5, rest_s=100.0)])
    pc = requester(design)
    lines, lines_out = talk(station, pc, 1300 * MS)
    view = station.view
    true, illegal = decoded(lines)
    counted, illegal_out = decoded(lines_out)
    assert (illegal, illegal_out) == (0, 0)
    assert view.position == true > 400
    assert view.controller_count == counted
    assert counted - true == design.step_counts * view.completed
    # the table asks for 30 um a millimetre where the axis truly is, in whole steps
    assert view.completed == pytest.approx(0.030 * true / design.step_counts, abs=0.55)
    assert view.completed > 2


def test_it_speaks_its_four_words_every_cycle():
    station = Station(StationSettings(axis=3))
    sent = station.advance(until_ps=100 * MS)
    by_kind = [frame.identifier - 3 for _, frame in sent]
    assert by_kind.count(POSITION) == 10
    assert by_kind.count(STATUS) >= 10
    assert by_kind.count(CORRECTIONS) == 10


def test_it_waits_for_home_before_it_moves():
    station = Station(StationSettings(), [Move(target_mm=1.0, speed_mm_s=5.0)])
    station.advance(until_ps=1 * S)
    assert (station.view.position, station.view.box_state) == (0, BoxState.NOT_HOMED)


def test_a_restarted_box_has_another_session_and_makes_the_pc_hold():
    station = Station(slow(Design.A), [Move(target_mm=5.0, speed_mm_s=0.5)])
    pc = requester(Design.A)
    talk(station, pc, 500 * MS, look_ps=MS)
    assert pc.view.state is PcState.ACTIVE
    station.restart()
    talk(station, pc, 600 * MS, look_ps=MS)
    assert (pc.view.state, pc.view.reason) == (PcState.HOLD, HoldReason.BOX_RESTARTED)
    assert station.view.session == 2


def test_the_switch_is_noticed_even_where_the_request_is_zero():
    """A step stands in the controller, zero is asked for and the switch forbids to take it out: that must be said."""
    station = Station(slow(Design.A))
    pc = requester(Design.A)
    talk(station, pc, 100 * MS, look_ps=MS)
    constant = UnidirectionalTable(positions_mm=[-1.0, 1.0], errors_mm=[0.008, 0.008], backlash_mm=0.0)
    pc.predict_by(constant)
    talk(station, pc, 300 * MS, look_ps=MS)
    assert station.view.completed == 2
    station.switch(on=False)
    pc.predict_by(UnidirectionalTable(positions_mm=[-1.0, 1.0], errors_mm=[0.0, 0.0], backlash_mm=0.0))
    for frame in pc.turn(at_ps=pc.due_ps):
        station.receive(frame)
    talk(station, pc, 400 * MS, look_ps=MS)
    assert station.view.completed == 2
    assert pc.view.reason is HoldReason.CORRECTIONS_DISABLED


def test_the_home_switch_knows_nothing_of_the_cable():
    station = Station(slow(Design.C), [Move(target_mm=5.0, speed_mm_s=5.0)])
    station.begin(FaultKind.LINE_BROKEN)
    pc = requester(Design.C)
    talk(station, pc, 100 * MS, look_ps=MS)
    assert station.view.box_state is BoxState.RUNNING


def test_the_box_holds_where_both_lines_change_at_once():
    station = Station(slow(Design.C), [Move(target_mm=5.0, speed_mm_s=0.5)])
    pc = requester(Design.C)
    talk(station, pc, 500 * MS, look_ps=MS)
    while station.view.lines not in (1, 2):
        talk(station, pc, station.now_ps + 100 * US)
    station.begin(FaultKind.LINES_SWAPPED)
    talk(station, pc, station.now_ps + 10 * MS, look_ps=MS)
    assert station.view.status is Status.ENCODER_FAULT
    assert station.view.held


@pytest.mark.parametrize("kind", [FaultKind.FRAME_LOST, FaultKind.PC_KILLED])
def test_a_fault_of_somewhere_else_is_refused(kind):
    with pytest.raises(ArgumentError, match="a fault of an axis"):
        Station(StationSettings()).begin(kind)


def test_time_never_runs_back():
    station = Station(StationSettings())
    station.advance(until_ps=5 * MS)
    with pytest.raises(ArgumentError, match="until_ps"):
        station.advance(until_ps=4 * MS)
