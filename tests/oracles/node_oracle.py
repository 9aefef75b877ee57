"""A plain model of the box as a node of a bus: which frame it may accept, and what it may do about it.

From the words of NISTIR 4832, "General Considerations" (windows, Large Correction, probing, switch, start-up), and of
docs/messages.md (checksum, order, session, requester, watch). Times are in picoseconds. Nothing here imports rtec.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from crc_oracle import bits_of, remainder

HOLD, STATUS, REQUEST, CORRECTIONS, POSITION, PROBE = 0x080, 0x180, 0x200, 0x280, 0x300, 0x380
SETUP, EXPECTED = 0x100, 0x140
LARGE, PROBING, GO_HOME, ENABLE, RESET = 1, 2, 4, 8, 16
MOST_AHEAD = 6  # five frames may be missing

SETUP_A = (1 | 10_000 << 4 | 40_000 << 24).to_bytes(6, "little")
"""Design A, 10 ms, steps of 4 counts of 1 µm."""

STEPS_AROUND = [0b00, 0b01, 0b11, 0b10]
"""Levels A + 2 B in the positive direction: A leads B."""


TABLE = [remainder(bits_of(bytes([byte])), 8, 0x2F, 0) for byte in range(256)]
"""What a byte does to the checksum; byte by byte, so that a million frames do not take hours."""


def frame_checksum(identifier: int, data: bytes) -> int:
    crc = TABLE[TABLE[0xFF ^ (identifier & 0xFF)] ^ (identifier >> 8)]
    for byte in data[1:]:
        crc = TABLE[crc ^ byte]
    return crc ^ 0xFF


def is_right(identifier: int, data: bytes) -> bool:
    return data[0] == frame_checksum(identifier, data)


def sealed(identifier: int, data: bytes) -> bytes:
    return bytes([frame_checksum(identifier, data)]) + data[1:]


@dataclass(frozen=True)
class Request:
    """What a request says, byte by byte."""

    sequence: int
    total: int
    flags: int
    requester: int
    session: int
    agrees: bool = True

    @classmethod
    def of(cls, data: bytes) -> Request:
        total, inverse = data[2:4], data[4:6]
        return cls(
            sequence=data[1],
            total=int.from_bytes(total, "little", signed=True),
            flags=data[6] & 0x1F,
            requester=data[6] >> 5,
            session=data[7],
            agrees=all(a ^ b == 0xFF for a, b in zip(total, inverse, strict=True)),
        )

    def packed(self, axis: int) -> bytes:
        total = self.total.to_bytes(2, "little", signed=True)
        body = bytes([0, self.sequence, *total, *(byte ^ 0xFF for byte in total)])
        return sealed(REQUEST + axis, body + bytes([self.requester << 5 | self.flags, self.session]))


@dataclass
class BoxRules:
    """State of a box that keeps the rules, and its last reason to stop."""

    axis: int
    session: int
    watchdog_ps: int
    window: int = 3
    grace: int = 2
    limit: int = 127
    gap_ps: int = 2_000_000_000
    state: str = "NOT_HOMED"
    reason: str = ""
    accepted: int = 0
    doubts: int = 0
    switch_on: bool = True
    powered: bool = True
    requester: int | None = None
    last: int | None = None
    heard_ps: int = 0
    waiting: tuple[str, int, int] | None = None
    range: list[int] = field(default_factory=lambda: [0, 0])
    judged: int = 0
    judged_ps: int = -(1 << 62)
    large_spent: bool = False
    resets: int = 0
    setup: bytes = b""
    """Design, cycle and step as its message has them; none: it says nothing of them."""
    expected: tuple[int, bytes] | None = None

    def fail(self, reason: str) -> None:
        if self.state != "FATAL":
            self.state, self.reason = "FATAL", reason

    def start(self, t_ps: int, session: int) -> None:
        """Power on, or a restart of the processor: it knows nothing any more."""
        self.state, self.reason, self.session = "NOT_HOMED", "", session % 256
        self.accepted = self.doubts = 0
        self.last = self.waiting = self.expected = None
        self.heard_ps = t_ps
        self.judged_ps, self.large_spent, self.resets = -(1 << 62), False, 0

    def hear(self, t_ps: int, identifier: int, data: bytes, *, at_home: bool) -> None:
        if not self.powered:
            return
        right = is_right(identifier, data)
        if identifier == HOLD:
            if right and self.state == "RUNNING":
                self.fail("HELD")
            return
        if identifier & 0xF != self.axis or not right:
            return
        kind = identifier & ~0xF
        if kind in (SETUP, STATUS, CORRECTIONS, POSITION, PROBE):
            self.fail("AXIS_TAKEN")
        elif kind == EXPECTED:
            self.expected = (t_ps, data[2:])
            if self.differs(t_ps) and self.state == "NOT_HOMED":
                self.waiting = None
            elif self.differs(t_ps) and self.state == "RUNNING":
                self.fail("SETUP_DIFFERS")
        elif kind == REQUEST:
            self.take(t_ps, Request.of(data), at_home=at_home)

    def differs(self, t_ps: int) -> bool:
        """Whether the PC has said a short while ago that it expects another box."""
        if not self.setup or self.expected is None or self.expected[1] == bytes(6):
            return False
        return t_ps - self.expected[0] <= self.watchdog_ps and self.expected[1] != self.setup

    def take(self, t_ps: int, request: Request, *, at_home: bool) -> None:
        if request.session != self.session:
            return
        follows = self.last is None or 1 <= (request.sequence - self.last) % 256 <= MOST_AHEAD
        running = self.state == "RUNNING"
        if running and (not follows or request.requester != self.requester):
            return
        if not request.agrees:
            return
        self.last = request.sequence
        if self.state == "FATAL":
            self.acknowledge(t_ps, request, follows=follows)
        elif self.state == "NOT_HOMED":
            self.heard_ps = t_ps
            if request.flags & GO_HOME and at_home and not self.differs(t_ps):
                self.requester, self.waiting = request.requester, ("home", 0, 0)
        elif request.flags & ENABLE and not request.flags & GO_HOME:
            self.judge(t_ps, request)

    def acknowledge(self, t_ps: int, request: Request, *, follows: bool) -> None:
        """The second Reset in a row, and in order, is an operator's; one frame that strayed is none."""
        if not request.flags & RESET:
            self.resets = 0
        elif self.resets and follows:
            self.state, self.reason, self.accepted, self.doubts, self.waiting = "NOT_HOMED", "", 0, 0, None
            self.resets, self.heard_ps = 0, t_ps
        else:
            self.resets = 1

    def judge(self, t_ps: int, request: Request) -> None:
        """A total is asked for: it waits for the next reading, unless it comes too soon."""
        self.heard_ps = t_ps
        if t_ps - self.judged_ps < self.gap_ps:
            return
        self.judged_ps = t_ps
        flags = request.flags
        if not flags & LARGE:
            self.large_spent = False
        elif self.large_spent:
            flags &= ~LARGE
        if abs(request.total) > self.limit:
            self.fail("IMPLAUSIBLE")
        else:
            self.waiting = ("total", request.total, flags)

    def tick(self, t_ps: int, *, at_home: bool, stopped: bool = False) -> None:
        """Judge what has come since the last reading: the last word only, and only once; home only at home."""
        if not self.powered:
            return
        if self.state == "RUNNING" and t_ps - self.heard_ps > self.watchdog_ps:
            self.fail("LINK_LOST")
        if self.state == "RUNNING" and stopped:
            self.fail("DRIVE_STOPPED")
        word, self.waiting = self.waiting, None
        if word is not None and word[0] == "home" and not at_home:
            return
        if word is None or self.state == "FATAL":
            return
        what, total, flags = word
        if what == "home":
            if self.state == "NOT_HOMED":
                self.state, self.accepted, self.doubts, self.range = "RUNNING", 0, 0, [0, 0]
                self.large_spent = False
            return
        if self.state != "RUNNING" or flags & PROBING or not self.switch_on:
            return
        self.judged += 1
        if abs(total - self.accepted) <= self.window or flags & LARGE:
            self.large_spent = self.large_spent or abs(total - self.accepted) > self.window
            self.accepted, self.doubts = total, 0
            self.range = [min(self.range[0], total), max(self.range[1], total)]
        else:
            self.doubts += 1
            if self.doubts > self.grace:
                self.fail("I_STILL_DONT_BELIEVE_YOU")


