"""Box and PC as nodes with a hostile bus between them: whatever happens, counts are right or somebody says why not.

The box is held to a plain model of what it may believe, its insertions to a decoder of the lines on both of its
sides, and the two together to liveness: once all is calm, they agree, or one of them has stopped and says why.
"""

import heapq
import itertools
import random

import pytest
from hypothesis import HealthCheck, Phase, settings, strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from node_oracle import ENABLE, EXPECTED, HOLD, REQUEST, BoxRules, Decoder, Request, is_right, sealed

from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.link.frame import Frame
from rtec.machine.faults import FaultKind
from rtec.machine.station import Alarm, Station, StationSettings
from rtec.predictors import UnidirectionalTable
from rtec.requester.pc_node import PcNode
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.status import BoxState, Status
from rtec.requester.supervision import HoldReason, SupervisionLimits

US, MS = 10**6, 10**9
FRAME_PS = 270 * US
AXIS = 1
KEPT = 32
FATAL = {
    Status.I_STILL_DONT_BELIEVE_YOU, Status.LINK_LOST, Status.HELD, Status.AXIS_TAKEN, Status.IMPLAUSIBLE,
    Status.ENCODER_FAULT, Status.SETUP_DIFFERS, Status.DRIVE_STOPPED,
}  # fmt: skip


def table(slope_um_mm, offset_um):
    """Return a predictor whose error grows along the axis."""
    errors = [(offset_um + slope_um_mm * x) / 1000.0 for x in (-30.0, 30.0)]
    return UnidirectionalTable(positions_mm=[-30.0, 30.0], errors_mm=errors, backlash_mm=0.0)


class Weather:
    """What a bus does to frames: each may be lost, late, doubled or spoiled, all by one seed."""

    def __init__(self, seed=0, lost=0.0, late=0.0, doubled=0.0, spoiled=0.0, most_late_ms=1):
        self.draw = random.Random(seed)  # noqa: S311 - draws, no secrets
        self.lost, self.late, self.doubled, self.spoiled, self.most_late_ms = (
            lost,
            late,
            doubled,
            spoiled,
            most_late_ms,
        )

    def passes(self, frame):
        """Yield delay and frame for each time that it arrives."""
        draw = self.draw
        if draw.random() < self.lost:
            return
        data = frame.data
        if draw.random() < self.spoiled:
            word = int.from_bytes(data, "little")
            for bit in draw.sample(range(64), draw.randint(1, 3)):
                word ^= 1 << bit
            data = word.to_bytes(8, "little")
        for _ in range(2 if draw.random() < self.doubled else 1):
            late = draw.randint(1, self.most_late_ms * 1000) * US if draw.random() < self.late else 0
            yield FRAME_PS + late, Frame(identifier=frame.identifier, data=data)


CALM = Weather()


