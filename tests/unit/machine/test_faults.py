"""Every class of faults takes effect, and says so; what a fault cannot be is refused."""

from pathlib import Path

import pytest

from rtec.errors import ArgumentError
from rtec.machine.cell import Cell
from rtec.machine.fault_kinds import FaultCategory, ProvedBy, fault_table
from rtec.machine.faults import PC_NODE, Fault, FaultKind, FaultPlace, Strikes, fault_records
from rtec.machine.station import Move, StationSettings
from rtec.predictors import UnidirectionalTable

MS, S = 10**9, 10**12
SLOPE = UnidirectionalTable(positions_mm=[-1.0, 0.0, 9.0], errors_mm=[0.0, 0.0, 0.18], backlash_mm=0.0)
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
    proof = cell.fired[0]
    assert proof.times >= 1
    assert proof.first_ps is not None
    assert proof.first_ps >= S


@pytest.mark.parametrize("kind", [kind for kind in FaultKind if kind.place is FaultPlace.AXIS])
def test_at_a_box_it_can_wait_for_an_insertion(kind):
    cell = cell_with(fault(kind, strikes=Strikes.WHILE_INSERTING))
    cell.run(until_ps=3 * S)
    assert cell.fired[0].times >= 1


def test_it_strikes_as_many_frames_as_it_says():
    cell = cell_with(fault(FaultKind.FRAME_LOST, place=PC_NODE, most=3))
    cell.run(until_ps=2 * S)
    assert cell.fired[0].times == 3


def test_the_numbers_of_the_kernels_differ():
    assert len({kind.code for kind in FaultKind}) == len(FaultKind)


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
        ({"kind": FaultKind.PC_KILLED, "from_ps": 0, "strikes": Strikes.WHILE_INSERTING}, "strikes"),
    ],
)
def test_what_it_cannot_be_is_refused(words, said):
    with pytest.raises(ArgumentError, match=said):
        Fault(**words)


def test_every_class_is_one_row_and_all_else_follows_from_it():
    codes = [kind.code for kind in FaultKind]
    assert len(set(codes)) == len(codes)
    assert all(kind.meaning for kind in FaultKind)
    on_bus = {kind for kind in FaultKind if kind.place is FaultPlace.BUS}
    # frames are counted where they are struck; what happens elsewhere is proved by what it does there
    assert {kind for kind in FaultKind if kind.proved_by is ProvedBy.FRAMES} == on_bus
    assert {kind.proved_by for kind in FaultKind if kind.category is FaultCategory.ENCODER} == {
        ProvedBy.CABLE,
        ProvedBy.GLITCHES,
    }
    record = fault_records([Fault(kind=FaultKind.GLITCHES, place=1, from_ps=0)])[0]
    assert (int(record.kind), int(record.proof)) == (FaultKind.GLITCHES.code, ProvedBy.GLITCHES)


def test_the_table_for_users_is_that_of_the_rows():
    page = Path(__file__).parents[3] / "docs" / "how-to-test-your-pc.md"
    assert fault_table() in page.read_text(encoding="utf-8")
