"""A board on the test bench: motions of the axis, trials of them from a kept moment on, one of them looked at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model import Image
from rtec._jit import new_record
from rtec.board import Board, Microcontroller
from rtec.board.board import Snapshot
from rtec.controller import ReceiverSettings
from rtec.controller._kernels import RECEIVER, reset as reset_receiver
from rtec.injector import Design
from rtec.signal import EdgeStream, levels_of_states
from rtec.units import PS_PER_S
from rtec.verify.envelope import _kernels as kernels

Longs = NDArray[np.int64]

CLOCKS_APART = 4
"""Receivers that see each trial, their clocks apart by equal shares of a period: none is tied to the processor's."""
CONTROLLER = ReceiverSettings()
"""The controller's input with its default filter."""
IDEAL = ReceiverSettings(filter_samples=0)
"""The same without a filter: what the lines themselves hold."""
_LEAST_PS = 1_000
"""Jitter brings two transitions no closer together than this."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Transitions of the encoder, counted from one of them or from a beginning."""

    times_ps: Longs
    """Strictly increasing."""
    direction: int
    """+1 or -1."""
    total: int
    """Steps asked for."""
    ask_at: int = -1
    """Index of the transition at which the PC asks; -1 where it has asked before."""
    large: bool = False
    """Whether it says Large Correction."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moment:
    """A state of the board from which trials begin."""

    kept: Snapshot
    """The board."""
    at_ps: int
    """Time that shifts count from, not before the board's."""
    state: int
    """Angle state 0..3 of the lines."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shown:
    """One trial looked at closely."""

    sent: EdgeStream
    seen: EdgeStream
    completed: int


def shaken(times_ps: Longs, jitter_ps: int) -> Longs:
    """Return the times with the worst jitter within its bound: every other transition late, those between early.

    Examples
    --------
    >>> shaken(np.array([0, 100_000, 200_000]), 5_000).tolist()
    [5000, 95000, 205000]
    """
    if jitter_ps == 0:
        return times_ps
    signs = 1 - 2 * (np.arange(times_ps.size, dtype=np.int64) % 2)
    steps = np.arange(times_ps.size, dtype=np.int64) * _LEAST_PS
    return np.maximum.accumulate(times_ps + signs * jitter_ps - steps) + steps


class PhaseSweepBench:
    """A design's board with a program, ready for trials.

    Parameters
    ----------
    design, microcontroller, image, hold_latch
        As of `Board`.

    Examples
    --------
    Milliseconds between two readings of the PC's words, at rest:

    >>> bench = PhaseSweepBench(Design.C, Microcontroller.named("8051-12mhz"))
    >>> round(bench.reading_ps / 1e9, 2)
    1.01
    """

    def __init__(
        self,
        design: Design,
        microcontroller: Microcontroller,
        image: Path | Image | None = None,
        *,
        hold_latch: bool = False,
    ) -> None:
        self.board = Board(design, microcontroller, image, hold_latch=hold_latch)
        self.design, self.microcontroller = design, microcontroller
        self.cycle_ps = self.board.microcontroller.cycle_ps[0] / self.board.microcontroller.cycle_ps[1]
        self.clock_ps = PS_PER_S / microcontroller.clock_hz
        self.trials = 0
        self.controller = CONTROLLER
        self.board.start_up()
        self.reading_ps = self._measured_reading_ps()
        self.rested = Moment(kept=self.board.snapshot(), at_ps=self.board.now_ps, state=0)

    def _measured_reading_ps(self) -> int:
        """Return the time from one answer to the PC to the next; that of the 8051's images where there is none."""
        board, answers, limit_ps = self.board, [int(self.board.state.published)], round(40_000 * self.cycle_ps)
        begun_ps = board.now_ps
        times: list[int] = []
        while len(times) < 6 and board.now_ps < begun_ps + 7 * limit_ps:
            board.idle(until_ps=board.now_ps + round(100 * self.cycle_ps))
            if board.state.published != answers[-1]:
                answers.append(int(board.state.published))
                times.append(int(board.state.published_ps))
        return (times[5] - times[1]) // 4 if len(times) == 6 else round(1000 * self.cycle_ps)

    def shifts(self, moment: Moment, clocks: NDArray[np.int64]) -> Longs:
        """Return how long after a moment so many clocks' edges lie, and one picosecond.

        Pins are sampled at a clock's edge: a transition just behind it has just been missed.
        """
        origin_ps, hz = int(self.board.state.origin_ps), self.microcontroller.clock_hz
        number = clocks + -(-(moment.at_ps - origin_ps) * hz // PS_PER_S)
        return origin_ps - moment.at_ps + number // hz * PS_PER_S + -(-(number % hz) * PS_PER_S // hz) + 1

    def sweep(
        self, moment: Moment, motion: Motion, shifts_ps: Longs, *, stop: bool = True
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Make a trial for each shift; return the verdicts, and where all was completed while the axis moved."""
        board = self.board
        state, kept_memory, kept_hidden, level = moment.kept
        receivers, raw = _receivers(self.controller, level, int(state.ahead - self.rested.kept[0].ahead))
        memory, hidden, log = board.cpu.arrays
        times_ps = motion.times_ps + moment.at_ps
        verdicts, moving = np.zeros(shifts_ps.size, np.uint8), np.zeros(shifts_ps.size, np.uint8)
        state_bytes = np.asarray(board.state.base).view(np.uint8)
        made = kernels.sweep(
            board.state, state_bytes, np.frombuffer(state, np.uint8), board.cpu.loop, memory, kept_memory, hidden,
            kept_hidden, log, receivers, raw, raw.copy(), _spread_ps(self.controller), times_ps,
            levels(motion, moment), motion.direction * motion.times_ps.size, shifts_ps, motion.ask_at, motion.total,
            int(motion.large), self._tail_ps, self.reading_ps, self.design.step_counts, stop, verdicts, moving,
        )  # fmt: skip
        self.trials += made
        return verdicts[:made], moving[:made]

    @property
    def _tail_ps(self) -> int:
        """Time behind the last transition: what it has set off is over, and through the filter."""
        return round(100 * self.cycle_ps) + 200_000

    def show(self, moment: Moment, motion: Motion, shift_ps: int) -> Shown:
        """Carry out one trial by the board's own face, and keep its streams."""
        board = self.board
        board.restore(moment.kept)
        times_ps = motion.times_ps + (moment.at_ps + shift_ps)
        initial = moment.state ^ moment.state >> 1
        sent = EdgeStream(times_ps, levels(motion, moment), initial=initial)
        pieces, first = [], max(motion.ask_at, 0)
        if motion.ask_at >= 0:
            pieces.append(board.process(sent.part(0, first), until_ps=int(times_ps[first])))
            board.ask(motion.total, large=motion.large)
        end_ps = int(times_ps[-1]) + self._tail_ps + kernels.READINGS * self.reading_ps
        pieces.append(board.process(sent.part(first, len(sent)), until_ps=end_ps))
        seen = EdgeStream.concatenate(pieces)
        return Shown(sent=sent, seen=seen, completed=board.words.completed)


def levels(motion: Motion, moment: Moment) -> NDArray[np.uint8]:
    """Return the level codes behind the transitions of a motion that begins in a moment's state."""
    states = (moment.state + motion.direction * np.arange(1, motion.times_ps.size + 1)) % 4
    return np.asarray(levels_of_states(states), dtype=np.uint8)


def _spread_ps(settings: ReceiverSettings) -> int:
    return PS_PER_S // settings.clock_hz // CLOCKS_APART


def _receivers(settings: ReceiverSettings, level: int, count: int) -> tuple[Any, NDArray[np.uint8]]:
    """Return receivers at a level and a count as records, and their memory."""
    one = new_record(RECEIVER)
    settings.fill(one)
    reset_receiver(one, level)
    one.count = count
    several = np.repeat(np.asarray(one.base), CLOCKS_APART)
    return several, several.view(np.uint8)
