"""What a run of the processor gives back."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal


class FaultKind(Enum):
    """What the manual leaves undefined, and a program must not do."""

    RESERVED_OPCODE = "reserved opcode"
    UNMAPPED_SFR = "unmapped SFR"
    OUTSIDE_IMAGE = "code outside the image"
    STACK_OVERFLOW = "stack overflow"
    UNMAPPED_RAM = "internal RAM that the part lacks"


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """Why the processor stopped; the instruction named has not been executed.

    Parameters
    ----------
    kind
        What it did.
    pc
        Address of the instruction.
    opcode
        Its first byte, as program memory holds it.
    cycle
        Cycles completed before it.

    Examples
    --------
    >>> str(Fault(kind=FaultKind.RESERVED_OPCODE, pc=0x12, opcode=0xA5, cycle=7))
    'reserved opcode at 0012h (opcode A5h) in cycle 7'
    """

    kind: FaultKind
    pc: int
    opcode: int
    cycle: int

    def __str__(self) -> str:
        return f"{self.kind.value} at {self.pc:04X}h (opcode {self.opcode:02X}h) in cycle {self.cycle}"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """What one call of `Mcs51.run` did."""

    instructions: int
    """Instructions executed."""
    cycles: int
    """Cycles passed: machine cycles of the 12-clock part, clocks of the one-clock part. The last instruction is
    finished, so that they can be a few more than asked."""
    reason: Literal["budget", "fault", "power-down"]
    """Why it ended."""
