"""Random and mutated frames into each node: nothing is believed that a plain model forbids, and nothing breaks.

Valid frames, valid frames with bits flipped, right checksums on such and on random contents, replays, frames of
others: as many as are asked for, by one seed. The nodes are driven through their kernels, frame by frame.
"""

import random

import numpy as np
import pytest
from crc_oracle import frame_checksum as checksum_bit_by_bit
from node_oracle import (
    CORRECTIONS,
    ENABLE,
    EXPECTED,
    GO_HOME,
    HOLD,
    LARGE,
    POSITION,
    PROBE,
    PROBING,
    REQUEST,
    RESET,
    SETUP,
    SETUP_A,
    STATUS,
    BoxRules,
    PcRules,
    Request,
    frame_checksum,
    is_right,
    sealed,
    signed,
)  # fmt: skip

from rtec.injector import Design
from rtec.machine import _station_kernels
from rtec.machine.station import Station, StationSettings
from rtec.predictors import UnidirectionalTable
from rtec.predictors.binding import bound
from rtec.requester import _pc_node_kernels, _pc_turn_kernels
from rtec.requester.pc_node import PcNode
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.setup import Setup
from rtec.requester.status import Status
from rtec.requester.supervision import HoldReason, SupervisionLimits

MS = 10**9
AXIS = 1
WINDOW, GRACE, WATCHDOG_PS = 3, 2, 50 * MS
KINDS = (SETUP, EXPECTED, STATUS, REQUEST, CORRECTIONS, POSITION, PROBE)
CI, LONG = 20_000, 1_000_000


def field(record, *names):
    """Return one number of a state as an array without a dimension, which follows it."""
    offset, dtype = 0, record.dtype
    for name in names:
        dtype, more = dtype.fields[name][:2]
        offset += more
    return np.ndarray((), dtype=dtype, buffer=record, offset=offset)


def number(data):
    return signed(data)


class Mutator:
    """Spoils frames by one seed."""

    def __init__(self, seed):
        self.draw = random.Random(seed)  # noqa: S311 - draws, no secrets
        self.seen = [(REQUEST + AXIS, bytes(8))]

    def flipped(self, data):
        word = int.from_bytes(data, "little")
        for _ in range(self.draw.randint(1, 6)):
            word ^= 1 << self.draw.randrange(64)
        return word.to_bytes(8, "little")

    def spoil(self, identifier, data):  # noqa: PLR0911 - a way each
        """Return a frame that is anything but what was to be sent."""
        draw = self.draw
        way = draw.randrange(8)
        if way <= 1:
            return identifier, self.flipped(data)
        if way == 2:
            return identifier, sealed(identifier, self.flipped(data))
        if way == 3:
            return identifier, sealed(identifier, draw.randbytes(8))
        if way == 4:
            return draw.choice(self.seen)
        if way == 5:
            return draw.randrange(0x800), data
        if way == 6:
            known = draw.random() < 0.1
            identifier = draw.choice((HOLD, *(kind + AXIS for kind in KINDS))) if known else draw.randrange(0x800)
            return identifier, sealed(identifier, data) if draw.random() < 0.3 else draw.randbytes(8)
        return identifier, draw.randbytes(8)

    def remember(self, identifier, data):
        if len(self.seen) < 500:
            self.seen.append((identifier, data))
        else:
            self.seen[self.draw.randrange(500)] = (identifier, data)


def test_the_quick_checksum_is_that_of_the_division():
    draw = random.Random(0)  # noqa: S311 - draws, no secrets
    for _ in range(200):
        identifier, data = draw.randrange(0x800), draw.randbytes(8)
        assert frame_checksum(identifier, data) == checksum_bit_by_bit(identifier, data)


