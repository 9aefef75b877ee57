"""The handshake of PC and box on its own, reading by reading, in simulated time."""

from __future__ import annotations

from dataclasses import dataclass

from rtec._jit import new_record
from rtec.checks import number_within, whole_within
from rtec.link._kernels import MAILBOX
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
    """The box's side of the handshake: give it a request, get its answer.

    Parameters
    ----------
    handshake
        Windows and times.
    switch_on
        False: the hardware switch forbids corrections.

    Examples
    --------
    A request beyond the window is doubted three times, then the box stops for good:

    >>> box = BoxSide(HandshakeSettings(latency_ps=0))
    >>> box.home(count=0).status.name
    'OK'
    >>> [box.read(total=9, count=0).status.name for _ in range(3)]
    ['I_DONT_BELIEVE_YOU', 'I_DONT_BELIEVE_YOU', 'I_STILL_DONT_BELIEVE_YOU']
    """

    def __init__(self, handshake: HandshakeSettings, *, switch_on: bool = True) -> None:
        self._box = new_record(_box_kernels.BOX)
        self._down = new_record(MAILBOX)
        self._up = new_record(MAILBOX)
        handshake.fill_box(self._box, switch_on=switch_on)
        _box_kernels.reset(self._box, 0)
        self._now_ps = 0
        self._completed = 0

    def home(self, *, count: int) -> Answer:
        """Take the present position as home."""
        return self._turn(0, _box_kernels.GO_HOME, count)

    def read(self, *, total: int, count: int, large: bool = False, probing: bool = False) -> Answer:
        """Let the box sample a request; what it accepts counts as inserted at once."""
        flags = (_box_kernels.LARGE_CORRECTION if large else 0) | (_box_kernels.PROBING if probing else 0)
        return self._turn(whole_within("total", total, -(2**31), 2**31), flags, count)

    def trip(self, *, count: int) -> int:
        """Trip the probe; return the latched position."""
        _box_kernels.trip(self._box, count)
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
        self._completed = int(
            _box_kernels.converse(self._box, self._down, self._up, self._now_ps, total, flags, count, self._completed)
        )
        return Answer(
            position=int(self._up.word0),
            completed=self._completed,
            accepted=int(self._box.accepted),
            status=Status(int(self._box.status)),
        )


class PcSide:
    """The PC's side of the handshake: give it the box's words and a prediction, get its request.

    Parameters
    ----------
    handshake
        Windows and times.
    count_mm
        Travel of one count.
    step_counts
        Counts of one step of the box.
    word_limit
        Largest total that the request's word holds.

    Examples
    --------
    It slews by the window, once the box has sampled the last request:

    >>> pc = PcSide(HandshakeSettings(), count_mm=0.001, step_counts=1, word_limit=127)
    >>> words = Answer(position=0, completed=0, accepted=0, status=Status.OK)
    >>> pc.turn(words, deviation_mm=0.100), pc.turn(words, deviation_mm=0.100)
    (3, 3)
    >>> pc.turn(Answer(position=0, completed=3, accepted=3, status=Status.OK), deviation_mm=0.100)
    6
    """

    def __init__(self, handshake: HandshakeSettings, *, count_mm: float, step_counts: int, word_limit: int) -> None:
        self._pc = new_record(_pc_kernels.PC)
        self._down = new_record(MAILBOX)
        self._up = new_record(MAILBOX)
        number_within("count_mm", count_mm, 1e-9, 1e3, unit="mm")
        whole_within("step_counts", step_counts, 1, 1 << 20)
        whole_within("word_limit", word_limit, 0, 1 << 30)
        handshake.fill_pc(self._pc, count_mm=count_mm, step_counts=step_counts, word_limit=word_limit)
        _pc_kernels.reset(self._pc, 0)
        self._now_ps = 0

    def turn(self, words: Answer, *, deviation_mm: float) -> int:
        """Read the box's words and make the next request; return its total."""
        number_within("deviation_mm", deviation_mm, -1e3, 1e3, unit="mm")
        self._now_ps += int(self._pc.period_ps)
        _pc_kernels.converse(
            self._pc, self._down, self._up, self._now_ps,
            words.position, words.completed, words.accepted, int(words.status), deviation_mm,
        )  # fmt: skip
        return int(self._pc.sent)

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
