"""The box as a circuit board with a running processor, between encoder and controller."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model import Fault, Image, Mcs51, read_hex
from rtec._jit import Record, new_record
from rtec.board import _board_kernels as kernels
from rtec.board.microcontroller import Microcontroller
from rtec.checks import whole_within
from rtec.controller import ReceiverSettings
from rtec.injector import DesignRow
from rtec.requester.status import Status
from rtec.signal import NEVER, EdgeStream

WORDS = slice(0xFF20, 0xFF2D)
"""Addresses of the words to the PC."""

WINDOW_STEPS, GRACE_READINGS = 3, 2
"""WINDOW and GRACE in the sources of the images (rtec.inc): by so many steps the total may change (Yee 1992,
"General Considerations"); so many readings say "I Don't Believe You" before the next one is fatal."""

READING_PS, READING_CYCLES = 1_250_000_000, 1250
"""A reading of the PC's words comes within so long, on a slow clock within so many cycles."""

START_UP_READINGS = 6
"""A start-up takes so many: three to take home, three to take a request of zero."""

PUBLICATIONS = 16_384
"""Of the words to the PC, so many are remembered."""

_ROOM = 1024
"""Changes of the lines that a run leaves room for, beside two an edge; more are fetched in further turns."""

DECODER_CHIP = ReceiverSettings(filter_samples=3, clock_hz=14_000_000, counter_bits=0)
"""The HCTL-2000: a level counts once three clocks in a row have seen it; 14 MHz is its fastest clock (data sheet
HCTL-2000/2016/2020, "Digital Noise Filter" and "Functional Pin Description", CLK)."""


