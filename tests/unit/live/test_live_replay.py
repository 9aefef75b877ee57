"""A log played to a box and to a PC, in simulated time: the same answers, or where they differ."""

import dataclasses
import json
from itertools import pairwise

import pytest

from rtec.axis.command import Move
from rtec.errors import FileFormatError
from rtec.link.frame import Frame
from rtec.link.logs import Direction, Log
from rtec.link.messages import Kind, MessageSet
from rtec.live.box_loop import BoxLoop
from rtec.live.compared import ReplayComparison
from rtec.live.pc_loop import PcLoop
from rtec.live.played import Role, kind_of, survey
from rtec.live.replay_run import ReplayRun, replay_document, tolerance_of
from rtec.live.replayed_side import ReplayedSide
from rtec.machine.station import Station, StationSettings
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.setup import Setup
from rtec.requester.status import BoxState

MS = 10**9
MOVES = [Move(target_mm=8.0, speed_mm_s=20.0, rest_s=0.2)]
SETUP = Setup(design="a", step_mm=0.004, cycle_ps=10 * MS)


class Driving:
    """An end of a cable whose waiting lets the loop at the other end go on."""

    def __init__(self, end, loop):
        self._end, self._loop = end, loop

    def __getattr__(self, name):
        return getattr(self._end, name)

    def receive(self, until_ps):
        clock, other = self._end.clock, self._end.other
        while not self._end.inbox:
            if not other.inbox and self._loop.due_ps > max(until_ps, clock.now_ps):
                break
            self._loop.step()
        return self._end.receive(until_ps)


@pytest.fixture
def recorded(together, tmp_path):
    """Record box and PC, from their start on; return the log."""

    def record(seconds=2.0, keep=lambda frame: True, **options):
        pair = together(MOVES, **({"setup": SETUP} | options))
        pair.run(seconds)
        file = tmp_path / "run.log"
        sent = [(t_ps, 0, frame) for t_ps, frame in pair.near.sent] + [
            (t_ps, 1, frame) for t_ps, frame in pair.far.sent
        ]
        with Log(file) as log:
            for t_ps, _, frame in sorted(sent, key=lambda one: one[:2]):
                if keep(frame):
                    log.record(frame, t_ps, Direction.SENT)
        return file

    return record


def play_to_box(ends, file, settings=None, moves=MOVES, session=77, **options):
    near, far = ends
    box = BoxLoop([Station(settings or StationSettings(), moves, session=session, start_ps=near.clock.now_ps)], near)
    return play(file, Driving(far, box), Role.PC, **options), box.stations[0]


def play_to_pc(ends, file, nodes, **options):
    near, far = ends
    pc = PcLoop(nodes, far)
    return play(file, Driving(near, pc), Role.BOX, **options), pc.nodes[0]


def play(file, transport, role, speed=1.0, start_up_s=5.0):
    found = survey(file, role)
    run = ReplayRun(file, transport, found, speed=speed, tolerance_ps=tolerance_of(found), start_up_s=start_up_s)
    run.run()
    assert json.loads(json.dumps(replay_document(run)))["passed"] == run.passed
    return run


def fields(outcome):
    return {(each.message, each.field) for each in outcome.comparison.differences}


def test_a_box_answers_as_in_the_log(fresh, recorded):
    outcome, station = play_to_box(fresh(), recorded())
    assert outcome.passed, outcome.comparison.differences
    # a request every 10 ms from the PC's first turn on, and the expected setup before it was homed
    assert len(outcome.late_ps) == pytest.approx(200, abs=3)
    assert outcome.comparison.said > 500
    assert (station.view.completed, station.view.counters.requests_refused) == (3, 0)


def test_a_box_with_a_smaller_window_does_not(fresh, recorded):
    """The log asks for three steps at once; this box believes one."""
    settings = StationSettings(handshake=HandshakeSettings(window_steps=1))
    outcome, station = play_to_box(fresh(), recorded(), settings)
    assert not outcome.passed
    assert {("Corrections", "Accepted"), ("Status", "Code"), ("Status", "State")} <= fields(outcome)
    first = next(each for each in outcome.comparison.differences if each.field == "Accepted")
    assert (first.axis, first.logged, first.said) == (1, 3, 0)
    assert station.view.box_state is BoxState.FATAL


