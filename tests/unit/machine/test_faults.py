"""Every class of faults takes effect, and says so; what a fault cannot be is refused."""

from pathlib import Path

import pytest

from rtec.axis.command import Move
from rtec.board import Microcontroller
from rtec.errors import ArgumentError
from rtec.injector import Design, InjectorSettings, Processor, Timing
from rtec.machine import Machine, run_machine, straight_pass
from rtec.machine.bench_faults import BenchFaults
from rtec.machine.cell import Cell
from rtec.machine.fault_kinds import CABLE, ActivatedBy, FaultCategory
from rtec.machine.faults import PC_NODE, Fault, FaultKind, FaultPlace, FaultRow, Trigger
from rtec.machine.station import Alarm, StationSettings
from rtec.machine.workbench import bench_of
from rtec.requester.status import Status
from tests.machines import LIMITS, SLOPE

MS, S = 10**9, 10**12
JUMPS = (FaultKind.CLOCK_JUMP_FORWARD, FaultKind.CLOCK_JUMP_BACK)


def fault(kind, **changes):
    words = {"kind": kind, "from_ps": S, "seed": 3}
    if kind.place is FaultPlace.AXIS or kind is FaultKind.BUS_OFF:
        words["place"] = 1
    if kind in (FaultKind.FRAME_LATE, FaultKind.FRAME_DUPLICATED, *JUMPS):
        words["delay_ps"] = 15 * MS
    if kind in (FaultKind.REQUEST_STUCK, FaultKind.TOTAL_BIT_FLIPPED):
        words |= {"place": PC_NODE, "identifier": 0x201}
    return Fault(**(words | changes))


def cell_with(*faults):
    moves = [[Move(target_mm=8.0, speed_mm_s=2.0, rest_s=1.0)]]
    return Cell([StationSettings()], moves, SLOPE, faults=faults)


@pytest.mark.parametrize("kind", FaultKind)
def test_every_class_takes_effect_and_not_before_its_time(kind):
    cell = cell_with(fault(kind))
    cell.run(until_ps=S)
    assert cell.fired[0].times == 0
    cell.run(until_ps=3 * S)
    activation = cell.fired[0]
    assert activation.times >= 1
    assert activation.first_ps is not None
    assert activation.first_ps >= S


@pytest.mark.parametrize("kind", [kind for kind in FaultKind if kind.place is FaultPlace.AXIS])
def test_at_a_box_it_can_wait_for_an_insertion(kind):
    cell = cell_with(fault(kind, trigger=Trigger.WHILE_INSERTING))
    cell.run(until_ps=3 * S)
    assert cell.fired[0].times >= 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"kind": FaultKind.CABLE_OPEN, "from_ps": 0}, "place"),
        ({"kind": FaultKind.CABLE_OPEN, "from_ps": 0, "place": 16}, "place"),
        ({"kind": FaultKind.FRAME_LOST, "from_ps": 0, "place": 8}, "place"),
        ({"kind": FaultKind.FRAME_LOST, "from_ps": -1}, "from_ps"),
        ({"kind": FaultKind.FRAME_LOST, "from_ps": 5, "until_ps": 5}, "until_ps"),
        ({"kind": FaultKind.FRAME_LOST, "from_ps": 0, "most": 0}, "most"),
        ({"kind": FaultKind.FRAME_LOST, "from_ps": 0, "identifier": 0x800}, "identifier"),
        ({"kind": FaultKind.FRAME_LATE, "from_ps": 0}, "delay_ps"),
        ({"kind": FaultKind.CLOCK_JUMP_BACK, "from_ps": 0}, "delay_ps"),
        ({"kind": FaultKind.BUS_OFF, "from_ps": 0}, "place"),
        ({"kind": FaultKind.PC_KILLED, "from_ps": 0, "trigger": Trigger.WHILE_INSERTING}, "trigger"),
    ],
)
def test_what_it_cannot_be_is_refused(words, said):
    with pytest.raises(ArgumentError, match=said):
        Fault(**words)


