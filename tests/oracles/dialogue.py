"""The handshake of PC and box on its own, reading by reading, by the steps that machines run."""

from __future__ import annotations

from dataclasses import dataclass

from rtec._jit import new_record
from rtec.link._kernels import MAILBOX, deliver, post
from rtec.requester import _box_kernels, _pc_kernels
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.status import Status


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The box's four words as they stand after a sample."""

    position: int
    completed: int
    accepted: int
    status: Status


class BoxSide:
    """The box's side: give it a request, get its answer; what it accepts counts as inserted at once."""

    def __init__(self, handshake: HandshakeSettings, *, switch_on: bool = True) -> None:
        self._box = new_record(_box_kernels.BOX)
        self._down = new_record(MAILBOX)
        self._up = new_record(MAILBOX)
        handshake.fill_box(self._box, switch_on=switch_on)
        _box_kernels.box_reset(self._box, 0)
        self._now_ps = 0
        self._completed = 0

    def home(self, *, count: int) -> Answer:
        """Take the present position as home."""
        return self._turn(0, _box_kernels.GO_HOME, count)

    def read(self, *, total: int, count: int, large: bool = False, probing: bool = False) -> Answer:
        """Let the box sample a request."""
        flags = (_box_kernels.LARGE_CORRECTION if large else 0) | (_box_kernels.PROBING if probing else 0)
        return self._turn(total, flags, count)

    def trip(self, *, count: int) -> int:
        """Trip the probe; return the latched position."""
        _box_kernels.box_trip(self._box, count)
        return int(self._box.trip_position)

    def switch(self, on: bool) -> None:
        """Throw the hardware switch."""
        self._box.switch_on = int(on)

    @property
    def refused(self) -> int:
        """Return the number of requests outside the window."""
        return int(self._box.refused)

    def _turn(self, total: int, flags: int, count: int) -> Answer:
        self._now_ps += int(self._box.period_ps)
        post(self._down, self._now_ps, total, flags, 0, 0)
        box_tick = _box_kernels.box_tick
        self._completed = int(box_tick(self._box, self._down, self._up, self._now_ps, count, self._completed))
        deliver(self._up, self._now_ps)
        return Answer(
            position=int(self._up.word0),
            completed=self._completed,
            accepted=int(self._box.accepted),
            status=Status(int(self._box.status)),
        )


class PcSide:
    """The PC's side: give it the box's words and a prediction, get its request."""

    def __init__(self, handshake: HandshakeSettings, *, count_mm: float, step_counts: int, word_limit: int) -> None:
        self._pc = new_record(_pc_kernels.PC)
        self._down = new_record(MAILBOX)
        self._up = new_record(MAILBOX)
        handshake.fill_pc(self._pc, count_mm=count_mm, step_counts=step_counts, word_limit=word_limit)
        _pc_kernels.pc_reset(self._pc, 0)
        self._now_ps = 0

    def turn(self, words: Answer, *, deviation_mm: float) -> int:
        """Read the box's words and make the next request; return its total."""
        pc, down, up = self._pc, self._down, self._up
        self._now_ps += int(pc.period_ps)
        post(up, self._now_ps - pc.valid_after_ps, words.position, words.completed, words.accepted, int(words.status))
        _pc_kernels.pc_start(pc, down, self._now_ps)
        if _pc_kernels.pc_read(pc, up, self._now_ps):
            _pc_kernels.pc_request(pc, down, self._now_ps, deviation_mm)
        deliver(down, self._now_ps + down.latency_ps)
        return int(pc.sent)

    def allow_large_correction(self) -> None:
        """Let the next request exceed the window, once (restart with a hot machine)."""
        self._pc.large_meant = 1

    def probe(self, probing: bool) -> None:
        """Enter or leave the probing mode: nothing is corrected in it."""
        self._pc.probing = int(probing)

    @property
    def state(self) -> PcState:
        """Return what the PC is doing."""
        return PcState(int(self._pc.state))

    @property
    def direction(self) -> int:
        """Return the direction that it follows, +1 or -1."""
        return int(self._pc.direction)

    @property
    def beyond_word(self) -> int:
        """Return the steps wanted beyond what the word holds."""
        return int(self._pc.beyond_word)
