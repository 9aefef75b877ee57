"""One axis with its box on simulated time: its counts against plain decoders of what the lines do."""

from itertools import pairwise

import pytest
import signal_oracle as oracle

from rtec.axis.command import Move
from rtec.errors import ArgumentError
from rtec.injector import Design, InjectorSettings, RealEdges, Timing
from rtec.machine.faults import FaultKind
from rtec.machine.station import Station, StationSettings
from rtec.predictors import UnidirectionalTable
from rtec.requester.status import BoxState
from tests.machines import requester, talk

US, MS = 10**6, 10**9
SLOPE = UnidirectionalTable(positions_mm=[-1.0, 0.0, 9.0], errors_mm=[0.0, 0.0, 0.27], backlash_mm=0.0)
"""30 um a millimetre."""


def slow(design):
    """Return an axis whose insertions are so slow that looks 100 us apart see every level."""
    timing = Timing(poll_ps=0, decide_ps=200 * US, step_ps=200 * US, recover_ps=200 * US, gate_margin=None)
    return StationSettings(injector=InjectorSettings(design=design, timing=timing, real_edges=RealEdges.HOLD))


def levels_of(station, pc, until_ps):
    """Run an axis and its PC, and collect the levels on both sides every 100 us."""
    state = station._state
    lines, lines_out = [int(state.lines)], [int(state.injector.ab_out)]

    def looked():
        lines.append(int(state.lines))
        lines_out.append(int(state.injector.ab_out))

    talk(station, pc, until_ps, 100 * US, looked)
    return lines, lines_out


def decoded(levels):
    """Return the count and the illegal transitions by the report's state table."""
    steps = [oracle.decode_step(oracle.text(a), oracle.text(b)) for a, b in pairwise(levels)]
    return sum(step for step in steps if step != oracle.ILLEGAL), steps.count(oracle.ILLEGAL)


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
def test_the_counts_are_those_of_a_plain_decoder(design):
    station = Station(slow(design), [Move(target_mm=0.5, speed_mm_s=0.5, rest_s=100.0)])
    pc = requester(design, SLOPE)
    lines, lines_out = levels_of(station, pc, 1300 * MS)
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


def test_the_home_switch_knows_nothing_of_the_cable():
    station = Station(slow(Design.C), [Move(target_mm=5.0, speed_mm_s=5.0)])
    station.begin(FaultKind.LINE_BROKEN)
    pc = requester(Design.C, SLOPE)
    talk(station, pc, 100 * MS)
    assert station.view.box_state is BoxState.RUNNING


@pytest.mark.parametrize("kind", [FaultKind.FRAME_LOST, FaultKind.PC_KILLED])
def test_a_fault_of_somewhere_else_is_refused(kind):
    with pytest.raises(ArgumentError, match="a fault of an axis"):
        Station(StationSettings()).begin(kind)


def test_time_never_runs_back():
    station = Station(StationSettings())
    station.advance(until_ps=5 * MS)
    with pytest.raises(ArgumentError, match="until_ps"):
        station.advance(until_ps=4 * MS)
