"""A board on the bench: an axis that moves in front of it, a controller that counts behind it, eyes on its pins."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from firmware_model import FaultKind, Image
from firmware_model.core import _layout as at
from firmware_model.core.mcs51 import LOG_ROWS
from firmware_model.isa.disassembler import disassemble
from rtec.board import Board, Microcontroller
from rtec.board.board import Snapshot, Words
from rtec.controller import Receiver, ReceiverResult, ReceiverSettings
from rtec.injector import Design
from rtec.signal import EdgeStream, states_of_levels
from rtec.units import PS_PER_S
from rtec.verify.firmware.contract import NOT_VALID, Failed, Paused, Stopped
from rtec.verify.firmware.results import Executed

_SLICE_CYCLES = {"12-clock": 4_000, "one-clock": 20_000}
"""What is recorded on the way holds 4096 changes of the ports."""

_TAIL_CYCLES = 4
"""No MCS-51 instruction but MUL and DIV, which change no pin, takes longer."""


class Moving(Protocol):
    """Something that moves the axis."""

    def edges(self, from_ps: int, to_ps: int) -> EdgeStream:
        """Return the edges from one time to before another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Constant speed from a first edge on."""

    first_ps: int
    frequency_hz: float
    direction: int
    level: int
    """Before the first edge."""

    def edges(self, from_ps: int, to_ps: int) -> EdgeStream:
        """Return the edges from one time to before another."""
        period_ps = PS_PER_S / (4.0 * self.frequency_hz)
        begin, end = (max(0, int((t - self.first_ps) / period_ps) - 1) for t in (from_ps, to_ps))
        k = np.arange(begin, end + 4, dtype=np.int64)
        times = self.first_ps + np.rint(k * period_ps).astype(np.int64)
        gone = begin + int(np.count_nonzero(times < from_ps))
        inside = (times >= from_ps) & (times < to_ps)
        home = int(states_of_levels(np.array([self.level]))[0])
        states = (home + self.direction * (k + 1)) & 3
        return EdgeStream.from_states(times[inside], states[inside], (home + self.direction * gone) & 3)


@dataclass(frozen=True, slots=True)
class Given:
    """An axis whose edges are known beforehand."""

    stream: EdgeStream

    def edges(self, from_ps: int, to_ps: int) -> EdgeStream:
        """Return the edges from one time to before another."""
        begin, end = np.searchsorted(self.stream.times_ps, (from_ps, to_ps)).tolist()
        before = int(self.stream.levels[begin - 1]) if begin else self.stream.initial
        return EdgeStream(self.stream.times_ps[begin:end], self.stream.levels[begin:end], before)


@dataclass(frozen=True, slots=True)
class BenchState:
    """What `Bench.keep` keeps."""

    now_ps: int
    board: Snapshot
    level: int
    seen_level: int
    origin_ps: int
    reading_ps: int


class Bench:
    """A board with axis and controller, and a record of everything since `begin`.

    Parameters
    ----------
    design, microcontroller, image, hold_latch
        As of `rtec.board.Board`.

    Examples
    --------
    Design C comes up and publishes its words; the axis moves by four counts, and the controller sees them:

    >>> from firmware_model import read_hex
    >>> chip = Microcontroller.named("8051-12mhz")
    >>> bench = Bench(Design.C, chip, read_hex(chip.image(Design.C)), hold_latch=False)
    >>> bench.run_readings(3.0)
    >>> bench.valid, bench.words.message, len(bench.publications_ps())
    (True, 1, 3)
    >>> bench.travel(4, 1_000.0)
    >>> bench.encoder_counts, bench.received().count
    (4, 4)
    """

    def __init__(self, design: Design, microcontroller: Microcontroller, image: Image, *, hold_latch: bool) -> None:
        self.board = Board(design, microcontroller, image, hold_latch=hold_latch)
        self.design, self.microcontroller, self.image = design, microcontroller, image
        self.cycle_num, self.cycle_den = microcontroller.cycle_ps
        self.reading_ps = self.cycles_ps(1_000) if microcontroller.timing == "12-clock" else PS_PER_S // 2000
        """Between two readings of the PC's words; measured once the box answers."""
        self.hold_latch = hold_latch
        self.takes = 0
        """How often `go_back` was called: the same time comes once in each take."""
        self._pause: tuple[int, int] | None = None
        self.board.cpu.record()
        self._origin_ps = 0
        self._level, self._seen_level = 0, self.board.idle(until_ps=0).final
        self.begin()

    @property
    def now_ps(self) -> int:
        """Return the present time."""
        return self.board.now_ps

    def cycles_ps(self, cycles: float) -> int:
        """Return how long so many cycles last."""
        return round(cycles * self.cycle_num / self.cycle_den)

    def cycle_at(self, t_ps: int) -> int:
        """Return the cycle that a time lies in."""
        return (t_ps - self._origin_ps) * self.cycle_den // self.cycle_num

    def time_of(self, cycle: int) -> int:
        """Return when a cycle begins."""
        return self._origin_ps + cycle * self.cycle_num // self.cycle_den

    def begin(self) -> None:
        """Forget what was recorded; the controller counts from zero."""
        self.motion: Moving | None = None
        self.begun_ps = self.now_ps
        self._encoder: list[EdgeStream] = []
        self.encoder_counts = 0
        """Of the encoder since `begin`."""
        self._controller: list[EdgeStream] = []
        self._rows: list[NDArray[np.int64]] = []
        self._first_levels = (self._level, self._seen_level)
        self.first_latches = self.latches
        self._receiver = Receiver(ReceiverSettings(counter_bits=0), initial=self._seen_level)

    def keep(self) -> BenchState:
        """Return the state, for `go_back`."""
        return BenchState(
            self.now_ps, self.board.snapshot(), self._level, self._seen_level, self._origin_ps, self.reading_ps
        )

    def go_back(self, kept: BenchState) -> None:
        """Take a state up again, with nothing recorded."""
        self.takes += 1
        self.board.restore(kept.board)
        self.board.cpu.record()
        self._level, self._seen_level, self._origin_ps = kept.level, kept.seen_level, kept.origin_ps
        self.reading_ps = kept.reading_ps
        self.begin()

    def move(self, frequency_hz: float, direction: int) -> None:
        """Let the axis move from now on."""
        first_ps = self.now_ps + 1
        self.motion = Motion(first_ps=first_ps, frequency_hz=frequency_hz, direction=direction, level=self._level)

    def travel(self, counts: int, frequency_hz: float) -> None:
        """Let the axis move by so many counts, and a little while pass."""
        period_ps = PS_PER_S / (4.0 * frequency_hz)
        self.move(frequency_hz, 1 if counts > 0 else -1)
        self.run_for(round((abs(counts) - 0.5) * period_ps) + 1)
        self.motion = None

    def run_for(self, duration_ps: int) -> None:
        """Run for so long, the axis moving as it does.

        Raises
        ------
        Stopped
            The processor has stopped.
        Paused
            A replay ends here.
        """
        until_ps = self.now_ps + max(duration_ps, 1)
        pause = self._pause if self._pause is not None and self._pause[0] == self.takes else None
        end_ps = until_ps if pause is None else min(until_ps, pause[1])
        most_ps = self.cycles_ps(_SLICE_CYCLES[self.microcontroller.timing])
        while self.now_ps < end_ps:
            self._run_to(min(end_ps, self.now_ps + most_ps))
        if pause is not None and self.now_ps >= pause[1]:
            raise Paused

    def run_readings(self, readings: float) -> None:
        """Run for so many readings of the PC's words."""
        self.run_for(round(readings * self.reading_ps))

    def _edges_until(self, t_ps: int) -> EdgeStream:
        if self.motion is None:
            return EdgeStream([], [], initial=self._level)
        return self.motion.edges(self.now_ps, t_ps)

    def _run_to(self, t_ps: int) -> None:
        edges = self._edges_until(t_ps)
        seen = self.board.process(edges, until_ps=t_ps)
        self._level, self._seen_level = edges.final, seen.final
        self._encoder.append(edges)
        self.encoder_counts += edges.counts().net if len(edges) else 0
        self._controller.append(seen)
        self._receiver.process(seen)
        self._collect()

    def _collect(self) -> None:
        _, hidden, log = self.board.cpu.arrays
        rows = log[: int(hidden[at.LOGGED])]
        if rows.size:
            self._rows.append(rows[rows[:, 1] < at.LOG_SERIAL].copy())
        hidden[at.LOGGED] = 0
        self.check_running()

    def check_running(self) -> None:
        """Raise `Stopped` where the processor has stopped."""
        _, hidden, _ = self.board.cpu.arrays
        fault, stop = self.board.fault, int(hidden[at.STOP])
        if fault is not None:
            lacking = fault.kind in (FaultKind.UNMAPPED_SFR, FaultKind.UNMAPPED_RAM)
            hint = f"; is the image for another part than the {self.microcontroller.part}?" if lacking else ""
            raise Stopped(f"the processor stops: {fault}{hint}", self.time_of(fault.cycle))
        if stop == at.STOP_POWER_DOWN:
            raise Stopped("the program goes to power-down", self.time_of(self.board.cpu.cycles))
        if stop == at.STOP_LOG_FULL:
            raise Stopped(
                f"the program changes its ports {LOG_ROWS} times on end", self.time_of(self.board.cpu.cycles)
            )

    def quiet_for(self, duration_ps: int) -> bool:
        """Return whether in so long a time neither a word nor Data Valid would change; time does not pass."""
        kept, before = self.board.snapshot(), self.words
        until_ps = self.now_ps + duration_ps
        self.board.process(self._edges_until(until_ps), until_ps=until_ps)
        _, hidden, log = self.board.cpu.arrays
        same = self.words == before and not np.any(log[: int(hidden[at.LOGGED]), 1] == 3)
        self.board.restore(kept)
        return same

    def reset(self) -> None:
        """Pull and release the processor's RST."""
        self.board.reset()
        self._origin_ps = self.now_ps - self.board.cpu.cycles * self.cycle_num // self.cycle_den

    @property
    def words(self) -> Words:
        """Return the words to the PC, valid or not."""
        return self.board.words

    @property
    def latches(self) -> tuple[int, int, int, int]:
        """Return the latches of the four ports."""
        sfr = self.board.cpu.sfr
        return int(sfr[0]), int(sfr[0x10]), int(sfr[0x20]), int(sfr[0x30])

    @property
    def valid(self) -> bool:
        """Return whether the box says that its words are valid."""
        return not self.latches[3] & NOT_VALID

    @property
    def encoder(self) -> EdgeStream:
        """Return the encoder's edges since `begin`."""
        return _joined(self._encoder, self._first_levels[0])

    @property
    def controller(self) -> EdgeStream:
        """Return what the controller has seen since `begin`."""
        return _joined(self._controller, self._first_levels[1])

    def received(self) -> ReceiverResult:
        """Return what the controller has made of it since `begin`."""
        return self._receiver.result(at_ps=self.now_ps)

    def changes(self, port: int) -> Iterator[tuple[int, int, int]]:
        """Yield the changes of a port since `begin`: cycle, latch before, latch after."""
        before = self.first_latches[port]
        for rows in self._rows:
            for cycle, _, latch in rows[rows[:, 1] == port].tolist():
                yield cycle, before, latch
                before = latch

    def publications_ps(self) -> list[int]:
        """Return when Data Valid has risen since `begin`."""
        return [self.time_of(cycle) for cycle, before, after in self.changes(3) if before & ~after & NOT_VALID]

    def await_message(self, message: int, *, readings: float) -> bool:
        """Run until valid words carry a message, looking often; return whether it came."""
        return self.await_that(lambda: self.valid and self.words.message == message, readings=readings)

    def await_that(self, holds: Callable[[], bool], *, readings: float, looks: int = 20) -> bool:
        """Run until something holds, looking so often in a reading; return whether it came to that."""
        end_ps = self.now_ps + round(readings * self.reading_ps)
        while not holds():
            if self.now_ps >= end_ps:
                return False
            self.run_for(self.reading_ps // looks)
        return True

    def executed_until(self, replay: Callable[[], Any], *, take: int, t_ps: int, cycles: int) -> tuple[Executed, ...]:
        """Replay up to a time and return the instructions begun in the cycles before it.

        Parameters
        ----------
        replay
            What led there; it has to begin with `go_back`.
        take
            Which of its takes holds the time.
        t_ps
            The time; what changes a pin then has been executed.
        cycles
            How far back.
        """
        rows: list[Executed] = []
        begin_ps = max(t_ps - self.cycles_ps(cycles + _TAIL_CYCLES), 1)
        self.takes, self._pause = 0, (take, begin_ps)
        try:
            replay()
        except (Paused, Failed):
            pass
        finally:
            self._pause = None
        cpu, code = self.board.cpu, self.board.cpu.code
        try:
            while self.now_ps < t_ps and self.now_ps >= begin_ps:
                cycle, address = cpu.cycles, cpu.pc
                self._run_to(self.now_ps + max(self.cycles_ps(1), 1))
                if cpu.cycles != cycle or cpu.pc != address:
                    text = disassemble(code, address).text
                    rows.append(Executed(cycle=cycle, address=address, text=text, port_1=self.latches[1]))
        except Failed:
            rows.append(Executed(cycle=cpu.cycles, address=cpu.pc, text="stops here", port_1=self.latches[1]))
        return tuple(row for row in rows if row.cycle < self.cycle_at(t_ps) or row.text == "stops here")

    def loop_range(self) -> tuple[int, int]:
        """Run on in short steps and return the lowest and the highest address that the program was seen at."""
        seen = set()
        end_ps = self.now_ps + self.cycles_ps(4_000)
        while self.now_ps < end_ps:
            self.run_for(self.cycles_ps(7))
            seen.add(self.board.cpu.pc)
        return min(seen), max(seen)


def _joined(parts: list[EdgeStream], initial: int) -> EdgeStream:
    if not parts:
        return EdgeStream([], [], initial=initial)
    return EdgeStream(
        np.concatenate([part.times_ps for part in parts]), np.concatenate([part.levels for part in parts]), initial
    )
