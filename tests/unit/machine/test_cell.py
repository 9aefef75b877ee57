"""Several axes, a PC and a bus: the report's precautions, frame by frame."""

import subprocess
import sys

import pytest

from rtec.axis.command import Move
from rtec.errors import ArgumentError
from rtec.link._bus_kernels import bits_of
from rtec.machine.cell import Cell
from rtec.machine.faults import PC_NODE, Fault, FaultKind
from rtec.machine.station import StationSettings
from rtec.predictors import UnidirectionalTable
from rtec.requester.status import Status
from rtec.requester.supervision import HoldReason
from tests.machines import SLOPE

MS, S = 10**9, 10**12


def run(*faults, axes=1, until_ps=4 * S, moves=None, **settings):
    stations = [StationSettings(axis=axis, **settings) for axis in range(1, axes + 1)]
    programs = [moves or [Move(target_mm=2.0, speed_mm_s=2.0, rest_s=100.0)]] * axes
    cell = Cell(stations, programs, SLOPE, faults=faults)
    cell.run(until_ps=until_ps)
    return cell


def beyond_window(frames):
    """Return a seed under which that many masquerading totals in a row change by 4 steps or more."""
    return next(seed for seed in range(10_000) if all(bits_of(seed, k) % 8 >= 3 for k in range(frames)))


def masquerade(frames, seed):
    return Fault(
        kind=FaultKind.FRAME_MASQUERADE, place=PC_NODE, identifier=0x201, from_ps=3 * S, most=frames, seed=seed
    )


def test_the_third_is_fatal():
    cell = run(masquerade(3, beyond_window(3)))
    axis = cell.axes[0]
    assert axis.box_status is Status.I_STILL_DONT_BELIEVE_YOU
    assert axis.pc_reason is HoldReason.BOX_STILL_DOUBTS
    assert cell.held_ps == pytest.approx(3 * S + 30 * MS, abs=12 * MS)
    assert axis.view.completed == 10


def test_a_total_within_the_window_that_nobody_asked_for_is_noticed():
    """The report's window cannot tell; the PC reads what the box has accepted."""
    seed = next(seed for seed in range(1000) if bits_of(seed, 0) % 8 < 2)
    cell = run(masquerade(1, seed))
    assert cell.axes[0].pc_reason is HoldReason.COMPLETED_WRONG
    assert cell.held_ps - 3 * S < 25 * MS


def test_the_probing_mode_corrects_nothing():
    cell = run(until_ps=700 * MS)
    before = cell.axes[0].view.completed
    cell.probe(True)
    cell.run(until_ps=720 * MS)
    entered = cell.axes[0].view.completed
    cell.run(until_ps=3 * S)
    assert entered - before in (0, 1)
    assert cell.axes[0].view.completed == entered < 10
    cell.probe(False)
    cell.run(until_ps=4 * S)
    assert cell.axes[0].view.completed == 10


def test_only_a_large_correction_may_exceed_the_window_at_once():
    hot = UnidirectionalTable(positions_mm=[-1.0, 9.0], errors_mm=[0.12, 0.12], backlash_mm=0.0)
    totals = []
    for meant in (False, True):
        cell = run(until_ps=3 * S)
        cell.predict_by(hot)
        if meant:
            cell.allow_large_correction()
        cell.run(until_ps=3 * S + 8 * MS)
        totals.append(cell.axes[0].view.requested)
        cell.run(until_ps=4 * S)
        assert cell.axes[0].view.completed == 30
    assert totals == [13, 30]


def test_compiled_loops_load_from_the_cache():
    """A circle of calls is not loaded again: the second process with this cache ended in a segmentation fault."""
    run(until_ps=MS)
    code = (
        "from rtec.axis.command import *; from rtec.machine.cell import *; from rtec.machine.station import *;"
        "from rtec.predictors import NoError;"
        "cell = Cell([StationSettings()], [[Move(target_mm=1.0, speed_mm_s=5.0)]], NoError());"
        "cell.run(until_ps=10**9); print(cell.now_ps)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout) == (0, "1000000000\n")


@pytest.mark.parametrize(
    ("stations", "moves", "faults", "said"),
    [
        ([StationSettings(axis=2)], [[Move(target_mm=1.0, speed_mm_s=1.0)]], (), "stations"),
        ([], [], (), "stations"),
        ([StationSettings()], [[]], (), "moves"),
        ([StationSettings()], [], (), "moves"),
        (
            [StationSettings()],
            [[Move(target_mm=1.0, speed_mm_s=1.0)]],
            (Fault(kind=FaultKind.CABLE_OPEN, place=2, from_ps=0),),
            "place",
        ),
    ],
)
def test_what_is_no_machine_is_refused(stations, moves, faults, said):
    with pytest.raises(ArgumentError, match=said):
        Cell(stations, moves, SLOPE, faults=faults)


def test_another_predictor_brings_its_own_range():
    cell = run(until_ps=500 * MS)
    cell.predict_by(UnidirectionalTable(positions_mm=[-1.0, 1.0], errors_mm=[0.0, 0.02], backlash_mm=0.0))
    cell.run(until_ps=4 * S)
    assert cell.axes[0].pc_reason is HoldReason.PREDICTOR_OUT_OF_RANGE


def test_a_fault_counts_its_own_effects_only():
    """The one ends before the other begins, at the same axis; the third begins when the axis stands."""
    open_once = Fault(kind=FaultKind.STALE_DATA_VALID, place=1, from_ps=500 * MS, until_ps=515 * MS)
    torn = Fault(kind=FaultKind.STALE_DATA_VALID, place=1, from_ps=800 * MS, until_ps=815 * MS)
    at_rest = Fault(kind=FaultKind.STALE_DATA_VALID, place=1, from_ps=3 * S, until_ps=3 * S + 15 * MS)
    alone = [run(fault).fired[0].times for fault in (open_once, torn, at_rest)]
    together = [activation.times for activation in run(open_once, torn, at_rest).fired]
    assert together == alone
    assert alone[0] > 0 and alone[2] == 0
