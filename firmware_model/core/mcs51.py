"""The face of the processor: program memory in, registers and pins at hand, runs of any length."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, Literal, Protocol

import numba
import numpy as np
from numpy.typing import NDArray

from firmware_model._jit import address_of
from firmware_model.core import _layout as at
from firmware_model.core._execute_kernels import execute
from firmware_model.core._reset_kernels import reset
from firmware_model.core._serial_kernels import begin_receiving
from firmware_model.core.predecode import decode
from firmware_model.core.results import Fault, FaultKind, RunResult
from firmware_model.core.state import new_hidden, watch
from firmware_model.errors import FirmwareError
from firmware_model.isa.parts import PARTS, TIMINGS

CODE_BYTES = 0x10000
"""Bytes of program memory that the processor can address."""

LOG_ROWS = 4096
"""Changes of ports kept by the loop before it hands them over."""

_FAULTS = {
    at.FAULT_RESERVED: FaultKind.RESERVED_OPCODE,
    at.FAULT_UNMAPPED: FaultKind.UNMAPPED_SFR,
    at.FAULT_OUTSIDE: FaultKind.OUTSIDE_IMAGE,
    at.FAULT_STACK: FaultKind.STACK_OVERFLOW,
    at.FAULT_INDIRECT: FaultKind.UNMAPPED_RAM,
}


class CodeImage(Protocol):
    """What `Mcs51` asks of an image: 65 536 bytes of code, and the ranges of them that are filled."""

    @property
    def code(self) -> bytes:
        """Program memory."""
        ...

    @property
    def used(self) -> Sequence[tuple[int, int]]:
        """Ranges ``(begin, end)`` of addresses."""
        ...


def _memory_of(image: CodeImage | bytes) -> tuple[bytes, Sequence[tuple[int, int]]]:
    if isinstance(image, bytes | bytearray):
        if not 0 < len(image) <= CODE_BYTES:
            raise FirmwareError("image", f"{len(image)} bytes", f"1 to {CODE_BYTES} bytes of program memory")
        return bytes(image).ljust(CODE_BYTES, b"\xff"), [(0, len(image))]
    return image.code, image.used


@functools.cache
def loop() -> Any:
    """Return `execute` as a value that other kernels can call by its address.

    Called by its name, it would be compiled anew into each of them, which takes minutes.
    """
    byte, long, table = numba.uint8[::1], numba.int64[::1], numba.int64[:, ::1]
    return address_of(execute, (long, byte, byte, long, table, table))


class Mcs51:
    r"""An MCS-51 microcontroller with its program memory.

    Parameters
    ----------
    image
        An `Image`, or the bytes from address 0 on; fetching an instruction outside is a fault.
    part
        ``"8051"``: 128 bytes of internal RAM, two timers; ``"8052"``: 256 bytes, three timers.
    timing
        ``"12-clock"``: the original; ``"one-clock"``: the CIP-51 core (`firmware_model.isa.table`).

    Raises
    ------
    FirmwareError
        A part or timing that is not known, or program memory of no or more than 65 536 bytes.

    Notes
    -----
    Pins: a read of a port gives latch and pin, as the quasi-bidirectional ports do; the instructions that read,
    modify and write take the latch (manual, "Read-Modify-Write Feature"). Pins are sampled in S5P2, so that a change
    counts from the cycle in which it is sampled; an instruction of more than one cycle samples in its first.

    References
    ----------
    Intel, "MCS 51 Microcontroller Family User's Manual" (272383-002, 1994).

    Examples
    --------
    >>> cpu = Mcs51(bytes([0x74, 0x2A, 0xF5, 0x90, 0x80, 0xFE]))  # MOV A,#42; MOV P1,A; SJMP $
    >>> cpu.run(cycles=4)
    RunResult(instructions=3, cycles=4, reason='budget')
    >>> cpu.pc, int(cpu.sfr[0x90 - 0x80])
    (4, 42)
    """

    def __init__(
        self,
        image: CodeImage | bytes,
        part: Literal["8051", "8052"] = "8052",
        timing: Literal["12-clock", "one-clock"] = "12-clock",
    ) -> None:
        if part not in PARTS:
            raise FirmwareError("part", repr(part), " or ".join(PARTS))
        if timing not in TIMINGS:
            raise FirmwareError("timing", repr(timing), " or ".join(TIMINGS))
        self.part, self.timing = PARTS[part], TIMINGS[timing]
        code, used = _memory_of(image)
        self._words = decode(code, used, self.part, self.timing)
        self._code = np.frombuffer(code, dtype=np.uint8).copy()
        self._memory = np.zeros(at.BYTES, dtype=np.uint8)
        self._memory[at.PINS : at.PINS + 4] = 255
        self._hidden = new_hidden(self.part, self.timing)
        self._log = np.zeros((LOG_ROWS, at.LOG_COLUMNS), dtype=np.int64)
        self._changes = np.zeros((0, 3), dtype=np.int64)
        self._rows: list[NDArray[np.int64]] = []
        reset(self._memory, self._hidden)

    @property
    def pc(self) -> int:
        """Address of the next instruction."""
        return int(self._hidden[at.PC])

    @pc.setter
    def pc(self, address: int) -> None:
        if not 0 <= address < CODE_BYTES:
            raise FirmwareError("pc", address, f"0 to {CODE_BYTES - 1}")
        self._hidden[at.PC] = address

    @property
    def cycles(self) -> int:
        """Cycles since the first reset: machine cycles (12-clock) or clocks (one-clock)."""
        return int(self._hidden[at.CYCLES])

    @property
    def instructions(self) -> int:
        """Instructions executed since the first reset."""
        return int(self._hidden[at.COUNT])

    @property
    def code(self) -> bytes:
        """Program memory, 65 536 bytes."""
        return self._code.tobytes()

    @property
    def iram(self) -> NDArray[np.uint8]:
        """Internal RAM, 256 bytes, live; the 8051 has the lower 128."""
        return self._memory[0:256]

    @property
    def sfr(self) -> NDArray[np.uint8]:
        """Special function registers at address - 0x80, live; ports are latches, SBUF is the byte received."""
        return self._memory[0x180:0x200]

    @property
    def xram(self) -> NDArray[np.uint8]:
        """External data memory, 65 536 bytes, live."""
        return self._memory[at.XRAM : at.SNAPSHOT]

    @property
    def pins(self) -> NDArray[np.uint8]:
        """Levels driven from outside on P0..P3, live; 255 (nothing pulls down) at first."""
        return self._memory[at.PINS : at.PINS + 4]

    @property
    def idle(self) -> bool:
        """Whether the processor waits in idle mode for an interrupt."""
        return bool(self._memory[at.PCON] & 1)

    @property
    def fault(self) -> Fault | None:
        """Why the processor stopped, or None."""
        kind = int(self._hidden[at.FAULT])
        if kind == at.FAULT_NONE:
            return None
        return Fault(kind=_FAULTS[kind], pc=self.pc, opcode=int(self._code[self.pc]), cycle=self.cycles)

    @property
    def loop(self) -> tuple[Any, NDArray[np.int64], NDArray[np.uint8]]:
        """The compiled loop as a value that a kernel can call, with decoded program and program memory."""
        return loop(), self._words, self._code

    @property
    def arrays(self) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]:
        """Bytes, hidden state and an empty log, live, for a compiled driver of the loop."""
        return self._memory, self._hidden, self._log

    def stop_at_outputs(self, masks: Sequence[int]) -> None:
        """Let a compiled driver stop at each change of these bits of P0..P3 and before each read of external memory.

        `run` is not for a processor so driven: it would end at the first of them.
        """
        self._hidden[at.STOPPING : at.STOPPING + 4] = masks
        self._hidden[at.BUS] = 1
        watch(self._hidden)

    def reset(self) -> None:
        """Pull and release RST: registers take their reset values; RAM, pins and the count of cycles stay."""
        reset(self._memory, self._hidden)

    def run(self, cycles: int) -> RunResult:
        """Execute until ``cycles`` have passed, or a fault or power-down ends it.

        Parameters
        ----------
        cycles
            Budget, 0 or more: machine cycles (12-clock) or clocks (one-clock). The last instruction is finished.

        Returns
        -------
        RunResult
            A run cut into pieces gives the same states as the whole.

        Raises
        ------
        FirmwareError
            A negative budget.
        """
        if cycles < 0:
            raise FirmwareError("cycles", cycles, "0 or more")
        hidden = self._hidden
        cycles_before, executed_before = self.cycles, self.instructions
        hidden[at.END] = self.cycles + cycles
        while True:
            hidden[at.DUE] = 0
            execute(self._words, self._code, self._memory, hidden, self._log, self._changes)
            self._collect()
            if hidden[at.STOP] != at.STOP_LOG_FULL:
                break
            hidden[at.STOP] = at.RUNNING
        reason: Literal["budget", "fault", "power-down"] = "budget"
        if hidden[at.STOP] == at.STOP_FAULT:
            reason = "fault"
        elif hidden[at.STOP] == at.STOP_POWER_DOWN:
            reason = "power-down"
        return RunResult(
            instructions=self.instructions - executed_before, cycles=self.cycles - cycles_before, reason=reason
        )

    def step(self) -> RunResult:
        """Execute one instruction, after the hardware's call of a service routine where one is due.

        In idle mode, one cycle passes.
        """
        first = self.run(1)
        if first.instructions or first.reason != "budget" or self.idle:
            return first
        second = self.run(1)
        return RunResult(instructions=second.instructions, cycles=first.cycles + second.cycles, reason=second.reason)

    def receive(self, byte: int, *, ninth_bit: int = 1) -> None:
        """Let a frame begin at RXD now; RI comes when its last bit is sampled.

        Parameters
        ----------
        byte
            0..255.
        ninth_bit
            The stop bit in mode 1 (1 where it is valid), the ninth data bit in modes 2 and 3.

        Raises
        ------
        FirmwareError
            A byte out of range, mode 0 (where the processor itself clocks), or a frame still coming in.
        """
        if not 0 <= byte <= 255 or ninth_bit not in {0, 1}:
            raise FirmwareError("byte", (byte, ninth_bit), "0 to 255 and 0 or 1")
        if self._memory[at.SCON] >> 6 == 0:
            raise FirmwareError("serial mode", 0, "1, 2 or 3", "let the firmware set SM0 or SM1 of SCON first")
        if self._hidden[at.RECEIVE_LEFT] or self._hidden[at.RECEIVE_AT] != at.NEVER:
            raise FirmwareError("byte", byte, "one frame at a time", "run until RI before the next")
        begin_receiving(self._memory, self._hidden, byte | (ninth_bit << 8), self.cycles)

    def record(self, *, on: bool = True) -> None:
        """Keep from now on every change of a port's latch and every byte sent, or no more."""
        self._hidden[at.LOG_ROOM] = LOG_ROWS if on else 0
        watch(self._hidden)

    def port_rows(self) -> NDArray[np.int64]:
        """Return the changes of the ports recorded so far, in order of time.

        Returns
        -------
        ndarray
            Rows of the cycles completed when the writing instruction ends (the pin follows in S1P1 of the cycle that
            begins then), the port, 0 to 3, and the byte written.

        Examples
        --------
        >>> cpu = Mcs51(bytes([0xB2, 0x90, 0x80, 0xFC]))  # loop: CPL P1.0; SJMP loop
        >>> cpu.record()
        >>> _ = cpu.run(6)
        >>> cpu.port_rows().tolist()
        [[1, 1, 254], [4, 1, 255]]
        """
        rows = self._recorded()
        return rows[rows[:, 1] < at.LOG_SERIAL]

    def sent(self) -> list[tuple[int, int]]:
        """Return the bytes sent since `record`: the cycle at whose end TI was set, and the byte."""
        rows = self._recorded()
        return [(int(cycle), int(value)) for cycle, _, value in rows[rows[:, 1] == at.LOG_SERIAL]]

    def _recorded(self) -> NDArray[np.int64]:
        if not self._rows:
            return np.zeros((0, at.LOG_COLUMNS), dtype=np.int64)
        self._rows = [np.concatenate(self._rows)]
        return self._rows[0]

    def _collect(self) -> None:
        written = int(self._hidden[at.LOGGED])
        if written:
            self._rows.append(self._log[:written].copy())
            self._hidden[at.LOGGED] = 0
