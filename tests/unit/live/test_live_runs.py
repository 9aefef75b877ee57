"""Whole runs of box and PC: orders, start-up, the reasons to end, and the words for them."""

import json

import pytest

from rtec.live.box_run import BoxRun, box_document
from rtec.live.events import Events
from rtec.live.pc_run import PcRun, pc_document
from rtec.live.shown import box_screen, pc_screen
from rtec.machine.faults import FaultKind
from rtec.requester.settings import PcState
from rtec.requester.setup import Setup
from rtec.requester.status import BoxState, Status


class Stop:
    why = None


class Typed:
    """Lines that are typed at times of the bus' clock."""

    def __init__(self, clock, lines):
        self.clock, self.lines = clock, list(lines)

    def take(self, most):
        due = [text for at_s, text in self.lines if at_s * 1e12 <= self.clock.now_ps][:most]
        self.lines = self.lines[len(due) :]
        return due


class Stepper:
    """A loop whose step lets the other side go on, too."""

    def __init__(self, loop, pair):
        self._loop, self._pair = loop, pair

    def __getattr__(self, name):
        return getattr(self._loop, name)

    def step(self):
        if self._loop.lost is None:
            self._pair.step()
        else:
            self._loop.step()


def texts(events):
    return [(event.axis, event.text) for event in events.all]


def box_run(pair, typed=(), **options):
    events = Events(lambda event: None)
    run = BoxRun(
        Stepper(pair.box, pair), events=events, stop=Stop(), typed=Typed(pair.clock, typed), until_s=20.0, **options
    )
    return run.run(), events


def pc_run(pair, stop=None, **options):
    events = Events(lambda event: None)
    options = {"until_s": 20.0} | options
    return PcRun(Stepper(pair.pc, pair), events=events, stop=stop or Stop(), **options).run(), events


def test_orders_move_the_axis_and_end_the_run(together):
    pair = together()
    ended, events = box_run(
        pair, [(0.2, "go 5 mm at 20 mm/s"), (0.2, "wait 2 s"), (0.2, "status"), (0.2, "quit"), (0.3, "nonsense")]
    )
    assert ended == "quit"
    assert pair.box.stations[0].view.position_mm == pytest.approx(5.0 - 0.012, abs=0.002)
    told = dict(texts(events)[::-1])
    status = next(text for axis, text in texts(events) if axis == 1 and "requested 3, completed 3" in text)
    assert status.startswith("+4.98")
    assert "order: quit" in told.values() or any(text == "order: quit" for _, text in texts(events))


def test_a_fault_is_told_in_words(together):
    pair = together()
    _, events = box_run(pair, [(0.3, "go 40 mm"), (1.0, "fault lines-swapped"), (2.0, "quit")])
    assert any(axis == 1 and "the controller stopped the drive" in text for axis, text in texts(events))


def test_an_axis_taken_home_says_what_it_waits_for(together):
    pair = together()
    _, events = box_run(pair, [(0.3, "go 5 mm"), (0.5, "home"), (8.0, "quit")])
    assert (1, "the move was interrupted and is forgotten: order it again") in texts(events)
    assert pair.box.stations[0].view.position_mm == pytest.approx(0.0, abs=0.001)
    assert texts(events)[-2][1].endswith("taken home, where it stays until a PC starts up anew (rtec pc --reset)")


def test_switch_thrown_ends_in_hold_with_its_reason(together):
    pair = together()
    pair.run(0.3)
    pair.box.stations[0].switch(False)
    ending, _ = pc_run(pair)
    assert (ending.why, ending.good) == ("held", False)
    assert "CORRECTIONS_DISABLED: the box's switch forbids corrections" in ending.text


def test_two_sides_set_up_differently_both_say_what_each_has(together):
    pair = together(setup=Setup(design="c", step_mm=0.002, cycle_ps=10**10))
    ending, _ = pc_run(pair)
    assert ending.why == "held"
    assert ending.text == (
        "axis 1: the machine is held: SETUP_DIFFERS: the box has design a, step 4 µm, cycle 10 ms; this PC is set up "
        "for design c, step 2 µm, cycle 10 ms: start both with the same --design"
    )
    assert pair.box.stations[0].view.box_state is BoxState.NOT_HOMED
    _, events = box_run(pair, [(0.0, "quit")])
    assert texts(events)[-1][1] == (
        "the PC on the bus is set up for design c, step 2 µm, cycle 10 ms; this box has design a, step 4 µm, cycle "
        "10 ms: start both with the same --design"
    )


def test_a_drive_that_was_stopped_ends_in_hold_with_its_reason(together):
    pair = together()
    pair.run(0.3)
    pair.box.stations[0].begin(FaultKind.LINES_SWAPPED)
    pair.box.stations[0].go(30.0, 20.0)
    ending, events = pc_run(pair)
    assert ending.why == "held"
    assert "DRIVE_STOPPED: the controller has stopped the drive" in ending.text
    assert "active" not in texts(events)[-1][1]


