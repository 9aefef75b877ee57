"""The box's firmware on the one-clock part of this project's simulator, with an encoder that moves at any speed.

ucsim has no one-clock timing, so there is no peer here: what the lines show is held to the rules of the designs by an
ideal decoder behind gates and holding latch, written down again in this file.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from firmware_bench import GO_HOME, IMAGES, STATES, Look, output, signed
from pin_drive import drive

from firmware_model import Mcs51, read_hex

FOLDERS = {25: "one_clock_25mhz", 100: "one_clock_100mhz"}
STEP_COUNTS = {"original": 4, "a": 4, "b": 1, "c": 2}
CHANGES = {"original": 4, "a": 4, "c": 2}
RELEASED = 0x80  # P1.7, active low: A and B are held in front of the gates


@dataclass(frozen=True, slots=True)
class Words:
    position: int
    completed: int
    accepted: int
    message: int
    refused: int


class Box:
    """An image for ``mhz``, started, its axis homed and at rest in state 1; times are clocks."""

    def __init__(self, name: str, mhz: int) -> None:
        self.name = name
        self.tick = 500 * mhz  # a reading every half millisecond
        self.cpu = Mcs51(read_hex(IMAGES / FOLDERS[mhz] / f"{name}.ihx"), part="8051", timing="one-clock")
        self.cpu.iram[:128] = 0xA5
        self.cpu.pins[3] = self.level(0)
        self.times = np.zeros(0, dtype=np.int64)
        self.counts = np.zeros(0, dtype=np.int64)

    def level(self, count: int) -> int:
        """Levels of port 3: the switch closed, no probe trip."""
        a, b = STATES[count % 4]
        circuit = a | b if self.name == "original" else a ^ b
        return 0xCA | circuit << 2 | a << 4 | b << 5

    def ask(self, total: int, status: int = 0) -> None:
        self.cpu.xram[0xFF10:0xFF13] = total & 0xFF, total >> 8 & 0xFF, status

    def home(self) -> None:
        self.ask(0, GO_HOME)
        self.run(self.cpu.cycles + 2 * self.tick)
        self.ask(0)
        self.run(self.cpu.cycles + 2 * self.tick)

    def start_of_record(self) -> int:
        self.ports = int(self.cpu.sfr[0x90 - 0x80])
        self.cpu.record()
        return self.cpu.cycles

    def move(self, times: np.ndarray, direction: int = 1) -> None:
        """Queue the encoder's edges, each in the clock that first samples it."""
        self.times = np.floor(times).astype(np.int64)
        self.counts = direction * np.arange(1, len(times) + 1)
        drive(self.cpu, self.times, np.full(len(times), 3), [self.level(int(count)) for count in self.counts])

    def show_count(self) -> None:
        """Let the decoder show what it has counted by now."""
        edges = int(np.searchsorted(self.times, self.cpu.cycles, side="right"))
        count = int(self.counts[edges - 1]) if edges else 0
        self.cpu.xram[0xFF00:0xFF02] = count >> 8 & 0x0F, count & 0xFF

    def run(self, until: int) -> None:
        while self.cpu.cycles < until:
            self.cpu.run(min(400, until - self.cpu.cycles))
            self.show_count()
        assert self.cpu.fault is None

    def words(self) -> Words:
        w = [int(value) for value in self.cpu.xram[0xFF20:0xFF2D]]
        return Words(signed(*w[:3]), signed(*w[3:5]), signed(*w[5:7]), w[7], w[12])

    def port_1(self) -> list[tuple[int, int]]:
        return [(int(cycle), int(latch)) for cycle, port, latch in self.cpu.port_rows() if port == 1]

    def lines(self) -> list[tuple[int, tuple[int, int]]]:
        """A and B at the controller since the record began: clock and levels of each change, the first ones at 0."""
        changes = [(clock, 0, latch) for clock, latch in self.port_1()]
        changes += [(int(t), 1, int(count)) for t, count in zip(self.times, self.counts, strict=True)]
        latch, state, held, found = self.ports, 0, 0, []
        for clock, is_edge, value in [(0, 0, latch), *sorted(changes)]:
            latch, state = (latch, value % 4) if is_edge else (value, state)
            held = state if latch & RELEASED else held
            levels = output(self.name, Look(clock, 0, latch, 0, STATES[held]))
            if not found or levels != found[-1][1]:
                found.append((clock, levels))
        return found

    def insertions(self) -> list[list[int]]:
        """Clocks of the changes of each insertion by gates."""
        pairs = itertools.pairwise([(0, self.ports), *self.port_1()])
        clocks = [clock for (_, before), (clock, after) in pairs if (before ^ after) & 0x0F]
        return [clocks[k : k + CHANGES[self.name]] for k in range(0, len(clocks), CHANGES[self.name])]


def moving(name: str, mhz: int, every: float, total: int, *, phase: int = 0, direction: int = 1, jitter: float = 0.0):
    """A box whose axis moves for six readings, an edge ``every`` so many clocks; ``total`` is asked for on the way.

    Returns the box at the end of the motion and the words then.
    """
    box = Box(name, mhz)
    box.home()
    begin = box.start_of_record() + 200 + phase
    edges = int(6 * box.tick / every)
    shaken = np.random.default_rng(phase).uniform(-jitter, jitter, edges)
    box.move(begin + (np.arange(edges) + shaken) * every, direction)
    box.run(begin + 2 * box.tick)  # the speed is known from a whole reading
    box.ask(total)
    box.run(int(box.times[-1]) - 1)
    words = box.words()
    box.run(box.cpu.cycles + 300)
    return box, words