def test_a_box_of_another_design_refuses_the_pc_of_the_log(fresh, recorded):
    from rtec.axis import Encoder

    outcome, station = play_to_box(fresh(), recorded(), StationSettings(encoder=Encoder(count_mm=0.002)))
    assert {("Setup", "Step"), ("Status", "Code")} <= fields(outcome)
    assert station.view.box_state is BoxState.NOT_HOMED


def test_nobody_is_met(fresh, recorded):
    file = recorded()
    _, far = fresh()
    outcome = play(file, far, Role.PC, start_up_s=0.5)
    assert (outcome.met, outcome.passed, len(outcome.late_ps)) == (False, False, 0)
    assert outcome.notes == ["the box of axis 1 was not heard"]


def test_what_was_said_before_the_node_was_met_is_no_answer(fresh, recorded):
    """The bus of a program that starts slowly holds hundreds of old frames; a box says as many within a second."""
    file = recorded()
    near, far = fresh()
    box = BoxLoop([Station(StationSettings(), MOVES, session=77)], near)
    while far.clock.now_ps < 800 * MS:
        box.step()
    assert len(far.inbox) > 200
    slow = Driving(far, box)

    def receive(until_ps, receive=slow.receive):
        far.clock.now_ps += MS // 5  # of the processor, for each frame
        return receive(until_ps)

    slow.receive = receive
    outcome = play(file, slow, Role.PC)
    assert (outcome.notes, outcome.passed) == ([], True), outcome.comparison.differences


def test_a_computer_that_stands_still_for_a_while_is_no_difference(fresh, recorded):
    """Neither the box nor the log's PC are let run for 200 ms; both go on from there."""
    file = recorded()
    near, far = fresh()
    box = BoxLoop([Station(StationSettings(), MOVES, session=77)], near)
    driving = Driving(far, box)

    def receive(until_ps, receive=driving.receive):
        received = receive(until_ps)
        if 500 * MS < far.clock.now_ps < 520 * MS and received is None:
            far.clock.now_ps += 200 * MS
        return received

    driving.receive = receive
    outcome = play(file, driving, Role.PC)
    assert outcome.passed, outcome.comparison.differences
    assert "its clock stood still, 200 ms" in outcome.notes[0]


@pytest.mark.parametrize(
    ("pc_lives", "now"),
    [(True, "RUNNING, not at home, with a total of 3"), (False, "FATAL, not at home, with a total of 3")],
)
def test_a_box_that_is_not_fresh_is_not_played_to(recorded, together, pc_lives, now):
    file = recorded()
    pair = together()
    pair.run(0.5)
    pair.pc_lives = pc_lives
    pair.run(0.3)
    pair.far.inbox.clear()
    outcome = play(file, Driving(pair.far, pair.box), Role.PC)
    assert (outcome.stale, outcome.passed, len(outcome.late_ps)) == ([1], False, 0)
    assert outcome.notes == [
        f"the box of axis 1 is not as that of the log at its beginning: it is {now}, that was NOT_HOMED, at home, "
        "with a total of 0; start 'rtec box' anew"
    ]


def test_another_pc_on_the_bus_is_told(fresh, recorded):
    file = recorded(0.5)
    near, far = fresh()
    far.put(Frame(identifier=0x201, data=bytes(8)), at_ps=300 * MS)
    outcome, _ = play_to_box((near, far), file)
    assert outcome.rivals == 1


def test_a_pc_answers_as_in_the_log(fresh, recorded, together):
    file = recorded()
    ends = fresh()
    outcome, node = play_to_pc(ends, file, together(setup=SETUP).pc.nodes)
    assert outcome.passed, outcome.comparison.differences
    assert (node.view.state, node.view.completed) == (PcState.ACTIVE, 3)
    assert all(kind_of(frame) in Role.BOX.kinds for _, frame in ends[0].sent)


def test_a_pc_that_is_late_now_and_then_is_not_outrun(fresh, recorded, together):
    """The box of the log accepts what this PC has not asked for yet: it is given back what it asks for."""
    file = recorded()
    nodes = together(setup=SETUP).pc.nodes
    turn = nodes[0].turn

    ends = fresh()
    pc = PcLoop(nodes, ends[1])

    def late_turn(*, at_ps):
        ends[1].clock.now_ps += 6 * MS  # it was not let run
        return turn(at_ps=at_ps)

    nodes[0].turn = late_turn
    outcome = play(file, Driving(ends[0], pc), Role.BOX)
    assert nodes[0].view.state is PcState.ACTIVE, nodes[0].view.reason
    assert outcome.passed, outcome.comparison.differences


