"""A board on the bench for many trials: one motion of the axis, begun at many moments of the program."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model import Image
from rtec._jit import new_record
from rtec.board import Microcontroller
from rtec.board.board import Snapshot
from rtec.controller import ReceiverSettings
from rtec.controller._kernels import RECEIVER, reset as reset_receiver
from rtec.injector import Design
from rtec.signal import EdgeStream, levels_of_states
from rtec.units import PS_PER_S
from rtec.verify.bench import Bench
from rtec.verify.envelope import _kernels as kernels

Longs = NDArray[np.int64]

CLOCKS_APART = 4
"""Receivers that see each trial, their clocks apart by equal shares of a period: none is tied to the processor's."""
IDEAL = ReceiverSettings(filter_samples=0)
"""The controller's input without a filter: what the lines themselves hold."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Transitions of the encoder from a moment on, and what the PC asks meanwhile."""

    times_ps: Longs
    """Strictly increasing, shape (n,)."""
    direction: int
    """+1 or -1."""
    total: int
    """Steps asked for."""
    ask_at: int = -1
    """Index of the transition at which the PC asks; -1 where it has asked before."""
    large: bool = False
    """Whether it says Large Correction."""


class PhaseSweepBench(Bench):
    """A design's board with a program that has taken home, ready for trials.

    Parameters
    ----------
    design, microcontroller, image, hold_latch
        As of `Bench`.

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
        super().__init__(design, microcontroller, image, hold_latch=hold_latch, watched=False)
        self.clock_ps = PS_PER_S / microcontroller.clock_hz
        self.trials = 0
        self.controller_input = ReceiverSettings()
        self.board.start_up()
        first, end_ps = self.board.published, self.now_ps + self.cycles_ps(280_000)
        while self.board.published < first + 6 and self.now_ps < end_ps:
            self.run_for(self.cycles_ps(100))
        told_ps = self.board.said_since(first)[:, 0]
        if told_ps.size >= 6:
            self.reading_ps = int(told_ps[5] - told_ps[1]) // 4
        self.rested = self.keep()

    def seen_until(self, t_ps: int) -> EdgeStream:
        """Run up to a time in one piece; return what the controller sees meanwhile."""
        self._run_to(t_ps)
        return self._controller[-1]

    def shifts(self, moment: Snapshot, clocks: NDArray[np.int64]) -> Longs:
        """Return how long after a moment so many clocks' edges lie, and one picosecond.

        Pins are sampled at a clock's edge: a transition just behind it has just been missed.
        """
        since_ps, hz = moment.now_ps - int(self.board.state.origin_ps), self.microcontroller.clock_hz
        number = clocks + -(-since_ps * hz // PS_PER_S)
        return number // hz * PS_PER_S + -(-(number % hz) * PS_PER_S // hz) - since_ps + 1

    def sweep(
        self, moment: Snapshot, motion: Motion, shifts_ps: Longs, *, stop: bool = True
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Make a trial for each shift; return the verdicts, and where all was completed while the axis moved."""
        board, circuits = self.board, moment.circuits
        receivers = self._receivers(int(circuits.seen_out), int(circuits.ahead - self.rested.circuits.ahead))
        raw = receivers.view(np.uint8)
        states = (moment.state + motion.direction * np.arange(1, motion.times_ps.size + 1)) % 4
        verdicts, moving = np.zeros(shifts_ps.size, np.uint8), np.zeros(shifts_ps.size, np.uint8)
        memory, hidden, log = board.cpu.arrays
        made = kernels.sweep(
            board.state, np.asarray(board.state.base).view(np.uint8), np.frombuffer(circuits, np.uint8),
            board.cpu.loop, memory, moment.memory, hidden, moment.hidden, log, receivers, raw, raw.copy(),
            PS_PER_S // self.controller_input.clock_hz // CLOCKS_APART, motion.times_ps + moment.now_ps,
            levels_of_states(states).astype(np.uint8), motion.direction * motion.times_ps.size, shifts_ps,
            motion.ask_at, motion.total, int(motion.large), self._tail_ps, self.reading_ps, self.design.step_counts,
            stop, verdicts, moving,
        )  # fmt: skip
        self.trials += made
        return verdicts[:made], moving[:made]

    @property
    def _tail_ps(self) -> int:
        """Time behind the last transition: what it has set off is over, and through the filter."""
        return self.cycles_ps(100) + 200_000

    def _receivers(self, level: int, count: int) -> NDArray[Any]:
        """Return receivers at a level and a count as records."""
        one = new_record(RECEIVER)
        self.controller_input.fill(one)
        reset_receiver(one, level)
        one.count = count
        return np.repeat(np.asarray(one.base), CLOCKS_APART)

    def play(self, moment: Snapshot, motion: Motion, phase_clocks: int) -> None:
        """Carry out one trial by the board's own face: what came out is that of any run."""
        self.reset(moment)
        shift_ps = self.shifts(moment, np.array([phase_clocks]))
        self.edges(motion.times_ps + moment.now_ps + shift_ps, motion.direction)
        if motion.ask_at >= 0:
            self.run_until(int(self.axis.times_ps[motion.ask_at]))
            self.board.ask(motion.total, large=motion.large)
        self.run_until(int(self.axis.times_ps[-1]) + self._tail_ps + kernels.READINGS * self.reading_ps)
