"""A restart with a hot machine: totals are zero, the axis is grown by 30 um (Yee 1992, General Considerations)."""

import numpy as np
import pytest

from rtec.axis import Dwell, Encoder, Program, plan
from rtec.axis.command import Move
from rtec.heat.course import HeatCourse
from rtec.injector import Design
from rtec.machine import TRACE_COLUMNS, Ending, Machine, run_machine
from rtec.machine.cell import Cell
from rtec.machine.station import StationSettings
from rtec.predictors import growth
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.status import Status
from rtec.requester.supervision import HoldReason
from tests.machines import LIMITS, box_of

S = 10**12
HOT = HeatCourse(thermometers={"screw": [32.0]}, shift_mm=[0.030])
MODEL = growth("screw", 0.0025)
AT_ONCE = HandshakeSettings(pc_window_steps=1000)
"""Of a PC that asks for the whole total, as that of the report did."""


def restart(*, allowed, handshake=AT_ONCE, seconds=2.0):
    machine = Machine(
        injector=box_of(Design.B),
        encoder=Encoder(),
        model=MODEL,
        heat=HOT,
        handshake=handshake,
        allow_large_correction=allowed,
    )
    result = run_machine(machine, plan(Program(blocks=(Dwell(seconds=seconds),)), LIMITS), trace_every=1)
    time_s, completed = (result.trace[:, TRACE_COLUMNS.index(name)] for name in ("time_s", "completed"))
    return result, time_s, completed


def test_with_the_flag_the_box_accepts_the_whole_correction():
    result, _, completed = restart(allowed=True)
    assert (result.ending, result.refused, result.audit) == (Ending.FINISHED, 0, True)
    assert completed[-1] == 30
    deviation = result.trace[-1, TRACE_COLUMNS.index("true_mm")] - result.trace[-1, TRACE_COLUMNS.index("command_mm")]
    assert abs(deviation) <= 0.0015


def test_without_the_flag_the_box_does_not_believe_it_and_the_machine_is_held():
    result, _, completed = restart(allowed=False)
    assert (result.ending, result.status) == (Ending.HELD, Status.I_STILL_DONT_BELIEVE_YOU)
    assert result.refused == 3
    assert not completed.any()


def test_window_by_window_it_needs_no_flag_but_takes_longer():
    quick, slow = (restart(allowed=allowed, handshake=HandshakeSettings()) for allowed in (True, False))
    arrived = [time_s[np.argmax(completed == 30)] for _, time_s, completed in (quick, slow)]
    assert slow[0].refused == 0
    assert slow[0].ending is Ending.FINISHED
    assert arrived[0] > 0.0
    assert arrived[1] > arrived[0] + 0.05


@pytest.mark.parametrize("allowed", [True, False])
def test_the_cell_takes_it_with_the_flag_alone(allowed):
    moves = [[Move(target_mm=1.0, speed_mm_s=5.0, rest_s=100.0)]]
    cell = Cell([StationSettings(handshake=AT_ONCE)], moves, MODEL, heat=HOT)
    if allowed:
        cell.allow_large_correction()
    cell.run(until_ps=4 * S)
    cell.settle()
    axis = cell.axes[0]
    if allowed:
        assert (axis.pc_state, axis.view.completed, axis.off_counts) == (PcState.ACTIVE, 8, 0)  # 30 um, steps of 4
        assert axis.deviation_mm == pytest.approx(0.0, abs=0.0025)
    else:
        assert (axis.pc_state, axis.pc_reason) == (PcState.HOLD, HoldReason.BOX_STILL_DOUBTS)
        assert (axis.box_status, axis.view.completed) == (Status.I_STILL_DONT_BELIEVE_YOU, 0)
        assert axis.deviation_mm == pytest.approx(0.030, abs=1e-9)