def test_a_pc_that_nobody_started_is_not_met(fresh, recorded):
    ends = fresh()
    outcome = play(recorded(), ends[0], Role.BOX, start_up_s=0.3)
    assert not outcome.met
    words = [frame.data[1] for _, frame in ends[0].sent if frame.identifier == 0x181]
    assert len(words) == 30  # the box says again and again that it is not homed, in order
    assert [(after - before) % 256 for before, after in pairwise(words)] == [1] * 29


def test_twice_as_fast(fresh, recorded):
    """The requests come every 5 ms; what stands still is the same, what moves at its own speed is not."""
    outcome, station = play_to_box(fresh(), recorded(), moves=[], speed=2.0)
    assert outcome.run_s == pytest.approx(1.0, abs=0.1)
    assert station.view.completed == 3
    assert fields(outcome) == {("Position", "Position")}


def test_mistakes_of_the_log_stay_mistakes():
    """Another session is as much another one as in the log, and a wrong checksum is as wrong."""
    messages = MessageSet.load()
    translator = ReplayedSide()
    translator.logged.take(messages.encode("Status", 1, {"Session": 9}))
    translator.said.take(messages.encode("Status", 1, {"Session": 200}))
    for session, expected in ((9, 200), (10, 201), (8, 199)):
        frame = translator.translated(messages.encode("Request", 1, {"Session": session, "Total": 3}))
        message = messages.decode(frame.identifier, frame.data)
        assert (message.values["Session"], message.values["Total"], message.verdict.name) == (expected, 3, "RIGHT")
    good = messages.encode("Request", 1, {"Session": 9})
    bad = dataclasses.replace(good, data=bytes([good.data[0] ^ 5]) + good.data[1:])
    frame = translator.translated(bad)
    right = messages.encode("Request", 1, {"Session": 200, "Sequence": good.data[1]})
    assert frame.data[0] == right.data[0] ^ 5
    short = Frame(identifier=0x201, data=b"\x01")
    assert translator.translated(short) == short


def test_a_played_box_accepts_what_this_pc_asks_for():
    """Where the box of the log had accepted what it was asked for; else it stays at what it accepted last."""
    messages = MessageSet.load()
    voice = ReplayedSide()
    for _ in range(6):
        voice.repeated(Frame(identifier=0x281, data=bytes(8)))  # from then on five frames are more than in the log

    def ask(logged, said):
        voice.logged.take(messages.encode("Request", 1, {"Total": logged[1], "Sequence": logged[0]}))
        voice.said.take(messages.encode("Request", 1, {"Total": said[1], "Sequence": said[0]}))

    def answer(judged, accepted, completed):
        values = {"Judged": judged, "Accepted": accepted, "Completed": completed, "Sequence": 7}
        frame = voice.translated(messages.encode("Corrections", 1, values))
        message = messages.decode(frame.identifier, frame.data)
        assert (message.verdict.name, message.values["Sequence"]) == ("RIGHT", 12)
        return [message.values[name] for name in ("Judged", "Accepted", "Completed")]

    ask((40, 3), (200, -2))
    assert answer(40, 3, 1) == [200, -2, -4]  # two steps are still to be inserted
    ask((41, 6), (201, 1))
    assert answer(40, 3, 3) == [200, -2, -2]  # one request behind
    assert answer(41, 3, 3) == [201, -2, -2]  # doubted: as it was
    assert answer(41, 6, 6) == [201, 1, 1]
    assert answer(9, 0, 0) == [9, 0, 0]  # of a request from before


def test_a_log_of_one_side_is_refused(recorded):
    file = recorded(0.2, keep=lambda frame: kind_of(frame) in Role.BOX.kinds)
    with pytest.raises(FileFormatError, match="it holds no frame of a PC"):
        survey(file, Role.PC)
    with pytest.raises(FileFormatError, match="it holds no frame of a PC"):
        survey(file, Role.BOX)


def test_a_log_that_is_cut_off_is_played_up_to_there(fresh, recorded):
    file = recorded(0.5)
    file.write_text(file.read_text()[:-12])
    assert "the log is cut off" in survey(file, Role.PC).cut_off
    outcome, _ = play_to_box(fresh(), file)
    assert outcome.passed, outcome.comparison.differences