def reading_ps(microcontroller: Microcontroller) -> int:
    """Return within how long a reading of the PC's words comes.

    Examples
    --------
    >>> reading_ps(Microcontroller.named("8051-12mhz")) / 1e9
    1.25
    """
    cycle_num, cycle_den = microcontroller.cycle_ps
    return max(READING_PS, READING_CYCLES * cycle_num // cycle_den)


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """The words to the PC as they stand; steps and counts."""

    position: int
    completed: int
    accepted: int
    message: int
    """What the firmware says; `status` where it is one of the report's messages."""
    trip_position: int
    trips: int
    refused: int
    """Insertions refused by the speed gate, modulo 256."""

    @property
    def status(self) -> Status | None:
        """Return the message as a status; None for a code that the report's box does not know."""
        return Status(self.message) if self.message in list(Status) else None


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """The whole state of a board at a moment: circuits, memory, hidden state of the processor."""

    circuits: Record
    memory: NDArray[np.uint8]
    hidden: NDArray[np.int64]

    @property
    def now_ps(self) -> int:
        """Return the moment."""
        return int(self.circuits.now_ps)

    @property
    def state(self) -> int:
        """Return the angle state 0..3 of the encoder's lines."""
        return int(self.circuits.ab_in ^ self.circuits.ab_in >> 1)


class Board:
    """The box with a processor that runs an image, fed with edge streams.

    Parameters
    ----------
    design
        Whose circuits stand around the processor.
    microcontroller
        The processor and its clock.
    image
        Its program: Intel HEX file, `Image`, or the committed one of the design where there is None.
    initial
        Level code ``A + 2 * B`` at the start.
    hold_latch
        Whether P1.7 works a latch that holds real edges back during an insertion. The report's circuits have none.
    start_ps
        When the power comes on; the phase between encoder and program is set by it.

    Raises
    ------
    FirmwareError
        An image that cannot be read.

    Examples
    --------
    Home, one step requested at rest, and Design C has added two counts within three milliseconds:

    >>> from rtec.board import Microcontroller
    >>> from rtec.injector import Design
    >>> board = Board(Design.C, Microcontroller.named("8051-12mhz"))
    >>> board.start_up().name
    'OK'
    >>> board.ask(1)
    >>> board.idle(until_ps=board.now_ps + 3_000_000_000).counts()
    Counts(net=2, illegal=0)
    >>> board.words.completed, board.words.status.name
    (1, 'OK')
    """

    def __init__(
        self,
        design: DesignRow,
        microcontroller: Microcontroller,
        image: Path | Image | None = None,
        *,
        initial: int = 0,
        hold_latch: bool = False,
        start_ps: int = 0,
    ) -> None:
        self.design, self.microcontroller = design, microcontroller
        if image is None:
            image = microcontroller.image(design)
        self.cpu = Mcs51(
            read_hex(image) if isinstance(image, Path) else image, microcontroller.part, microcontroller.timing
        )
        self.cpu.stop_at_outputs((0, 0xFF, 0, kernels.NOT_VALID))
        state = self._state = new_record(kernels.BOARD)
        state.pins, state.in_path = design.pins, int(design.in_path)
        state.inverts, state.one_state = int(design.inverts), int(design.one_state)
        state.cycle_num, state.cycle_den = microcontroller.cycle_ps
        state.cycles_per_ps = state.cycle_den / state.cycle_num
        state.sample_ps = microcontroller.sample_ps
        state.reading_ps = reading_ps(microcontroller)
        state.latched = int(hold_latch)
        state.trip_n = 1
        DECODER_CHIP.fill(state.decoder)
        self._inner: Any = self.cpu.arrays
        self._loop = self.cpu.loop  # one tuple, whose type numba works out once
        self._said = np.zeros((PUBLICATIONS, 3), np.int64)
        kernels.power_up(state, *self._inner, start_ps, whole_within("initial", initial, 0, 3))

    @property
    def now_ps(self) -> int:
        """Return the time up to which the board has run."""
        return int(self._state.now_ps)

    @property
    def fault(self) -> Fault | None:
        """Return why the processor stopped, or None."""
        return self.cpu.fault

    def ask(self, total: int, *, large: bool = False, probing: bool = False, home: bool = False) -> None:
        """Put the PC's words out: the requested total of steps and its status."""
        whole_within("total", total, -32768, 32767)
        kernels.board_ask(
            self._inner[0], total, large * kernels.LARGE | probing * kernels.PROBING | home * kernels.HOME
        )

    def switch(self, on: bool) -> None:
        """Throw the switch that allows corrections."""
        self._outside(enable_n=int(not on))

    def probe(self, tripped: bool) -> None:
        """Let the probe trip (its line falls), or go back."""
        self._outside(trip_n=int(not tripped))

    def start_up(self) -> Status | None:
        """Go through the start-up: home is taken here, then zero steps are requested; return what the box says.

        It takes a few readings of the PC's words; a firmware that does not answer leaves `Status.NOT_HOMED` or what
        its memory held, None where that is no message.
        """
        for home in (True, False):
            self.ask(0, home=home)
            self.idle(until_ps=self.now_ps + START_UP_READINGS // 2 * int(self._state.reading_ps))
        return self.words.status

    @property
    def state(self) -> Record:
        """Return the record of the circuits, live, for a compiled driver; `Mcs51.arrays` has the processor's."""
        return self._state

    def snapshot(self) -> Snapshot:
        """Return the whole state, to go on from it later as often as wanted.

        Examples
        --------
        >>> from rtec.board import Microcontroller
        >>> from rtec.injector import Design
        >>> board = Board(Design.C, Microcontroller.named("8051-12mhz"))
        >>> begin = board.snapshot()
        >>> board.start_up().name, board.restore(begin), board.now_ps
        ('OK', None, 0)
        """
        memory, hidden, _ = self._inner
        return Snapshot(self._state.copy(), memory.copy(), hidden.copy())

    def restore(self, kept: Snapshot) -> None:
        """Go back to a snapshot of this board."""
        for name in kernels.BOARD.names or ():
            self._state[name] = kept.circuits[name]
        self._inner[0][:] = kept.memory
        self._inner[1][:] = kept.hidden

    def _outside(self, *, enable_n: int | None = None, trip_n: int | None = None) -> None:
        state = self._state
        enable_n = int(state.enable_n) if enable_n is None else enable_n
        trip_n = int(state.trip_n) if trip_n is None else trip_n
        memory, hidden, log = self._inner
        kernels.board_switch(state, memory, hidden, log, self.now_ps, enable_n, trip_n)

    def begin_counting(self) -> None:
        """Let the monitor at the gates begin now, as a controller that is switched on after the box does."""
        kernels.begin_counting(self._state)

    def reset(self) -> None:
        """Pull and release the processor's RST: all ports come up high at once."""
        memory, hidden, log = self._inner
        kernels.board_restart(self._state, memory, hidden, log, self.now_ps)

    @property
    def words(self) -> Words:
        """Return the words to the PC, whether they are valid or not."""
        raw = self.cpu.xram[WORDS].tobytes()

        def signed(begin: int, end: int) -> int:
            return int.from_bytes(raw[begin:end], "little", signed=True)

        return Words(
            position=signed(0, 3),
            completed=signed(3, 5),
            accepted=signed(5, 7),
            message=raw[7],
            trip_position=signed(8, 11),
            trips=raw[11],
            refused=raw[12],
        )

    @property
    def published(self) -> int:
        """Return how often the words to the PC have become valid since power-up."""
        return int(self._state.published)

    def said_since(self, published: int) -> NDArray[np.int64]:
        """Return what was published since `published` stood there, of the latest `PUBLICATIONS`.

        Returns
        -------
        ndarray
            Rows of time in ps, completed total and message.

        Examples
        --------
        A step of Design C is told of as soon as it is booked, beside the readings a millisecond apart:

        >>> from rtec.board import Microcontroller
        >>> from rtec.injector import Design
        >>> board = Board(Design.C, Microcontroller.named("8051-12mhz"))
        >>> board.start_up().name, board.ask(1)
        ('OK', None)
        >>> before = board.published
        >>> _ = board.idle(until_ps=board.now_ps + 3_000_000_000)
        >>> board.said_since(before)[:, 1].tolist()
        [0, 0, 1, 1]
        """
        first = max(published, self.published - PUBLICATIONS)
        return self._said[np.arange(first, self.published) % PUBLICATIONS]

    def process(self, edges: EdgeStream, *, until_ps: int) -> EdgeStream:
        """Return what the controller sees of ``edges`` and of the box's own changes before ``until_ps``.

        Raises
        ------
        ArgumentError
            Edges that do not join the last ones, or lie outside the present time and ``until_ps``.
        """
        state = self._state
        until_ps = whole_within("until_ps", until_ps, self.now_ps, NEVER - 1, unit="ps (time never runs back)")
        edges.check_joins(int(state.ab_in), self.now_ps, until_ps)
        times: list[NDArray[np.int64]] = []
        levels: list[NDArray[np.uint8]] = []
        taken, before = 0, int(state.seen_out)
        memory, hidden, log = self._inner
        room = 2 * edges.times_ps.size + _ROOM
        queue = np.empty((edges.times_ps.size, 3), np.int64)
        # copies, which may be written to, as campaigns have them: for other arrays the loop would be compiled anew
        moved_ps, moved = edges.times_ps.copy(), edges.levels.copy()
        while not times or self.now_ps < until_ps:
            out_ps, out_levels = np.empty(room, np.int64), np.empty(room, np.uint8)
            i, n = kernels.play(
                state, self._loop, memory, hidden, log, moved_ps[taken:], moved[taken:], until_ps, queue[taken:],
                out_ps, out_levels, self._said,
            )  # fmt: skip
            taken += i
            times.append(out_ps[:n])
            levels.append(out_levels[:n])
        return EdgeStream(np.concatenate(times), np.concatenate(levels), initial=before)

    def idle(self, *, until_ps: int) -> EdgeStream:
        """Let the axis rest until then; return what the controller sees."""
        return self.process(EdgeStream([], [], initial=int(self._state.ab_in)), until_ps=until_ps)
