"""The loops of box and PC on a bus whose clock goes on only where somebody waits."""

import pytest

from rtec.axis.command import Move
from rtec.errors import ArgumentError
from rtec.link.frame import Frame
from rtec.live.box_loop import BoxLoop
from rtec.live.pc_loop import PcLoop
from rtec.live.words import pc_words
from rtec.machine.station import Station, StationSettings
from rtec.predictors import StepModel
from rtec.requester.settings import Outside, PcState
from rtec.requester.status import Status
from rtec.requester.supervision import HoldReason

MS = 10**9
S = 10**12


def test_what_is_asked_for_arrives_at_the_controller(together):
    pair = together()
    pair.run(0.5)
    station, node = pair.box.stations[0].view, pair.pc.nodes[0].view
    assert node.state is PcState.ACTIVE
    assert (node.requested, node.completed) == (3, 3)
    # 12 µm are 12 counts of 1 µm; the servo has taken them out of the position
    assert station.controller_count - station.position == 12
    assert pair.pc.answer_s[0] <= 0.010 and len(pair.pc.answer_s) == 1


def by_the_other(numbers, inputs, memory, sd):
    """A model of one's own: what another axis does to this one."""
    sd[0] = 0.0005
    return numbers[0] * inputs[0]


def test_a_model_of_ones_own_sees_the_other_axes(together):
    model = StepModel(function=by_the_other, inputs=("position_2",), numbers=[0.004])
    pair = together([Move(target_mm=3.0, speed_mm_s=10.0, rest_s=100.0)], axes=(1, 2), table=model)
    pair.run(2.0)
    # 12 um by 3 mm of the other axis: 3 steps of 4 um
    assert [node.view.completed for node in pair.pc.nodes] == [3, 3]
    assert pair.pc.nodes[0].view.sd_mm == 0.0005


def test_a_live_pc_has_no_thermometers(together):
    model = StepModel(function=by_the_other, inputs=("temperature_bed",), numbers=[0.002])
    with pytest.raises(ArgumentError, match="temperature_bed"):
        together(table=model)


def test_a_model_outside_its_ranges_says_which_input_is_outside(together):
    model = StepModel(
        function=by_the_other, inputs=("position_2",), numbers=[0.004], ranges={"position_2": (-1.0, 1.0)}
    )
    moves = [Move(target_mm=3.0, speed_mm_s=10.0, rest_s=100.0)]
    held = together(moves, axes=(1, 2), table=model)
    held.run(2.0)
    view = held.pc.nodes[0].view
    assert (view.state, view.outside) == (PcState.HOLD, "position_2")
    assert "position_2" in pc_words(view)
    keeps = together(moves, axes=(1, 2), table=model, outside=Outside.KEEP)
    keeps.run(2.0)
    view = keeps.pc.nodes[0].view
    assert (view.state, view.completed) == (PcState.ACTIVE, 1)  # as at 1 mm
    assert pc_words(view) == "active; the predictor does not know what it sees: position_2"
    assert view.outside_s == pytest.approx(1.7, abs=0.2)


def test_turns_keep_to_the_grid(together):
    pair = together()
    pair.run(3.0)
    times = [at_ps for at_ps, frame in pair.far.sent if frame.identifier == 0x201]
    assert len(times) == 300
    assert {at_ps % (10 * MS) for at_ps in times} == {2 * MS}
    assert set(pair.pc.late_ps) == {0}


def test_a_late_turn_does_not_move_the_grid(together):
    pair = together()
    pair.run(0.5)
    pair.clock.now_ps = 513 * MS
    pair.run(0.5)
    times = [at_ps for at_ps, frame in pair.far.sent if frame.identifier == 0x201]
    off = [at_ps for at_ps in times if at_ps % (10 * MS) != 2 * MS]
    # the turn due at 502 ms is taken at 513 ms, the next one where it always was
    assert off == [513 * MS]
    assert times[times.index(off[0]) + 1] == 522 * MS
    assert max(pair.pc.late_ps) == 11 * MS


@pytest.mark.parametrize("speed", [0.5, 1.0, 10.0])
def test_the_axes_follow_the_clock_without_drift(cable, speed):
    loop = BoxLoop([Station(StationSettings())], cable[0], speed=speed)
    while cable[0].clock.now_ps < 7 * S:
        loop.step()
    assert loop.now_ps == pytest.approx(speed * cable[0].clock.now_ps, abs=2)


def test_a_box_that_was_not_let_run_does_not_blame_the_pc(together):
    pair = together()
    pair.run(0.5)
    pair.clock.now_ps += S
    pair.box.step()
    assert (pair.box.stalls, pair.box.stalled_ps > 0.9 * S) == (1, True)
    assert pair.box.stations[0].view.status is Status.OK


def test_a_frame_wakes_the_box_between_two_readings(together):
    pair = together()
    pair.run(0.5)
    before = pair.box.stations[0].view.counters.requests
    sent = next(frame for _, frame in reversed(pair.far.sent) if frame.identifier == 0x201)
    pair.near.put(sent)
    due_ps = pair.box.due_ps
    pair.box.step()
    assert pair.clock.now_ps < due_ps
    assert sum(pair.box.stations[0].view.counters.frames_refused.values()) == 1  # the same sequence counter again
    assert pair.box.stations[0].view.counters.requests == before


def test_one_axis_held_holds_the_others(together):
    pair = together(axes=(1, 2, 3))
    pair.run(0.5)
    assert all(node.view.state is PcState.ACTIVE for node in pair.pc.nodes)
    pair.box.stations[1].restart()
    pair.run(0.2)
    reasons = [node.view.reason for node in pair.pc.nodes]
    assert reasons == [HoldReason.OTHER_AXIS, HoldReason.BOX_RESTARTED, HoldReason.OTHER_AXIS]


def test_a_second_pc_is_noticed(together):
    pair = together()
    pair.run(0.5)
    own = next(frame for _, frame in reversed(pair.far.sent) if frame.identifier == 0x201)
    pair.far.put(own)
    pair.run(0.05)
    assert pair.pc.nodes[0].view.reason is HoldReason.ANOTHER_PC


def test_two_boxes_with_one_number_are_noticed(together):
    pair = together()
    pair.run(0.5)
    status = next(frame for _, frame in reversed(pair.near.sent) if frame.identifier == 0x181)
    pair.near.put(status)
    pair.run(0.05)
    assert pair.box.stations[0].view.status is Status.AXIS_TAKEN
    assert pair.pc.nodes[0].view.reason is HoldReason.AXIS_TAKEN


def test_foreign_frames_are_passed_over_and_counted(together):
    pair = together()
    pair.run(0.5)
    for identifier in (0x011, 0x7DF, 0x300, 0x30A):
        pair.far.put(Frame(identifier=identifier, data=bytes(8)))
    pair.far.put(Frame(identifier=0x181, data=b"\x01"))
    pair.run(0.2)
    assert pair.pc.nodes[0].view.state is PcState.ACTIVE
    assert pair.pc.strangers == 3  # 0x011 and a short 0x181 carry the number of axis 1


def test_loops_refuse_twins(cable, together):
    with pytest.raises(ArgumentError, match="a number of its own"):
        BoxLoop([Station(StationSettings()), Station(StationSettings())], cable[0])
    node = together().pc.nodes[0]
    with pytest.raises(ArgumentError, match="an axis of its own"):
        PcLoop([node, node], cable[0])