class Arena:
    """A station and a PC on one clock, the frames between them, and the models beside them."""

    def __init__(self, *, design, window, grace, completion_timeout_ms, limit_steps, slope, offset):
        self.settings = StationSettings(
            axis=AXIS,
            injector=InjectorSettings(
                design=design, timing=Timing.of(design, Processor.MCS51), real_edges=RealEdges.HOLD
            ),
            handshake=HandshakeSettings(window_steps=window, grace_readings=grace),
            supervision=SupervisionLimits(completion_timeout_ps=completion_timeout_ms * MS, limit_steps=limit_steps),
        )
        self.station = Station(self.settings)
        self.station._state.keeps = 1
        self.predictor = table(slope, offset)
        self.serial = itertools.count()
        self.air = []
        self.heard = []  # every frame that was ever on the bus
        self.t_ps = 0
        limit = limit_steps or design.word_limit
        self.rules = BoxRules(axis=AXIS, session=1, watchdog_ps=50 * MS, window=window, grace=grace, limit=limit)
        setup = list(Design).index(design) | 10_000 << 4 | design.step_counts * 10_000 << 24
        self.rules.setup = setup.to_bytes(6, "little")
        self.before = self.after = None
        self.seen = 0
        self.read_lines()
        self.pc = None
        self.new_pc(0, acknowledge=False)

    def new_pc(self, first_sequence, *, acknowledge):
        self.pc = PcNode(
            self.settings.handshake,
            self.settings.supervision,
            axis=AXIS,
            predictor=self.predictor,
            count_mm=self.settings.encoder.count_mm,
            step_counts=self.settings.injector.design.step_counts,
            word_limit=self.settings.injector.design.word_limit,
            start_ps=self.t_ps + 3 * MS,
            first_sequence=first_sequence,
            setup=self.settings.setup,
        )
        if acknowledge:
            self.pc.acknowledge()

    def run(self, duration_ps, weather=CALM):
        end_ps = self.t_ps + duration_ps
        while self.t_ps < end_ps:
            pc_ps = self.pc.due_ps if self.pc else end_ps
            air_ps = self.air[0][0] if self.air else end_ps
            next_ps = max(self.t_ps, min(pc_ps, air_ps, end_ps, self.t_ps + MS))
            self.advance(next_ps, weather)
            while self.air and self.air[0][0] <= self.t_ps:
                at_ps, _, to_box, frame = heapq.heappop(self.air)
                if to_box:
                    self.to_box(frame)
                elif self.pc:
                    self.pc.receive(frame, at_ps=at_ps)
            if self.pc and self.pc.due_ps <= self.t_ps < end_ps:
                for frame in self.pc.turn(at_ps=self.t_ps):
                    self.check_frame(frame)
                    self.put(frame, self.t_ps, weather, to_box=True)

    def advance(self, until_ps, weather):
        station = self.station
        if until_ps <= station.now_ps:
            self.t_ps = max(self.t_ps, until_ps)
            return
        due_ps, homed = station.due_ps, False
        sent = station.advance(until_ps=until_ps)
        while due_ps < until_ps:
            was, state = self.rules.state, station._state
            if 0 < state.triggered_ps <= due_ps:  # a switch that waited for an insertion
                self.rules.switch_on = bool(state.node.box.switch_on)
            # where it was at each of several readings is not kept: one that has homed was at home
            at_home = bool(state.node.at_home) or BoxState(int(state.node.box.state)) is not BoxState.NOT_HOMED
            stopped = bool(state.alarm) and state.alarm_ps < due_ps
            self.rules.tick(due_ps, at_home=at_home, stopped=stopped)
            homed = homed or (was == "NOT_HOMED" and self.rules.state == "RUNNING")
            due_ps += MS
        self.t_ps = until_ps
        for t_ps, frame in sent:
            self.put(frame, t_ps, weather, to_box=False)
        self.read_lines()
        if homed:  # every counter is zeroed at home, the controller's too, and nothing is inserted in this reading
            self.after.count = self.before.count

    def put(self, frame, t_ps, weather, *, to_box):
        self.heard.append(frame)
        for delay_ps, passed in weather.passes(frame):
            heapq.heappush(self.air, (t_ps + delay_ps, next(self.serial), to_box, passed))

    def to_box(self, frame):
        at_home = bool(self.station._state.node.at_home)
        self.rules.hear(self.t_ps, frame.identifier, frame.data, at_home=at_home)
        self.station.receive(frame)

    def check_frame(self, frame):
        """The PC never asks for more than the window beyond what it knows to be accepted, unless it says so."""
        if frame.identifier & ~0xF != REQUEST:
            return
        request, view = Request.of(frame.data), self.pc.view
        assert is_right(frame.identifier, frame.data)
        if request.flags & ENABLE:
            assert view.state is PcState.ACTIVE
            assert request.flags & 1 or abs(request.total - view.accepted) <= self.settings.handshake.window_steps

    # ------------------------------------------------------------------ lines

    def read_lines(self):
        """Decode what the lines on both sides have done, change by change."""
        state = self.station._state
        kept = int(state.kept)
        if self.before is None or kept - self.seen > KEPT:
            view = self.station.view
            self.before = Decoder(view.lines, view.position)
            # more has happened at once than is kept; the controller's own decoder is held to the sum in the end
            self.after = Decoder(view.lines_out, view.position + view.inserted_counts)
        else:
            for k in range(self.seen, kept):
                self.before.see(int(state.kept_rows[k % KEPT, 1]))
                self.after.see(int(state.kept_rows[k % KEPT, 2]))
        self.seen = kept