class BoxUnderFire:
    """A box that stands at home, and the model beside it."""

    def __init__(self, design, seed):
        handshake = HandshakeSettings(window_steps=WINDOW, grace_readings=GRACE)
        self.station = Station(StationSettings(axis=AXIS, handshake=handshake))
        self.state = self.station._state
        self.limit = Design.A.word_limit
        self.rules = BoxRules(
            axis=AXIS, session=1, watchdog_ps=WATCHDOG_PS, window=WINDOW, grace=GRACE, limit=self.limit
        )
        self.rules.setup = SETUP_A
        box = ("node", "box")
        self.box_state = field(self.state, *box, "state")
        self.accepted = field(self.state, *box, "accepted")
        self.status = field(self.state, *box, "status")
        self.next_ps = field(self.state, *box, "next_ps")
        self.doubts = field(self.state, *box, "doubts")
        self.completed = field(self.state, "injector", "completed")
        self.at_home = field(self.state, "node", "at_home")
        self.waiting = field(self.state, "node", "out", "waiting")
        self.overrun = field(self.state, "node", "out", "overrun")
        self.out_identifier = field(self.state, "node", "out", "identifier")
        self.mutator = Mutator(seed)
        self.now_ps = 0
        self.believed = 0
        self.ends = set()

    def wait(self, duration_ps):
        """Let time pass: readings of the box, each compared with the model."""
        until_ps = self.now_ps + duration_ps
        while self.now_ps < until_ps:
            due_ps = int(self.next_ps)
            if due_ps >= until_ps:
                self.now_ps = until_ps
                return
            self.station._run(*self.station._axes.parts, self.station._axes.steps, due_ps + 1)
            self.now_ps = due_ps + 1
            self.rules.tick(due_ps, at_home=bool(self.at_home))
            if self.waiting:
                self.check_sent()
            self.compare()

    def compare(self):
        rules = self.rules
        name = ("NOT_HOMED", "RUNNING", "FATAL")[int(self.box_state)]
        accepted = int(self.accepted)
        assert name == rules.state
        if name == "RUNNING":
            assert accepted == rules.accepted
            assert rules.range[0] <= self.completed <= rules.range[1]
        elif name == "FATAL":
            assert Status(int(self.status)).name == rules.reason
            self.ends.add(rules.reason)
        assert abs(accepted) <= self.limit
        assert 0 <= self.doubts <= GRACE + 1
        assert self.overrun == 0

    def check_sent(self):
        """What the box says is sealed, and says what is."""
        out = self.state.node.out
        for k in range(int(self.waiting)):
            identifier, data = int(out.identifier[k]), int(out.payload[k]).to_bytes(8, "little", signed=True)
            assert identifier - AXIS in (SETUP, STATUS, CORRECTIONS, POSITION, PROBE)
            assert is_right(identifier, data)
            assert identifier - AXIS != SETUP or data[2:] == SETUP_A
            if identifier - AXIS == CORRECTIONS and self.rules.state == "RUNNING":
                assert signed(data[4:6]) == self.rules.accepted
        out.waiting = 0

    def hand(self, identifier, data):
        self.rules.hear(self.now_ps, identifier, data, at_home=bool(self.at_home))
        _station_kernels.receive(self.state, self.now_ps, identifier, number(data))

    def request(self):
        """Return what a PC might send now, and sometimes what it may not."""
        draw, rules = self.mutator.draw, self.rules
        sequence = ((rules.last or 0) + draw.choice((1, 1, 1, 1, 1, 1, 2, 6, 7, 0, -1))) % 256
        total, flags = rules.accepted, ENABLE
        if rules.state == "FATAL":
            flags = RESET
        elif rules.state == "NOT_HOMED":
            flags = GO_HOME
        else:
            total += draw.choice((0, 0, 0, 1, -1, 2, -2, 3, -3, 4, -4, 30, -30))
            flags |= draw.choice((0, 0, 0, 0, 0, 0, LARGE, PROBING))
            total = max(-self.limit - 1, min(self.limit + 1, total))
        requester = draw.choice((1, 1, 1, 1, 1, 1, 1, 2))
        return REQUEST + AXIS, Request(sequence, total, flags, requester, rules.session).packed(AXIS)

    def fire(self, frames):
        mutator, draw = self.mutator, self.mutator.draw
        for _ in range(frames):
            if self.rules.state == "NOT_HOMED" and not self.at_home:  # the corrections have moved it, as they should
                _station_kernels.go_home(self.state)
                self.wait(50 * MS)
            identifier, data = self.request()
            mutator.remember(identifier, data)
            if draw.random() < (0.7 if self.rules.state == "RUNNING" else 0.2):
                identifier, data = mutator.spoil(identifier, data)
            elif draw.random() < 0.002:
                identifier, data = HOLD, sealed(HOLD, draw.randbytes(8))
            elif draw.random() < 0.01:
                word = draw.choice((SETUP_A, SETUP_A, SETUP_A, bytes(6), draw.randbytes(6)))
                identifier, data = EXPECTED + AXIS, sealed(EXPECTED + AXIS, bytes([0, draw.randrange(256), *word]))
            before = self.rules.judged
            self.hand(identifier, data)
            if draw.random() < 0.3:
                self.wait(draw.randint(1, 4) * MS)
            self.believed += self.rules.judged - before


