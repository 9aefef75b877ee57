"""Boxes that run their firmware, on a bus: against the model of the box, and plain decoders of their lines."""

from dataclasses import replace

import pytest

from rtec.axis.command import Move
from rtec.board import Microcontroller
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.link._bus_kernels import bits_of
from rtec.machine.cell import Cell
from rtec.machine.faults import PC_NODE, Fault, FaultKind, Trigger
from rtec.machine.station import Station, StationSettings
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.status import BoxState, Status
from rtec.requester.supervision import HoldReason
from tests.machines import SLOPE, box_of, requester, talk

US, MS, S = 10**6, 10**9, 10**12
MCS51 = Microcontroller.named("8051-12mhz")


def settings(design, axis=1, *, firmware=True, **others):
    box = box_of(design)
    return StationSettings(axis=axis, injector=box, microcontroller=MCS51 if firmware else None, **others)


def run(*faults, design=Design.C, axes=1, until_ps=4 * S, firmware=True):
    stations = [settings(design, axis, firmware=firmware) for axis in range(1, axes + 1)]
    moves = [[Move(target_mm=2.0, speed_mm_s=2.0, rest_s=100.0)]] * axes
    cell = Cell(stations, moves, SLOPE, faults=faults)
    cell.run(until_ps=until_ps)
    return cell


@pytest.mark.parametrize("design", list(Design))
def test_every_design_inserts_on_the_bus_what_its_model_does(design):
    # the controller stands at 2 mm; 20 um a millimetre where the axis truly is, in whole steps
    steps = 0.020 * 2000 / (1 + 0.020) / design.step_counts
    for firmware in (True, False):
        cell = run(design=design, axes=2, firmware=firmware)
        cell.settle()
        for axis in cell.axes:
            assert (axis.pc_state, axis.box_status, cell.held_ps) == (PcState.ACTIVE, Status.OK, None)
            assert axis.view.completed == axis.view.requested == pytest.approx(steps, abs=0.7)
            assert axis.view.position == 2000 - design.step_counts * axis.view.completed
            assert (axis.off_counts, axis.uninserted_counts) == (0, 0)


def test_a_program_of_ones_own_is_what_the_box_runs(tmp_path):
    """Two bytes that jump to themselves: the box never says that it is homed, and the axis is not let go."""
    image = tmp_path / "mine.ihx"
    image.write_text(":0200000080FE80\n:00000001FF\n")
    own = replace(MCS51, program=image)
    assert own.name == "mine.ihx on 8051-12mhz"
    cell = Cell(
        [settings(Design.C, firmware=False).inserting_by(own)], [[Move(target_mm=2.0, speed_mm_s=2.0)]], SLOPE
    )
    cell.run(until_ps=S)
    assert (cell.axes[0].box_status, cell.axes[0].view.position) == (Status.NOT_HOMED, 0)


def test_what_never_began_does_not_end():
    station = Station(settings(Design.A))
    station.advance(until_ps=20 * MS)
    station.end(FaultKind.POWER_LOST)
    assert (station.view.session, station.view.powered) == (1, True)
    station.power(False)
    station.restart()  # there is nothing that could start
    station.trip()
    station.advance(until_ps=40 * MS)
    assert (station.view.powered, station.view.counters.trips) == (False, 0)


def test_a_total_that_nobody_asked_for_is_doubted_by_the_program():
    seed = next(seed for seed in range(10_000) if bits_of(seed, 0) % 8 >= 3)
    fault = Fault(kind=FaultKind.FRAME_MASQUERADE, place=PC_NODE, identifier=0x201, from_ps=3 * S, most=1, seed=seed)
    axis = run(fault).axes[0]
    # the words stand until the next frame, and the program reads them every millisecond: three times is fatal
    assert axis.view.box_state is BoxState.FATAL
    assert axis.box_status is Status.I_STILL_DONT_BELIEVE_YOU
    assert axis.pc_reason is HoldReason.BOX_STILL_DOUBTS
    assert axis.view.counters.requests_refused == 3
    assert axis.view.completed == 20


def test_a_dead_program_passes_the_lines_and_comes_back_without_a_home():
    lost = Fault(kind=FaultKind.POWER_LOST, place=1, from_ps=1 * S, until_ps=2 * S)
    cell = run(lost)
    cell.settle()
    axis = cell.axes[0]
    assert [fired.times for fired in cell.fired] == [1]
    assert axis.view.held
    assert axis.view.powered
    assert axis.box_status is Status.NOT_HOMED
    assert axis.view.session == 2
    assert axis.view.completed == 0
    assert axis.pc_reason in (HoldReason.BOX_SILENT, HoldReason.BOX_RESTARTED)


def test_the_program_latches_the_probe():
    station = Station(settings(Design.C), [Move(target_mm=0.5, speed_mm_s=5.0)])
    station.advance(until_ps=20 * MS)
    station.trip()
    station.advance(until_ps=40 * MS)
    assert station.view.counters.trips == 1
    station.trip()
    station.advance(until_ps=60 * MS)
    assert station.view.counters.trips == 2


def test_the_open_switch_is_the_firmwares_message():
    cell = run(Fault(kind=FaultKind.SWITCH_THROWN, place=1, from_ps=1 * S))
    axis = cell.axes[0]
    assert axis.pc_reason is HoldReason.CORRECTIONS_DISABLED
    assert axis.view.completed < 20


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
def test_a_fault_waits_for_an_insertion_of_the_program(design):
    fault = Fault(kind=FaultKind.BOX_RESTARTED, place=1, from_ps=500 * MS, trigger=Trigger.WHILE_INSERTING)
    cell = run(fault, design=design)
    (fired,) = cell.fired
    assert fired.times == 1
    assert 500 * MS < fired.first_ps < 2 * S
    assert cell.axes[0].pc_reason is HoldReason.BOX_RESTARTED


def test_design_b_does_not_show_an_insertion():
    fault = Fault(kind=FaultKind.POWER_LOST, place=1, from_ps=0, trigger=Trigger.WHILE_INSERTING)
    with pytest.raises(ArgumentError, match="do not tell an insertion"):
        run(fault, design=Design.B)
    with pytest.raises(ArgumentError, match="do not tell an insertion"):
        Station(settings(Design.B)).begin(FaultKind.POWER_LOST, while_inserting=True)


def test_an_operator_starts_a_program_that_has_stopped_for_good():
    """Two requests with Reset in a row: the node pulls the processor's reset, and it waits for home again."""
    station = Station(settings(Design.C))
    talk(station, requester(Design.C), 200 * MS)
    assert station.view.box_state is BoxState.RUNNING
    station.advance(until_ps=400 * MS)
    assert station.view.status is Status.LINK_LOST
    pc = requester(Design.C, start_ps=station.now_ps, first_sequence=99)
    pc.acknowledge()
    talk(station, pc, 700 * MS)
    assert (station.view.box_state, station.view.status) == (BoxState.RUNNING, Status.OK)
    assert pc.view.state is PcState.ACTIVE


def test_all_axes_of_a_cell_have_a_processor_or_none():
    stations = [settings(Design.C, 1), settings(Design.C, 2, firmware=False)]
    with pytest.raises(ArgumentError, match="1 of 2 with a microcontroller"):
        Cell(stations, [[Move(target_mm=1.0, speed_mm_s=1.0)]] * 2, SLOPE)


def test_the_windows_are_those_of_the_source():
    with pytest.raises(ArgumentError, match="window 5"):
        settings(Design.C, handshake=HandshakeSettings(window_steps=5))
