"""A slow, plain model of the box's circuit board: one instruction at a time, every circuit from its drawing.

Written from docs/firmware.md ("Hardware map", "Memory map") and NISTIR 4832; the processor is `Mcs51`, run for one
instruction at a time, so nothing in it is skipped or run ahead. All that comes from outside is given beforehand as a
script of ``(time in ps, what, value)``. Levels are pairs ``(A, B)``; pins are 0 or 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from firmware_model import Mcs51
from firmware_model.core import _layout as at

FORWARD = ((0, 0), (1, 0), (1, 1), (0, 1))
READS = {0xE0: "DPTR", 0xE2: "R0", 0xE3: "R1"}  # MOVX A,@...
CHIP_CLOCK_MHZ = 14


@dataclass
class DecoderChip:
    """The HCTL-2000: both lines pass a filter of three samples, twelve bits are read as two bytes."""

    levels: tuple[int, int]
    count: int = 0
    latch: int = 0
    inhibited: bool = False
    next_tick: int = 0
    in_reset: bool = False

    def __post_init__(self) -> None:
        self.raw = self.passed = self.levels
        self.samples = [self.levels] * 3

    def ticks_before(self, t_ps: int) -> None:
        """Let every tick of the chip's clock before ``t_ps`` sample both lines; tick k comes at k / 14 MHz."""
        while self.next_tick * 10**6 < t_ps * CHIP_CLOCK_MHZ:
            self.samples = [*self.samples[1:], self.raw]
            new = list(self.passed)
            for line in (0, 1):
                seen = {sample[line] for sample in self.samples}
                if len(seen) == 1:
                    (new[line],) = seen
            step = (FORWARD.index(tuple(new)) - FORWARD.index(self.passed)) % 4
            self.count += {0: 0, 1: 1, 2: 0, 3: -1}[step]
            self.passed = tuple(new)
            self.next_tick += 1
            if self.samples == [self.raw] * 3:  # the ticks that are left until then see nothing new
                self.next_tick = max(self.next_tick, -(-t_ps * CHIP_CLOCK_MHZ // 10**6))

    def change(self, t_ps: int, levels: tuple[int, int]) -> None:
        self.ticks_before(t_ps)
        self.raw = levels

    def reset(self, t_ps: int, *, low: bool) -> None:
        """Take a change of RST: it zeroes the counter and opens the latch, and holds both so while it is low."""
        self.in_reset = low
        self.ticks_before(t_ps + 1)
        self.count = 0
        self.inhibited = False

    def answer(self, t_ps: int) -> tuple[int, int]:
        """Return the bytes that a read at ``t_ps`` finds."""
        self.ticks_before(t_ps + 1)
        if not self.inhibited:
            self.latch = 0 if self.in_reset else self.count % 4096
        return self.latch // 256, self.latch % 256


@dataclass
class BoardOracle:
    """The box of a design; ``clock_hz`` is the oscillator's, ``clocks`` of it are one cycle."""

    cpu: Mcs51
    design: str
    clock_hz: int
    clocks: int
    hold_latch: bool
    script: list[tuple[int, str, object]]
    initial: tuple[int, int] = (0, 0)
    changes: list[tuple[int, tuple[int, int]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.code = self.cpu.code
        self.lines = self.initial
        self.held: tuple[int, int] | None = None
        self.p1 = [1] * 8
        self.switch_open, self.probe_line = 0, 1
        self.chip = DecoderChip(self.initial)
        self.done = 0  # of the script, on the side of the circuits
        self.queued = 0  # of the script, on the side of the processor's pins
        self.pending: tuple[int, list[int]] | None = None
        self.origin_ps = 0
        self.queue_lines, self.queue_switch, self.queue_probe = self.lines, 0, 1
        self.cpu.pins[3] = self.pins(self.lines, 0, 1)
        self.cpu.reset()
        self.out = self.gates()

    # time
    def begins_ps(self, cycle: int) -> int:
        return self.origin_ps + cycle * self.clocks * 10**12 // self.clock_hz

    def samples_ps(self, cycle: int) -> int:
        """S5P2 comes after nine of twelve clocks; a part with one clock a cycle samples at its beginning."""
        return self.begins_ps(cycle) + (9 * 10**12 // self.clock_hz if self.clocks == 12 else 0)

    def seen_in(self, t_ps: int) -> int:
        """Return the first cycle that samples at or after ``t_ps``."""
        cycle = max((t_ps - self.origin_ps) * self.clock_hz // (self.clocks * 10**12) - 3, 0)
        while self.samples_ps(cycle) < t_ps:
            cycle += 1
        return cycle

    # circuits
    def behind_latch(self, lines: tuple[int, int]) -> tuple[int, int]:
        return lines if self.held is None else self.held

    def pins(self, lines: tuple[int, int], switch_open: int, probe_line: int) -> int:
        a, b = self.behind_latch(lines)
        circuit = int(a or b) if self.design == "original" else int(a != b)  # low: both low; or the same
        bits = [switch_open, 1, circuit, probe_line, a, b, 1, 1]
        return sum(bit << place for place, bit in enumerate(bits))

    def gates(self) -> tuple[int, int]:
        if self.design == "b":
            return self.p1[4], self.p1[5]
        out = []
        for line, level in enumerate(self.behind_latch(self.lines)):
            drive, pull = not self.p1[line], not self.p1[2 + line]
            if self.design == "c":
                out.append(int(bool(level) != drive))
            elif self.design == "a":
                out.append(int((level or drive) and not pull))
            else:
                out.append(int(level or drive))
        return tuple(out)

    def note(self, t_ps: int) -> None:
        if self.gates() != self.out:
            self.out = self.gates()
            self.changes.append((t_ps, self.out))

    # events, in the order of their times
    def outside(self, upto_ps: int) -> None:
        """Carry out what the script holds up to and with ``upto_ps``, except resets, on the circuits."""
        while self.done < len(self.script) and self.script[self.done][0] <= upto_ps:
            t_ps, what, value = self.script[self.done]
            if what == "reset":
                break
            self.done += 1
            if what == "edge":
                self.lines = value
                self.chip.change(t_ps, value)
                self.note(t_ps)
            elif what == "ask":
                total, status = value
                self.cpu.xram[0xFF10:0xFF13] = (total & 255, total >> 8 & 255, status)
            elif what == "switch":
                self.switch_open = value
            elif what == "probe":
                self.probe_line = value

    def fire(self) -> None:
        t_ps, p1 = self.pending
        self.pending = None
        self.outside(t_ps - 1)
        if p1[6] != self.p1[6]:
            self.chip.reset(t_ps, low=not p1[6])
        fell, rose = self.p1[7] > p1[7], self.p1[7] < p1[7]
        self.p1 = p1
        if self.hold_latch and fell:
            self.held = self.lines
        elif self.held is not None and rose:
            self.held = None
        else:
            fell = rose = False
        self.outside(t_ps)  # what comes at the same moment makes one change with it
        self.note(t_ps)
        if fell or rose:
            self.queue_again()

    def queue_again(self) -> None:
        """Let the pins follow the latch that has closed or opened."""
        cycle, hidden = self.cpu.cycles, self.cpu._hidden
        waiting = self.cpu._changes[int(hidden[at.CHANGE]) :]
        self.cpu._changes = np.ascontiguousarray(waiting[waiting[:, 0] < cycle])
        hidden[at.CHANGE], hidden[at.CHANGES] = 0, len(self.cpu._changes)
        self.queued = self.done
        self.queue_lines, self.queue_switch, self.queue_probe = self.lines, self.switch_open, self.probe_line
        self.append(cycle)

    def append(self, cycle: int) -> None:
        level = self.pins(self.queue_lines, self.queue_switch, self.queue_probe)
        row = np.array([[cycle, 3, level]])
        waiting = self.cpu._changes[int(self.cpu._hidden[at.CHANGE]) :]
        self.cpu._changes = np.ascontiguousarray(np.concatenate([waiting, row]))
        self.cpu._hidden[at.CHANGE], self.cpu._hidden[at.CHANGES] = 0, len(self.cpu._changes)

    def queue(self) -> None:
        """Queue the changes of pins that the next instruction, or a call of a routine, can meet."""
        limit = self.cpu.cycles + 16
        while self.queued < len(self.script):
            t_ps, what, value = self.script[self.queued]
            if what == "reset" or (cycle := self.seen_in(t_ps)) > limit:
                break
            self.queued += 1
            if what == "edge":
                self.queue_lines = value
            elif what == "switch":
                self.queue_switch = value
            elif what == "probe":
                self.queue_probe = value
            if what != "ask":
                self.append(cycle)

    # running
    def run(self, until_ps: int) -> None:
        """Go on until the next instruction would sample at or after ``until_ps``, resets on the way included."""
        while True:
            reset_ps = next((t for t, what, _ in self.script[self.done :] if what == "reset" and t < until_ps), None)
            self.run_freely(until_ps if reset_ps is None else reset_ps)
            if reset_ps is None:
                return
            self.reset(reset_ps)

    def run_freely(self, until_ps: int) -> None:
        while True:
            if self.pending is not None:
                if self.pending[0] >= until_ps:
                    break
                self.fire()
            elif self.cpu.fault is None and self.samples_ps(self.cpu.cycles) < until_ps:
                self.step()
            else:
                break
        self.outside(until_ps - 1)

    def step(self) -> None:
        cpu = self.cpu
        opcode = self.code[cpu.pc]
        t_ps = self.samples_ps(cpu.cycles)
        address = None
        if opcode in READS:
            bank = int(cpu.sfr[0xD0 - 0x80]) & 0x18
            high, low = int(cpu.sfr[0xA0 - 0x80]), int(cpu.iram[bank + (opcode & 1)])
            if opcode == 0xE0:
                high, low = int(cpu.sfr[0x83 - 0x80]), int(cpu.sfr[0x82 - 0x80])
            address = high * 256 + low
            self.outside(t_ps)
            if address in {0xFF00, 0xFF01}:
                cpu.xram[0xFF00:0xFF02] = self.chip.answer(t_ps)
        self.queue()
        executed = cpu.run(1).instructions
        if executed and address in {0xFF00, 0xFF01}:
            self.chip.inhibited = address == 0xFF00
        p1 = [int(cpu.sfr[0x90 - 0x80]) >> place & 1 for place in range(8)]
        if p1 != self.p1:
            self.pending = (self.begins_ps(cpu.cycles), p1)

    def reset(self, t_ps: int) -> None:
        """RST is pulled and let go at ``t_ps``: the latches come up high, and a first cycle begins."""
        self.outside(t_ps)
        self.done += 1  # the reset itself
        self.pending = None
        if not self.p1[6]:
            self.chip.reset(t_ps, low=False)
        self.p1 = [1] * 8
        self.held = None
        self.outside(t_ps)
        self.note(t_ps)
        self.origin_ps += t_ps - self.begins_ps(self.cpu.cycles)
        self.cpu._hidden[at.CHANGE] = self.cpu._hidden[at.CHANGES] = 0
        self.queued = self.done
        self.queue_lines, self.queue_switch, self.queue_probe = self.lines, self.switch_open, self.probe_line
        self.cpu.pins[3] = self.pins(self.lines, self.switch_open, self.probe_line)
        self.cpu.reset()