def fault_table():
    """Return all classes as a table in Markdown."""
    rows = ["| name | of | what happens | place |", "|---|---|---|---|"]
    places = {
        FaultPlace.BUS: "the node that sends: 0 the PC, n the box of axis n",
        FaultPlace.AXIS: "the axis; 1, if nothing else is said",
        FaultPlace.PC: "the PC",
    }
    for kind in FaultKind:
        place = (
            "the requests for axis 1, if nothing else is said"
            if kind.category is FaultCategory.TOTAL
            else places[kind.place]
        )
        words = f"`{kind.value}` (`{kind.name}`)", kind.category.value, kind.meaning, place
        rows.append(f"| {' | '.join(words)} |")
    return "\n".join(rows)


def test_the_table_for_users_is_that_of_the_rows():
    page = Path(__file__).parents[3] / "docs" / "how-to-test-your-pc.md"
    assert fault_table() in page.read_text(encoding="utf-8")


CABLES = CABLE, FaultCategory.ENCODER, ActivatedBy.CABLE
A_LOW = FaultRow("A shorted to ground", *CABLES, "A is low", lambda levels, _: levels & 2)
BOTH_A = FaultRow("B shorted to A", *CABLES, "B is A", lambda levels, _: 3 * (levels & 1))
INVERTED = FaultRow("lines inverted", *CABLES, "both are wrong", lambda levels, _: 3 - levels)


@pytest.mark.parametrize("firmware", [False, True], ids=["model", "firmware"])
def test_a_row_of_ones_own_is_all_that_a_new_fault_needs_in_the_loop(firmware):
    """With A held low B goes forth and back: the loop loses every count, and of four levels two have A high."""
    design = Design.C
    machine = Machine(
        injector=InjectorSettings(design=design, timing=Timing.of(design, Processor.MCS51)),
        microcontroller=Microcontroller.named("8051-12mhz") if firmware else None,
        faults=[Fault(kind=A_LOW, place=1, from_ps=S, until_ps=2 * S)],
    )
    result = run_machine(machine, straight_pass([4.0], 1.0, LIMITS))
    assert result.fired[0].times == pytest.approx(-result.audit_counts / 2, abs=2)
    assert -result.audit_counts > 1000


def test_a_row_of_ones_own_is_all_that_a_new_fault_needs_in_a_cell_and_on_a_workbench():
    cell = cell_with(fault(BOTH_A))
    cell.run(until_ps=3 * S)
    view = cell.axes[0].view
    assert (view.status, view.alarm) == (Status.ENCODER_FAULT, Alarm.ILLEGAL)
    assert cell.fired[0].first_ps >= S
    bench = bench_of()
    armed = BenchFaults(bench, lambda by_ps, note: None)
    armed.arm(INVERTED, at_s=0.1, lasting_s=0.1)
    bench.bus.run(until_ps=S)
    # both lines change at once when it begins; an axis at rest has no other edge
    assert armed.times == {"lines inverted at 0.1 s, axis 1": 1}
    assert bench.boxes[1].alarm is Alarm.ILLEGAL


def test_lines_that_are_no_levels_are_refused():
    with pytest.raises(ArgumentError, match="0 to 3"):
        FaultRow("loose", *CABLES, "loose", lambda levels, before: levels + 1)


def test_two_that_wait_at_one_axis_of_a_cell_are_refused():
    waiting = {"from_ps": S, "trigger": Trigger.WHILE_INSERTING}
    power, switch = (Fault(kind=kind, place=1, **waiting) for kind in (FaultKind.POWER_LOST, FaultKind.SWITCH_THROWN))
    with pytest.raises(ArgumentError, match="when this is over"):
        cell_with(power, switch)
    jumps = [Fault(kind=kind, from_ps=S + n, delay_ps=MS) for n, kind in enumerate(JUMPS)]
    cell_with(power, *jumps)  # a clock that has jumped is done with it