def test_the_box_believes_no_frame_that_it_must_not():
    box_under_fire(CI)


@pytest.mark.sweep
@pytest.mark.parametrize("seed", range(3))
def test_the_box_believes_none_of_a_million(seed):
    box_under_fire(LONG, seed)


def box_under_fire(frames, seed=7):
    box = BoxUnderFire(Design.A, seed)
    box.fire(frames)
    # it was no monologue: many were judged, and every way to stop was gone
    assert box.believed > frames / 50
    assert {"LINK_LOST", "HELD", "AXIS_TAKEN", "I_STILL_DONT_BELIEVE_YOU", "IMPLAUSIBLE", "SETUP_DIFFERS"} <= box.ends


class PcUnderFire:
    """A PC, a box that answers as it should, and frames between them that nobody should send."""

    def __init__(self, seed):
        self.mutator = Mutator(seed)
        self.now_ps = 0
        self.sequences = {SETUP: 0, STATUS: 0, CORRECTIONS: 0, POSITION: 0, PROBE: 0}
        self.session = 0
        self.starts = 0
        self.reasons = set()
        self.enabled = 0
        predictor = UnidirectionalTable(positions_mm=[-50.0, 50.0], errors_mm=[-0.4, 0.4], backlash_mm=0.012)
        self.model = bound(predictor)
        self.pc = PcNode(
            HandshakeSettings(window_steps=WINDOW), SupervisionLimits(), axis=AXIS, predictor=predictor,
            count_mm=0.001, step_counts=4, word_limit=100, setup=Setup(design="a", step_mm=0.004, cycle_ps=10 * MS),
        )  # fmt: skip
        self.node = self.pc._node
        self.state = field(self.node, "pc", "state")
        self.next_ps = field(self.node, "pc", "next_ps")
        self.reason = field(self.node, "reason")
        self.sent = field(self.node, "pc", "sent")
        self.doubts = field(self.node, "doubts")
        self.waiting = field(self.node, "out", "waiting")
        self.overrun = field(self.node, "out", "overrun")
        self.start()

    def start(self):
        """Switch PC and box on again, the box at home."""
        draw = self.mutator.draw
        _pc_node_kernels.pc_node_start(self.node, self.now_ps + MS, draw.randrange(256))
        self.session = (self.session + 1) % 256
        self.running = False
        self.accepted = 0
        self.position = 0
        self.last_sequence = None
        self.rules = PcRules(axis=AXIS)
        self.starts += 1
        self.turns = 0

    def frame(self, kind, body):
        self.sequences[kind] = (self.sequences[kind] + 1) % 256
        identifier = kind + AXIS
        return identifier, sealed(identifier, bytes([0, self.sequences[kind], *body]))

    def words(self):
        """Return the frames of a cycle of the box."""
        self.position += self.mutator.draw.randint(-40, 60) if self.running and self.turns > 4 else 0
        accepted = self.accepted.to_bytes(2, "little", signed=True)
        word = (self.running | (self.position & 0x7FFF) << 1).to_bytes(2, "little")
        return [
            *([] if self.running else [self.frame(SETUP, SETUP_A)]),
            self.frame(STATUS, [0 if self.running else 1, int(self.running) | 8, self.session, 0, 0, 0]),
            self.frame(CORRECTIONS, [*accepted, *accepted, self.session, self.last_sequence or 0]),
            self.frame(POSITION, [*self.position.to_bytes(4, "little", signed=True), *word]),
        ]

    def hand(self, identifier, data):
        self.rules.hear(identifier, data, waiting=self.state == PcState.WAITING)
        _pc_node_kernels.pc_receive(self.node, self.now_ps, identifier, number(data))

    def turn(self):
        self.now_ps = int(self.next_ps)
        before = int(self.state)
        _pc_turn_kernels.turn(self.node, self.now_ps, self.model)
        out = self.node.out
        for k in range(int(self.waiting)):
            identifier, data = int(out.identifier[k]), int(out.payload[k]).to_bytes(8, "little", signed=True)
            assert is_right(identifier, data)
            if identifier == HOLD:
                assert data[2] == self.reason
                assert HoldReason(data[2]) is not HoldReason.NONE
            elif identifier == EXPECTED + AXIS:
                assert data[2:] == SETUP_A
                assert self.state == PcState.WAITING or self.reason == HoldReason.SETUP_DIFFERS
            else:
                self.check_request(identifier, data)
        out.waiting = 0
        self.turns += 1
        assert self.state in (0, 1, 2)
        assert (self.state == PcState.HOLD) == (self.reason != HoldReason.NONE)
        assert before != PcState.HOLD or self.state == PcState.HOLD
        assert 0 <= self.doubts <= 3
        assert self.overrun == 0

    def check_request(self, identifier, data):
        assert identifier == REQUEST + AXIS
        request = Request.of(data)
        assert request.agrees
        assert request.requester == 1
        assert self.last_sequence is None or request.sequence == (self.last_sequence + 1) % 256
        self.last_sequence = request.sequence
        assert abs(request.total) <= 100
        if request.flags & ENABLE:
            self.enabled += 1
            assert self.state == PcState.ACTIVE
            assert request.session == self.rules.session
            assert not request.flags & LARGE  # nobody meant it
            assert abs(request.total - self.rules.accepted) <= WINDOW
            if request.session == self.session and self.running:
                self.accepted = request.total
        elif request.flags & GO_HOME and request.session == self.session and not self.running:
            self.running, self.position = True, 0

    def fire(self, frames):
        mutator, draw = self.mutator, self.mutator.draw
        fired = 0
        while fired < frames:
            for identifier, data in self.words():
                self.now_ps += MS
                mutator.remember(identifier, data)
                if draw.random() < 0.95:
                    self.hand(identifier, data)
                    fired += 1
                hostile = (0.3, 0.1, 0.02)[self.starts % 3]  # how many frames with a right checksum there are
                for _ in range(draw.randint(0, 6)):
                    spoiled = mutator.spoil(identifier, data)
                    if not is_right(*spoiled) or draw.random() < hostile:
                        self.hand(*spoiled)
                        fired += 1
            self.turn()
            if self.state == PcState.HOLD:
                self.reasons.add(HoldReason(int(self.reason)).name)
                self.turn()
                self.start()
            elif self.state == PcState.WAITING and self.turns > 60:
                self.start()


def test_the_pc_asks_for_nothing_that_it_must_not():
    pc_under_fire(2 * CI)


@pytest.mark.sweep
@pytest.mark.parametrize("seed", range(3))
def test_the_pc_asks_for_nothing_after_a_million(seed):
    pc_under_fire(LONG, seed)


def pc_under_fire(frames, seed=3):
    pc = PcUnderFire(seed)
    pc.fire(frames)
    assert pc.enabled > frames / 100
    assert {"ANOTHER_PC", "SETUP_DIFFERS", "BOX_RESTARTED", "COMPLETED_WRONG", "PREDICTOR_OUT_OF_RANGE"} <= pc.reasons