class Nodes(RuleBasedStateMachine):
    """Everything that a bus, an operator or a power line can do to a box and a PC."""

    @initialize(
        design=st.sampled_from(list(Design)),
        window=st.integers(1, 4),
        grace=st.integers(0, 2),
        completion_timeout_ms=st.sampled_from([0, 300]),
        limit_steps=st.sampled_from([0, 0, 20]),
        slope=st.sampled_from([0.0, 2.0, -5.0]),
        offset=st.sampled_from([0, 3, -40]),
        begin_ms=st.integers(0, 60),
    )
    def begin(self, begin_ms, **options):
        self.arena = Arena(**options)
        self.probing = False
        self.arena.run(begin_ms * MS)

    @rule(time_ms=st.integers(1, 60))
    def calm(self, time_ms):
        self.arena.run(time_ms * MS)

    @rule(
        time_ms=st.integers(5, 80),
        seed=st.integers(0, 1 << 20),
        lost=st.sampled_from([0.0, 0.2, 0.8]),
        late=st.sampled_from([0.0, 0.3]),
        doubled=st.sampled_from([0.0, 0.3]),
        spoiled=st.sampled_from([0.0, 0.3]),
        most_late_ms=st.sampled_from([1, 20, 200]),
    )
    def storm(self, time_ms, **weather):
        self.arena.run(time_ms * MS, Weather(**weather))

    @rule(which=st.integers(0, 1 << 16), to_box=st.booleans())
    def replay(self, which, to_box):
        arena = self.arena
        known = [f for f in arena.heard if (f.identifier & ~0xF in (EXPECTED, REQUEST, HOLD)) == to_box]
        if known:
            self.hand(known[-1 - which % min(len(known), 300)], to_box)

    @rule(
        ahead=st.sampled_from([1, 1, 1, 1, 2, 6, 7, 0, -1]),
        way=st.sampled_from([-1, 1]),
        beyond=st.sampled_from([-1, 0, 1, 1, 2, 100]),
        flags=st.sampled_from([8, 8, 8, 8, 9, 9, 0, 10, 4, 16]),
        requester=st.sampled_from([1, 1, 1, 1, 2]),
        agrees=st.sampled_from([True, True, True, False]),
        after_ms=st.integers(0, 4),
    )
    def forge_request(self, ahead, way, beyond, flags, requester, agrees, after_ms):
        """A frame with a right checksum that no PC has sent: the rules say whether it is believed."""
        rules = self.arena.rules
        by = way * (rules.window + beyond)
        request = Request(((rules.last or 0) + ahead) % 256, rules.accepted + by, flags, requester, rules.session)
        data = request.packed(AXIS)
        if not agrees:
            data = sealed(REQUEST + AXIS, bytes([0, data[1], data[2] ^ 2, *data[3:]]))
        self.hand(Frame(identifier=REQUEST + AXIS, data=data), True)
        self.arena.run(after_ms * MS)

    @rule(
        identifier=st.sampled_from([0x080, 0x101, 0x141, 0x181, 0x281, 0x301, 0x381, 0x201]),
        body=st.binary(min_size=8, max_size=8),
    )
    def forge_anything(self, identifier, body):
        for to_box in (True, False):
            self.hand(Frame(identifier=identifier, data=sealed(identifier, body)), to_box)
        self.arena.run(2 * MS)

    def hand(self, frame, to_box):
        if to_box:
            self.arena.to_box(frame)
        elif self.arena.pc:
            self.arena.pc.receive(frame, at_ps=self.arena.t_ps)

    @rule()
    def restart_box(self):
        arena = self.arena
        if arena.rules.powered:
            arena.station.restart()
            arena.rules.start(arena.t_ps, arena.rules.session + 1)
            self.power_gone()

    @rule(on=st.booleans())
    def power(self, on):
        arena = self.arena
        if on != arena.rules.powered:
            arena.station.power(on)
            arena.rules.powered = on
            if on:
                arena.rules.start(arena.t_ps, arena.rules.session + 1)
            self.power_gone()

    def power_gone(self):
        """Read the lines anew: what power does to them is no change that is kept.

        An insertion may have been cut off: counts are compared again from the next homing on.
        """
        self.arena.before = None
        self.arena.read_lines()

    @rule()
    def kill_pc(self):
        self.arena.pc = None

    @rule(first_sequence=st.integers(0, 255), follows=st.booleans(), acknowledge=st.booleans())
    def restart_pc(self, first_sequence, follows, acknowledge):
        last = self.arena.rules.last
        self.arena.new_pc(last if follows and last is not None else first_sequence, acknowledge=acknowledge)
        self.probing = False

    @rule(on=st.booleans())
    def switch(self, on):
        self.arena.station.switch(on)
        self.arena.rules.switch_on = on

    @rule(on=st.booleans())
    def probe(self, on):
        if self.arena.pc:
            self.arena.pc.probe(on)
            self.probing = on
        self.arena.station.trip()

    @rule()
    def allow_large_correction(self):
        if self.arena.pc:
            self.arena.pc.allow_large_correction()

    @rule(slope=st.sampled_from([0.0, 1.0, 8.0]), offset=st.sampled_from([0, 10, -60]))
    def predict_otherwise(self, slope, offset):
        self.arena.predictor = table(slope, offset)
        if self.arena.pc:
            self.arena.pc.predict_by(self.arena.predictor)

    @rule(target_mm=st.sampled_from([-2.0, 0.0, 0.37, 4.0]), speed_mm_s=st.sampled_from([1.0, 8.0]))
    def go(self, target_mm, speed_mm_s):
        self.arena.station.go(target_mm, speed_mm_s)

    @rule()
    def go_home(self):
        self.arena.station.go_home()
        self.arena.run(50 * MS)

    @precondition(lambda self: self.arena.rules.state != "RUNNING" or not self.arena.pc)
    @rule(first_sequence=st.integers(0, 255), then_ms=st.integers(0, 30))
    def operator(self, first_sequence, then_ms):
        """Power on, switch on, back to home, acknowledge: the way out of whatever has happened."""
        self.power(True)
        self.switch(True)
        self.kill_pc()
        self.arena.run(60 * MS)
        self.arena.station.go_home()
        self.arena.run(500 * MS)
        self.restart_pc(first_sequence, follows=False, acknowledge=True)
        self.arena.run((80 + then_ms) * MS)
        rules = self.arena.rules
        if (rules.limit, rules.reason) == (20, "IMPLAUSIBLE"):
            return  # the prediction asks for more than the box's limit
        assert rules.state == "RUNNING"
        assert self.arena.pc.view.state is PcState.ACTIVE

    @rule()
    def while_inserting(self):
        """The switch is thrown at the first insertion, and closed again."""
        station = self.arena.station
        station.begin(FaultKind.SWITCH_THROWN, while_inserting=True)
        self.arena.run(10 * MS)
        self.arena.rules.switch_on = bool(station._state.node.box.switch_on)
        station.end(FaultKind.SWITCH_THROWN)
        self.arena.station.switch(True)
        self.arena.rules.switch_on = True

    # ------------------------------------------------------------------ laws

    @invariant()
    def the_box_believes_what_the_rules_allow(self):
        if not hasattr(self, "arena"):
            return
        rules, view = self.arena.rules, self.arena.station.view
        if not rules.powered:
            return
        assert view.box_state.name == rules.state
        if rules.state == "FATAL":
            assert view.status.name == rules.reason
        if rules.state == "RUNNING":
            assert view.requested == rules.accepted
            # what is inserted never leaves the way between totals that were believed
            assert rules.range[0] <= view.completed <= rules.range[1]

    @invariant()
    def what_is_completed_is_on_the_lines(self):
        if not hasattr(self, "arena"):
            return
        arena = self.arena
        view = arena.station.view
        assert arena.before.count == view.position
        if arena.rules.state != "RUNNING" or not arena.rules.powered:
            return  # Design B without power passes nothing on; home zeroes the counters again
        step = view.step_counts
        ahead = arena.after.count - arena.before.count
        # an insertion that is under way has changed the lines by less than a step or passes three states around
        assert abs(ahead - step * view.completed) <= 4, (ahead, view.completed)
        assert abs(view.inserted_counts - step * view.completed) <= 4

    @invariant()
    def who_holds_says_why(self):
        if not hasattr(self, "arena"):
            return
        if self.arena.pc:
            view = self.arena.pc.view
            assert (view.state is PcState.HOLD) == (view.reason is not HoldReason.NONE)

    def teardown(self):
        if not hasattr(self, "arena"):
            return
        self.come_to_rest()

    def come_to_rest(self):
        """The disturbance ends: the axis stops, the bus is calm, the operator does nothing more."""
        arena = self.arena
        if arena.pc and self.probing:
            arena.pc.probe(False)
        target_mm = arena.station.view.position / 1000
        arena.station.go(target_mm, 8.0)
        arena.run(1500 * MS)
        self.the_box_believes_what_the_rules_allow()
        self.what_is_completed_is_on_the_lines()
        self.who_holds_says_why()
        box = arena.station.view
        if box.powered and box.box_state is BoxState.RUNNING:
            arena.station.settle()
            arena.read_lines()
            settled = arena.station.view
            assert arena.after.count - arena.before.count == settled.step_counts * settled.completed
            assert settled.controller_count == arena.after.count
            assert settled.inserted_counts == settled.step_counts * settled.completed
        if not box.powered or box.box_state is BoxState.FATAL:
            assert not box.powered or box.status in FATAL
            if arena.pc:
                pc = arena.pc.view
                assert pc.state is PcState.HOLD or pc.state is PcState.WAITING
            return
        if box.box_state is BoxState.NOT_HOMED:
            assert box.status is Status.NOT_HOMED
            at_home = arena.station._state.node.at_home
            assert not at_home or arena.pc is None or arena.pc.view.state is PcState.HOLD
            return
        # the box runs
        assert arena.pc is not None  # else the watchdog would have stopped it
        pc = arena.pc.view
        assert pc.state is PcState.ACTIVE
        assert pc.requested == pc.accepted == box.requested
        assert pc.completed == box.completed
        if box.alarm is Alarm.NONE and box.switch_on:
            assert pc.position == box.position
            assert box.requested == pc.target
            wanted = float(arena.predictor.error_mm(pc.position / 1000, pc.direction)) * 1000 / box.step_counts
            assert abs(pc.target - wanted) <= 0.5 + arena.settings.handshake.rounding_margin + 1e-9
            original_waits = self.arena.settings.injector.design is Design.ORIGINAL and box.lines != 0
            assert box.completed == box.requested or original_waits


def play(examples, steps):
    run_state_machine_as_test(
        Nodes,
        settings=settings(
            max_examples=examples,
            stateful_step_count=steps,
            deadline=None,
            suppress_health_check=list(HealthCheck),
            phases=(Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink),
        ),
    )


def test_nothing_between_them_makes_counts_wrong_or_leaves_them_silent():
    play(12, 20)


@pytest.mark.sweep
def test_nothing_at_all_makes_counts_wrong_or_leaves_them_silent():
    play(500, 60)