def test_a_log_that_begins_in_the_middle_says_so(fresh, recorded):
    file = recorded(1.0)
    lines = file.read_text().splitlines(keepends=True)
    file.write_text("".join(lines[len(lines) // 2 :]))
    outcome, _ = play_to_box(fresh(), file)
    assert not outcome.passed
    assert outcome.notes == ["the log takes no axis home: a box that has just started cannot follow it"]


def test_a_node_that_ends_in_the_middle_has_failed(fresh, recorded):
    file = recorded()
    near, far = fresh()
    box = BoxLoop([Station(StationSettings(), MOVES)], near)
    step = box.step

    def until_a_second():
        step()
        near.gone = far.gone = near.clock.now_ps > 1000 * MS

    box.step = until_a_second
    outcome = play(file, Driving(far, box), Role.PC)
    assert (outcome.lost, outcome.passed, outcome.comparison.differences) == (True, False, [])
    assert len(outcome.late_ps) == pytest.approx(100, abs=3)
    assert outcome.notes == ["the bus was lost: fake cable: has vanished; plug it in"]


def test_what_a_box_says_alone_is_not_waited_for(fresh, recorded, together, tmp_path):
    """The PC of the log ends after half a second, the box goes on saying so for ten."""
    from rtec.link.logs import read_log

    alone = tmp_path / "alone.log"
    with Log(alone) as log:
        last_ps = 0
        for logged in read_log(recorded(0.5)):
            log.record(logged.frame, logged.time_ps, Direction.SENT)
            last_ps = logged.time_ps
        messages = MessageSet.load()
        for k in range(1, 1000):
            frame = messages.encode(
                "Status", 1, {"State": "FATAL", "Code": "LINK_LOST", "HoldWanted": 1, "SwitchOn": 1}
            )
            log.record(frame, last_ps + k * 10 * MS, Direction.SENT)
    outcome, _ = play_to_box(fresh(), alone)
    assert outcome.run_s == pytest.approx(0.5 + 0.2 + 0.05, abs=0.02)


# what is the same


def test_what_only_one_side_says_is_a_difference_from_there_on():
    messages = MessageSet.load()
    comparison = ReplayComparison([Kind.STATUS, Kind.HOLD], tolerance_ps=50 * MS)
    for t_ms in range(0, 600, 10):
        comparison.log_says(t_ms * MS, messages.encode("Status", 1, {}))
        if t_ms < 300:
            comparison.node_says(t_ms * MS, messages.encode("Status", 1, {}))
        else:
            comparison.node_says(t_ms * MS, messages.encode("Hold", 1, {"Reason": "BOX_SILENT"}))
    comparison.finish(590 * MS)
    found = {(each.message, each.field): each for each in comparison.differences}
    assert {message for message, _ in found} == {"Status", "Hold"}
    silent = found["Status", "Code"]
    assert (silent.logged, silent.said) == ("OK", None)
    assert silent.from_s == pytest.approx(0.35)  # 290 ms were heard, 50 ms are allowed
    hold = found["Hold", "Reason"]
    assert (hold.logged, hold.said, hold.frames) == (
        None,
        "BOX_SILENT",
        25,
    )  # up to 540 ms: what follows 590 nobody knows


def test_a_position_between_those_of_the_window_is_right():
    """At 10 mm/s the axis goes 100 counts between two frames; the node's clock runs 3 ms late."""
    messages = MessageSet.load()
    comparison = ReplayComparison([Kind.POSITION], tolerance_ps=50 * MS)
    for t_ms in range(0, 600, 10):
        comparison.log_says(t_ms * MS, messages.encode("Position", 1, {"Position": 10 * t_ms}))
        comparison.node_says((t_ms + 3) * MS, messages.encode("Position", 1, {"Position": 10 * t_ms}))
    comparison.finish(590 * MS)
    assert not comparison.differences


@pytest.mark.parametrize(("held", "differs"), [(True, False), (False, True)])
def test_a_hold_may_stop_the_axis_a_little_further(held, differs):
    """At 10 counts a millisecond, a hold that comes 20 ms later stops the axis 200 counts further, for ever."""
    messages = MessageSet.load()
    comparison = ReplayComparison([Kind.POSITION, Kind.STATUS], tolerance_ps=50 * MS)
    for t_ms in range(0, 900, 10):
        for say, end_ms in ((comparison.log_says, 300), (comparison.node_says, 320)):
            state = {"HoldWanted": 1, "State": "FATAL"} if held and t_ms >= end_ms else {"State": "RUNNING"}
            say(t_ms * MS, messages.encode("Position", 1, {"Position": 10 * min(t_ms, end_ms)}))
            say(t_ms * MS, messages.encode("Status", 1, state))
    comparison.finish(890 * MS)
    assert bool(comparison.differences) == differs
