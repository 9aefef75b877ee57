"""A design of one's own: a row is all that closed loop, cell and board need."""

from dataclasses import asdict

import pytest

from rtec.axis.command import Move
from rtec.board import Microcontroller
from rtec.injector import Design, DesignRow
from rtec.machine import Machine, run_machine, straight_pass
from rtec.machine.cell import Cell
from rtec.machine.station import StationSettings
from tests.machines import LIMITS, SLOPE, box_of

S = 10**12
FULL_CYCLE = DesignRow(
    key="c4", title="Full cycle by inverters", short="C4", step_counts=4, inverts=True, pins=0x03,
    decide_cycles=5, fast_ns=125,
)  # fmt: skip


def looped(design, to_mm, processor=None):
    machine = Machine(axis_error=SLOPE, model=SLOPE, injector=box_of(design), microcontroller=processor)
    return run_machine(machine, straight_pass([to_mm], 1.0, LIMITS))


def test_it_corrects_in_the_closed_loop_and_in_a_cell():
    result = looped(FULL_CYCLE, 4.0)
    assert (result.audit, result.pending_steps, result.step_counts) == (True, 0, 4)
    # 80 um in steps of four counts of a micrometre; both lie within a step of the error where the axis is
    assert result.insertions.completed == pytest.approx(20, abs=1)
    moves = [Move(target_mm=4.0, speed_mm_s=1.0, rest_s=9.0)]
    cell = Cell([StationSettings(injector=box_of(FULL_CYCLE))], [moves], SLOPE)
    cell.run(until_ps=8 * S)
    cell.settle()
    (axis,) = cell.axes
    assert axis.view.completed == pytest.approx(20, abs=1)
    assert (axis.off_counts, axis.uninserted_counts, axis.view.held) == (0, 0, False)


@pytest.mark.parametrize("design", Design)
@pytest.mark.parametrize("firmware", [None, "8051-12mhz"], ids=["model", "firmware"])
def test_nobody_asks_for_a_design_by_its_name(design, firmware):
    """A row with the same fields, which is no member of `Design`, does the very same."""
    processor = None if firmware is None else Microcontroller.named(firmware)
    one, other = (looped(row, 1.0, processor) for row in (design, DesignRow(**asdict(design))))
    assert (one.insertions, one.controller_counts, one.audit) == (other.insertions, other.controller_counts, True)
    assert one.insertions.completed > 0