@dataclass
class Decoder:
    """A quadrature decoder of four counts a cycle; a change of both lines at once is no count."""

    lines: int
    count: int = 0
    illegal: int = 0

    def see(self, lines: int) -> None:
        way = (STEPS_AROUND.index(lines) - STEPS_AROUND.index(self.lines)) % 4
        self.lines = lines
        if way == 2:
            self.illegal += 1
        else:
            self.count += (0, 1, 0, -1)[way]


def signed(data: bytes) -> int:
    return int.from_bytes(data, "little", signed=True)


@dataclass
class PcRules:
    """What a PC may know of its box: the last frames that are right, of the box's session, and in order."""

    axis: int
    session: int | None = None
    accepted: int | None = None
    last: dict[int, int] = field(default_factory=dict)

    def hear(self, identifier: int, data: bytes, *, waiting: bool) -> None:
        kind = identifier & ~0xF
        if identifier & 0xF != self.axis or kind not in (STATUS, CORRECTIONS) or not is_right(identifier, data):
            return
        if kind == STATUS:
            if self.in_order(STATUS, data[1], waiting=waiting) and data[4] != self.session:
                self.session, self.accepted = data[4], None
                self.last.pop(CORRECTIONS, None)
        elif data[6] == self.session and self.in_order(CORRECTIONS, data[1], waiting=waiting):
            self.accepted = signed(data[4:6])

    def in_order(self, kind: int, sequence: int, *, waiting: bool) -> bool:
        before = self.last.get(kind)
        if before is not None and not waiting and not 1 <= (sequence - before) % 256 <= MOST_AHEAD:
            return False
        self.last[kind] = sequence
        return True
