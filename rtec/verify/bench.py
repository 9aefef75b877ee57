"""A board on the bench: an axis that moves in front of it, a controller that counts behind it, eyes on its pins."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firmware_model import FaultKind, Image, read_hex
from firmware_model.core import _layout as at
from firmware_model.core.mcs51 import LOG_ROWS
from firmware_model.isa.disassembler import disassemble
from rtec.board import Board, Microcontroller
from rtec.board.board import Snapshot, Words
from rtec.controller import Receiver, ReceiverResult, ReceiverSettings
from rtec.injector import Design
from rtec.signal import EdgeStream, states_of_levels
from rtec.units import PS_PER_S

_SLICE_CYCLES = {"12-clock": 4_000, "one-clock": 20_000}
"""What is recorded on the way holds 4096 changes of the ports."""
_REMEMBERED = 64
"""Slices whose beginnings are kept, to look more closely at what the program did in them."""
_LISTED_CYCLES, _TAIL_CYCLES = 40, 4
"""Executed instructions are listed for so many cycles; no MCS-51 instruction but MUL and DIV, which change no pin,
takes longer than the second."""
_STOPS = "stops here"


class Failed(Exception):  # noqa: N818 - it is no error of this program
    """A point of the contract does not hold: what was seen, and when."""

    def __init__(self, detail: str, time_ps: int) -> None:
        super().__init__(detail)
        self.detail, self.time_ps = detail, time_ps


class Stopped(Failed):
    """The processor has stopped, or does nothing but change its pins."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Executed:
    """An instruction as it was executed near a moment: its first cycle, address and text, and port 1 after it."""

    cycle: int
    address: int
    text: str
    port_1: int


def quarter_ps(frequency_hz: float, count: int) -> NDArray[np.int64]:
    """Return the times of ``count`` edges at a constant speed, the first at 0.

    Examples
    --------
    >>> quarter_ps(25_000.0, 3).tolist()
    [0, 10000000, 20000000]
    """
    return np.round(np.arange(count) * (PS_PER_S / (4.0 * frequency_hz))).astype(np.int64)


