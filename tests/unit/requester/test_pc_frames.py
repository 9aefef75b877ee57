"""What a PC makes of frames that come late, or say what cannot be."""

import pytest
from node_oracle import CORRECTIONS, POSITION, REQUEST, STATUS, Request, sealed

from rtec.link.frame import Frame
from rtec.predictors import NoError, StepModel
from rtec.requester.pc_node import PcNode
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.supervision import HoldReason, SupervisionLimits

MS = 10**9
NOT_HOMED, RUNNING, SWITCH_ON, SESSION = 0, 1, 8, 9
PER_TURN = 100
"""Counts of 1 µm from turn to turn of 10 ms: 10 mm/s."""


def node(predictor):
    return PcNode(
        HandshakeSettings(), SupervisionLimits(), axis=1, predictor=predictor, count_mm=0.001, step_counts=4,
        word_limit=127,
    )  # fmt: skip


def turn(pc, number, *, position=0, homed=True, judged=0, accepted=None, late_ms=1, lost=()):
    """Let the box say its words before a turn of the PC; return the sequence of its request."""
    total = (pc.view.requested if accepted is None else accepted).to_bytes(2, "little", signed=True)
    for kind, body in (
        (STATUS, bytes([0 if homed else 1, (RUNNING if homed else NOT_HOMED) | SWITCH_ON, SESSION, 0, 0, 0])),
        (CORRECTIONS, total + total + bytes([SESSION, judged])),
        (
            POSITION,
            position.to_bytes(4, "little", signed=True) + ((position & 0x7FFF) << 1 | homed).to_bytes(2, "little"),
        ),
    ):
        if kind not in lost:
            data = sealed(kind + 1, bytes([0, number, *body]))
            pc.receive(Frame(identifier=kind + 1, data=data), at_ps=pc.due_ps - late_ms * MS)
    frames = pc.turn(at_ps=pc.due_ps)
    return [Request.of(frame.data).sequence for frame in frames if frame.identifier == REQUEST + 1][-1]


def by_speed(numbers, inputs, memory, sd):
    return numbers[0] * inputs[0]


@pytest.mark.parametrize("late_ms", [1, 4, 9])
def test_the_velocity_is_that_between_two_readings_however_late_the_turn(late_ms):
    pc = node(StepModel(function=by_speed, inputs=("velocity",), numbers=[0.02], range_mm=(-50.0, 50.0)))
    judged = turn(pc, 1, homed=False, late_ms=late_ms)
    judged = turn(pc, 2, judged=judged, late_ms=late_ms)
    targets = []
    for number in range(3, 12):
        # one reading is lost: the next is over two turns
        lost = (POSITION,) if number == 6 else ()
        place = PER_TURN * (number - 2)
        judged = turn(pc, number, position=place, judged=judged, late_ms=late_ms, lost=lost)
        targets.append(pc.view.target)
    assert targets == [50] * 9  # 0.02 s at 10 mm/s are 0.2 mm, 50 steps of 4 µm


@pytest.mark.parametrize(
    ("behind", "state", "reason"),
    [(3, PcState.ACTIVE, HoldReason.NONE), (20, PcState.HOLD, HoldReason.ANSWER_LATE)],
)
def test_a_bus_that_delays_all_frames_alike_is_noticed(behind, state, reason):
    """Neither their order nor the watchdog shows it: the box answers requests of long ago."""
    pc = node(NoError())
    asked = [turn(pc, 1, homed=False)]
    for number in range(2, 40):
        asked.append(turn(pc, number, judged=asked[max(len(asked) - behind, 0)]))
    assert (pc.view.state, pc.view.reason) == (state, reason)


def test_the_third_implausible_position_in_a_row_holds_the_machine():
    pc = node(NoError())
    judged = turn(pc, 2, judged=turn(pc, 1, homed=False))
    states = []
    for number in range(3, 6):
        judged = turn(pc, number, position=1_000_000, judged=judged)
        states.append(pc.view.state)
    assert states == [PcState.ACTIVE, PcState.ACTIVE, PcState.HOLD]
    assert pc.view.reason is HoldReason.POSITION_IMPLAUSIBLE


@pytest.mark.parametrize("accepted", [-1, 1])
def test_a_total_that_it_has_not_asked_for_holds_the_machine(accepted):
    pc = node(NoError())
    judged = turn(pc, 2, judged=turn(pc, 1, homed=False))
    turn(pc, 3, judged=judged, accepted=accepted)
    assert (pc.view.state, pc.view.reason) == (PcState.HOLD, HoldReason.COMPLETED_WRONG)
