"""A design of one's own: a row is all that box, closed loop, cell and board need."""

from dataclasses import asdict

import pytest

from rtec.axis import Limits
from rtec.board import Microcontroller
from rtec.errors import ArgumentError
from rtec.injector import Design, DesignRow, Injector, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine import Machine, run_machine, straight_pass
from rtec.machine.cell import Cell
from rtec.machine.moves import Move
from rtec.machine.station import StationSettings
from rtec.predictors import UnidirectionalTable
from rtec.signal import EdgeStream

S = 10**12
FULL_CYCLE = DesignRow(
    key="c4", title="Full cycle by inverters", short="C4", step_counts=4, inverts=True, pins=0x03,
    decide_cycles=5, fast_ns=125,
)  # fmt: skip
SLOPE = UnidirectionalTable(positions_mm=[-1.0, 0.0, 9.0], errors_mm=[0.0, 0.0, 0.18], backlash_mm=0.0)
"""20 um a millimetre."""
LEVELS = [0, 1, 3, 2]
"""Of the states 1 to 4 of the report, A + 2 B."""


def box(design=FULL_CYCLE):
    return InjectorSettings(
        design=design, timing=Timing.of(design, Processor.MCS51), real_edges=RealEdges.HOLD
    )  # fmt: skip


@pytest.mark.parametrize("state", range(4))
@pytest.mark.parametrize("sign", [1, -1])
def test_at_rest_it_walks_once_round_from_any_state(state, sign):
    injector = Injector(box(), initial=LEVELS[state])
    injector.request(sign, at_ps=0)
    seen = injector.process(EdgeStream([], [], initial=LEVELS[state]), until_ps=10 * 10**9)
    assert list(seen.levels) == [LEVELS[(state + sign * k) % 4] for k in range(1, 5)]


@pytest.mark.parametrize("moved", [1, -1])
def test_in_motion_it_adds_a_cycle_and_takes_one_away(moved):
    injector = Injector(box())
    quarter = 50_000_000
    lines = EdgeStream([quarter * k for k in range(1, 81)], [LEVELS[moved * k % 4] for k in range(1, 81)], initial=0)
    injector.request(-2, at_ps=0)
    counts = injector.process(lines, until_ps=90 * quarter).counts()
    assert (counts.net, counts.illegal) == (80 * moved - 8, 0)
    assert injector.insertions.completed == -2


def test_it_corrects_in_the_closed_loop():
    limits = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
    machine = Machine(axis_error=SLOPE, model=SLOPE, injector=box())
    result = run_machine(machine, straight_pass([4.0], 1.0, limits))
    assert (result.audit, result.pending_steps, result.step_counts) == (True, 0, 4)
    # 80 um in steps of four counts of a micrometre; both lie within a step of the error where the axis is
    assert result.insertions.completed == pytest.approx(20, abs=1)
    assert result.controller_counts - result.encoder_counts == 4 * result.insertions.completed


def test_it_corrects_in_a_cell():
    cell = Cell([StationSettings(injector=box())], [[Move(target_mm=4.0, speed_mm_s=1.0, rest_s=9.0)]], SLOPE)
    cell.run(until_ps=8 * S)
    cell.settle()
    (axis,) = cell.axes
    assert axis.view.completed == pytest.approx(20, abs=1)
    assert (axis.off_counts, axis.uninserted_counts, axis.view.counters.illegal_transitions, axis.view.held) == (
        0,
        0,
        0,
        False,
    )


@pytest.mark.parametrize("design", Design)
@pytest.mark.parametrize("firmware", [None, "8051-12mhz"], ids=["model", "firmware"])
def test_nobody_asks_for_a_design_by_its_name(design, firmware):
    """A row with the same fields, which is no member of `Design`, does the very same."""
    limits = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
    processor = None if firmware is None else Microcontroller.named(firmware)
    results = []
    for row in (design, DesignRow(**asdict(design))):
        machine = Machine(axis_error=SLOPE, model=SLOPE, injector=box(row), microcontroller=processor)
        result = run_machine(machine, straight_pass([1.0], 1.0, limits))
        results.append((result.insertions, result.controller_counts, result.audit, result.exchanges))
    assert results[0] == results[1]
    assert results[0][0].completed > 0


@pytest.mark.parametrize(
    ("step_counts", "inverts"), [(0, True), (3, True), (1, True), (2, False), (6, False)]
)  # fmt: skip
def test_gates_that_cannot_make_the_step_are_refused(step_counts, inverts):
    """An odd number of inversions turns the count round, and pulses that end elsewhere take their counts back."""
    with pytest.raises(ArgumentError, match="step_counts"):
        DesignRow(
            key="x", title="X", short="X", step_counts=step_counts, inverts=inverts, pins=3, decide_cycles=4,
            fast_ns=100,
        )  # fmt: skip