class Bench:
    """A board with axis and controller, and what was on both sides of it since `begin`.

    An experiment goes back to a kept moment (`reset`), says how the axis moves (`edges`) and what the PC asks
    (``board.ask``), runs on (`run_until`) and looks at what came out (`controller`, `words`, `changes`).

    Parameters
    ----------
    design, microcontroller, image, hold_latch
        As of `rtec.board.Board`.
    watched
        Whether the pins are recorded, and `Stopped` is raised where the processor has stopped.

    Examples
    --------
    Design C comes up and publishes its words; the axis moves by four counts, and the controller sees them:

    >>> bench = Bench(Design.C, Microcontroller.named("8051-12mhz"))
    >>> bench.run_readings(3.0)
    >>> bench.valid, bench.words.message, len(bench.told)
    (True, 1, 3)
    >>> bench.travel(4, 1_000.0)
    >>> bench.encoder_counts, bench.received().count
    (4, 4)
    """

    def __init__(
        self,
        design: Design,
        microcontroller: Microcontroller,
        image: Path | Image | None = None,
        *,
        hold_latch: bool = False,
        watched: bool = True,
    ) -> None:
        source = microcontroller.image(design) if image is None else image
        self.image = source if isinstance(source, Image) else read_hex(source)
        self.board = Board(design, microcontroller, self.image, hold_latch=hold_latch)
        self.design, self.microcontroller, self._cycle = design, microcontroller, microcontroller.cycle_ps
        self.hold_latch, self.watched = hold_latch, watched
        self.reading_ps = self.cycles_ps(1_000) if microcontroller.timing == "12-clock" else PS_PER_S // 2000
        """Between two readings of the PC's words; measured once the box answers."""
        self.board.cpu.record(on=watched)
        self.board.idle(until_ps=0)
        self.begin()

    @property
    def now_ps(self) -> int:
        """Return the present time."""
        return self.board.now_ps

    def cycles_ps(self, cycles: float) -> int:
        """Return how long so many cycles last."""
        return round(cycles * self._cycle[0] / self._cycle[1])

    def cycle_at(self, t_ps: int) -> int:
        """Return the cycle that a time lies in."""
        return (t_ps - int(self.board.state.origin_ps)) * self._cycle[1] // self._cycle[0]

    def time_of(self, cycle: int) -> int:
        """Return when a cycle begins."""
        return int(self.board.state.origin_ps) + cycle * self._cycle[0] // self._cycle[1]

    def begin(self) -> None:
        """Forget what was recorded; the axis rests, and the controller counts from zero."""
        state = self.board.state
        self.begun_ps = self.now_ps
        self.axis = EdgeStream([], [], initial=int(state.ab_in))
        """The edges that the encoder sends, those to come among them."""
        self._encoder, self._controller = [self.axis], [EdgeStream([], [], initial=int(state.seen_out))]
        self._rows: list[NDArray[np.int64]] = []
        self._trail: deque[Snapshot] = deque(maxlen=_REMEMBERED)
        self.first_latches, self._published = self.latches, self.board.published

    def keep(self) -> Snapshot:
        """Return the state, for `reset` and for compiled runs, which record nothing."""
        self.board.cpu.record(on=False)
        kept = self.board.snapshot()
        self.board.cpu.record(on=self.watched)
        return kept

    def reset(self, kept: Snapshot) -> None:
        """Go back to a kept state, with nothing recorded."""
        self.board.restore(kept)
        self.board.cpu.record(on=self.watched)
        self.begin()

    def edges(self, times_ps: NDArray[np.int64], direction: int) -> None:
        """Let the axis move from now on: one count in a direction at each time."""
        state = int(states_of_levels([self.board.state.ab_in])[0])
        self.axis = EdgeStream.from_states(times_ps, (state + direction * np.arange(1, times_ps.size + 1)) % 4, state)

    def move(self, frequency_hz: float, direction: int, duration_ps: int) -> None:
        """Let the axis move at a constant speed from now on, for so long."""
        count = int(duration_ps * 4.0 * frequency_hz / PS_PER_S) + 1
        self.edges(self.now_ps + 1 + quarter_ps(frequency_hz, count), direction)

    def travel(self, counts: int, frequency_hz: float) -> None:
        """Let the axis move by so many counts, and a little while pass."""
        duration_ps = round((abs(counts) - 0.5) * PS_PER_S / (4.0 * frequency_hz))
        self.move(frequency_hz, 1 if counts > 0 else -1, duration_ps)
        self.run_for(duration_ps + 1)

    def run_until(self, t_ps: int) -> None:
        """Run up to a time.

        Raises
        ------
        Stopped
            The processor has stopped.
        """
        most_ps = self.cycles_ps(_SLICE_CYCLES[self.microcontroller.timing]) if self.watched else t_ps
        while self.now_ps < t_ps:
            self._run_to(min(t_ps, self.now_ps + most_ps))

    def run_for(self, duration_ps: int) -> None:
        """Run for so long, as `run_until`."""
        self.run_until(self.now_ps + duration_ps)

    def run_readings(self, readings: float) -> None:
        """Run for so many readings of the PC's words, as `run_until`."""
        self.run_for(round(readings * self.reading_ps))

    def _run_to(self, t_ps: int) -> None:
        if self.watched:
            self._trail.append(self.board.snapshot())
        self._encoder.append(self.axis.window(self.now_ps, t_ps))
        self._controller.append(self.board.process(self._encoder[-1], until_ps=t_ps))
        if self.watched:
            self._collect()

    def _collect(self) -> None:
        """Take what was recorded, and raise `Stopped` where the processor has stopped."""
        _, hidden, log = self.board.cpu.arrays
        rows = log[: int(hidden[at.LOGGED])]
        if rows.size:
            self._rows.append(rows[rows[:, 1] < at.LOG_SERIAL].copy())
        hidden[at.LOGGED] = 0
        fault, stop, now_ps = self.board.fault, int(hidden[at.STOP]), self.time_of(self.board.cpu.cycles)
        if fault is not None:
            lacking = fault.kind in (FaultKind.UNMAPPED_SFR, FaultKind.UNMAPPED_RAM)
            hint = f"; is the image for another part than the {self.microcontroller.part}?" if lacking else ""
            raise Stopped(f"the processor stops: {fault}{hint}", self.time_of(fault.cycle))
        if stop == at.STOP_POWER_DOWN:
            raise Stopped("the program goes to power-down", now_ps)
        if stop == at.STOP_LOG_FULL:
            raise Stopped(f"the program changes its ports {LOG_ROWS} times on end", now_ps)

    def quiet_for(self, duration_ps: int) -> bool:
        """Return whether in so long a time neither a word nor Data Valid would change; time does not pass."""
        kept, until_ps = self.board.snapshot(), self.now_ps + duration_ps
        before = self.words, self.valid, self.board.published
        self.board.process(self.axis.window(self.now_ps, until_ps), until_ps=until_ps)
        same = (self.words, self.valid, self.board.published) == before
        self.board.restore(kept)
        return same

    @property
    def words(self) -> Words:
        """Return the words to the PC, valid or not."""
        return self.board.words

    @property
    def latches(self) -> tuple[int, ...]:
        """Return the latches of the four ports."""
        return tuple(int(self.board.cpu.sfr[port]) for port in (0, 0x10, 0x20, 0x30))

    @property
    def valid(self) -> bool:
        """Return whether the box says that its words are valid."""
        return bool(self.board.state.valid)

    @property
    def encoder(self) -> EdgeStream:
        """Return the encoder's edges since `begin`."""
        return EdgeStream.concatenate(self._encoder)

    @property
    def encoder_counts(self) -> int:
        """Return their count."""
        return self.encoder.counts().net

    @property
    def controller(self) -> EdgeStream:
        """Return what the controller has seen since `begin`."""
        return EdgeStream.concatenate(self._controller)

    def received(self) -> ReceiverResult:
        """Return what the controller, with its default filter, has made of it."""
        receiver = Receiver(ReceiverSettings(counter_bits=0), initial=self._controller[0].initial)
        receiver.process(self.controller)
        return receiver.result(at_ps=self.now_ps)

    def changes(self, port: int) -> Iterator[tuple[int, int, int]]:
        """Yield the changes of a port since `begin`: time in ps, latch before, latch after."""
        before = self.first_latches[port]
        for rows in self._rows:
            for cycle, _, latch in rows[rows[:, 1] == port].tolist():
                yield self.time_of(cycle), before, latch
                before = latch

    @property
    def told(self) -> NDArray[np.int64]:
        """Return what was published since `begin`: rows of time in ps, completed total and message."""
        return self.board.said_since(self._published)

    def await_message(self, message: int, *, readings: float) -> bool:
        """Run until valid words carry a message, looking often; return whether it came."""
        return self.await_that(lambda: self.valid and self.words.message == message, readings=readings)

    def await_total(self, total: int, *, readings: float, looks: int = 20) -> bool:
        """Run until a total is completed, looking so often in a reading; return whether it was."""
        return self.await_that(lambda: self.words.completed == total, readings=readings, looks=looks)

    def await_that(self, holds: Callable[[], bool], *, readings: float, looks: int = 20) -> bool:
        """Run until something holds, looking so often in a reading; return whether it came to that."""
        end_ps = self.now_ps + round(readings * self.reading_ps)
        while not holds():
            if self.now_ps >= end_ps:
                return False
            self.run_for(self.reading_ps // looks)
        return True

    def require(self, holds: bool, detail: str) -> None:
        """Raise `Failed` with the present time where something does not hold."""
        if not holds:
            raise Failed(detail, self.now_ps)

    def executed_before(self, t_ps: int) -> tuple[Executed, ...]:
        """Return the instructions begun in the last 40 cycles before a time that lies not long ago; go back there."""
        begin_ps, rows = t_ps - self.cycles_ps(_LISTED_CYCLES + _TAIL_CYCLES), list[Executed]()
        self.axis = self.encoder
        for kept, after in pairwise([*self._trail, None]):
            end_ps = t_ps if after is None else min(after.now_ps, t_ps)
            if kept is not None and kept.now_ps < t_ps and end_ps > begin_ps:
                self.board.restore(kept)
                self._step_to(end_ps, begin_ps, rows)
        return tuple(row for row in rows if row.cycle < self.cycle_at(t_ps) or row.text == _STOPS)

    def _step_to(self, t_ps: int, begin_ps: int, rows: list[Executed]) -> None:
        """Run on, from a beginning on instruction by instruction, and list them."""
        cpu = self.board.cpu
        try:
            self.run_until(begin_ps)
            while self.now_ps < t_ps:
                cycle, address = cpu.cycles, cpu.pc
                self._run_to(min(self.now_ps + max(self.cycles_ps(1), 1), t_ps))
                if (cpu.cycles, cpu.pc) != (cycle, address):
                    text = disassemble(cpu.code, address).text
                    rows.append(Executed(cycle=cycle, address=address, text=text, port_1=self.latches[1]))
        except Stopped:
            rows.append(Executed(cycle=cpu.cycles, address=cpu.pc, text=_STOPS, port_1=self.latches[1]))