def test_held_pc_goes_on_saying_so_then_ends(together):
    pair = together()
    pair.run(0.3)
    pair.box.stations[0].restart()
    begin_ps = pair.clock.now_ps
    ending, _ = pc_run(pair)
    holds = [at_ps for at_ps, frame in pair.far.sent if frame.identifier == 0x080]
    assert "BOX_RESTARTED" in ending.text
    assert len(holds) == pytest.approx(100, abs=5)
    assert pair.clock.now_ps - begin_ps == pytest.approx(1.0e12, abs=0.1e12)


def test_nobody_answers(together):
    pair = together()
    pair.box_lives = False
    ending, _ = pc_run(pair, start_up_s=2.0)
    assert (ending.why, ending.good) == ("nobody answers", False)
    assert "not ready after 2 s" in ending.text and "nothing at all was heard" in ending.text
    assert pair.clock.now_ps == pytest.approx(2.0e12, abs=0.1e12)


def test_another_axis_answers(together):
    pair = together(axes=(2,))
    from rtec.live.pc_loop import PcLoop

    pair.pc = PcLoop(together(axes=(1,)).pc.nodes, pair.far)
    ending, _ = pc_run(pair, start_up_s=1.0)
    assert "there is a box with axis 2: is --axis right?" in ending.text


def test_only_frames_of_others(together):
    from rtec.link.frame import Frame

    pair = together()
    pair.box_lives = False
    for at_ms in range(10):
        pair.far.put(Frame(identifier=0x7DF, data=bytes(8)), at_ps=at_ms * 10**10)
    ending, _ = pc_run(pair, start_up_s=1.0)
    assert "10 frames of others were heard, none of a box" in ending.text


def test_a_box_that_has_stopped_needs_the_operator(together):
    pair = together()
    pair.run(0.3)
    pair.pc_lives = False
    pair.run(0.2)
    assert pair.box.stations[0].view.box_state is BoxState.FATAL
    pair.far.inbox.clear()
    from rtec.live.pc_loop import PcLoop

    pair.pc, pair.pc_lives = PcLoop(together().pc.nodes, pair.far), True
    ending, _ = pc_run(pair)
    assert ending.why == "box stopped"
    assert "no valid request from the PC" in ending.text and "--reset" in ending.text
    pair.pc = PcLoop(together().pc.nodes, pair.far)
    pair.pc.nodes[0].acknowledge()
    pair.box.stations[0].go_home()
    ending, _ = pc_run(pair, acknowledged=True, until_s=pair.clock.now_ps / 1e12 + 3.0)
    assert ending.good
    assert pair.pc.nodes[0].view.completed == 3


def test_a_bus_that_vanishes_holds_the_machine_on_both_sides(together):
    pair = together()
    pair.run(0.3)
    pair.near.gone = pair.far.gone = True
    ending, events = pc_run(pair)
    assert "BUS_OFF" in ending.text
    assert any("fake cable: has vanished" in text for _, text in texts(events))
    pair.pc_lives = False
    ended, events = box_run(pair)
    assert ended == "bus lost"
    assert pair.box.stations[0].view.status is Status.LINK_LOST
    assert pair.box.stations[0].view.held
    assert any("stopped for good, hold contact open" in text for _, text in texts(events))


def test_the_line_of_a_box_that_ends_is_a_silent_box(together):
    pair = together()
    pair.run(0.3)
    pair.far.gone = True
    ending, events = pc_run(pair, line_of_box=True)
    assert "BOX_SILENT" in ending.text
    assert any("the box's program has ended" in text for _, text in texts(events))


def test_reports_and_views_are_plain(together):
    pair = together()
    pair.box.stations[0].keep_insertions()
    _, events = box_run(pair, [(1.0, "quit")])
    report = json.loads(json.dumps(box_document(pair.box, events, ended="quit", run_s=1.0)))
    assert report["axes"][0]["completed"] == 3 and report["axes"][0]["inserted_counts"] == 12
    axis = report["axes"][0]
    assert (axis["encoder_counts"], axis["controller_counts"], axis["audit"]) == (-12, 0, True)
    assert report["axes"][0]["setup"] == "design a, step 4 µm, cycle 10 ms"
    shown = json.loads(json.dumps(box_screen(pair.box, events, title="t", at_s=1.0)))
    # Design A at rest: four changes of the box's own for each of three insertions
    assert len(shown["axes"][0]["insertion"]) >= 12
    ending, events = pc_run(pair, until_s=pair.clock.now_ps / 1e12 + 0.1)
    report = json.loads(json.dumps(pc_document(pair.pc, events, ending=ending, run_s=1.0)))
    assert report["handshake"]["number"] == 1
    assert (report["axes"][0]["setup"], report["axes"][0]["box_setup"]) == (None, "design a, step 4 µm, cycle 10 ms")
    shown = json.loads(json.dumps(pc_screen(pair.pc, events, count_mm=0.001, title="t", at_s=1.0)))
    assert shown["axes"][0]["cells"]["completed"] == "+3 steps"
    assert pair.pc.nodes[0].view.state is PcState.HOLD
