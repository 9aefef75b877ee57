"""Figures of the firmware: instructions a second of our 8051 beside ucsim's, on the same image, checked to agree."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

from figures import Bar, Figure, Setting, Spread, number, skipped

from firmware_model import Mcs51
from firmware_model.hexfile import Image

sys.path.append(str(Path(__file__).parents[1] / "differential"))  # measure.py runs without pytest's paths
import ucsim
from mcs51_programs import ACC, PSW

_BAR = Bar(value=10.0, unit="x ucsim")
_COMMAND = "python tests/bench/measure.py --only firmware"

MIXED = Image.of(
    bytes.fromhex(
        "758160"  # 0000        mov   sp,#0x60
        "7830"  # 0003          mov   r0,#0x30
        "900400"  # 0005 again: mov   dptr,#0x400
        "7A08"  # 0008          mov   r2,#8
        "E6"  # 000A loop:      mov   a,@r0
        "2503"  # 000B          add   a,3
        "D4"  # 000D            da    a
        "3417"  # 000E          addc  a,#0x17
        "F6"  # 0010            mov   @r0,a
        "75F00D"  # 0011        mov   b,#13
        "A4"  # 0014            mul   ab
        "65F0"  # 0015          xrl   a,b
        "FB"  # 0017            mov   r3,a
        "C0E0"  # 0018          push  acc
        "112F"  # 001A          acall sub
        "D0E0"  # 001C          pop   acc
        "30E302"  # 001E        jnb   acc.3,even
        "B290"  # 0021          cpl   p1.0
        "F0"  # 0023 even:      movx  @dptr,a
        "A3"  # 0024            inc   dptr
        "08"  # 0025            inc   r0
        "B88002"  # 0026        cjne  r0,#0x80,on
        "7830"  # 0029          mov   r0,#0x30
        "DADD"  # 002B on:      djnz  r2,loop
        "80D6"  # 002D          sjmp  again
        "C3"  # 002F sub:       clr   c
        "9507"  # 0030          subb  a,7
        "C4"  # 0032            swap  a
        "F507"  # 0033          mov   7,a
        "22"  # 0035            ret
    ),
    source="arithmetic, stack, calls, bits, external memory",
)
"""Something of everything, as firmware has it."""

POLLING = Image.of(
    bytes.fromhex(
        "E590"  # 0000 poll:    mov   a,p1
        "5403"  # 0002          anl   a,#3
        "6B"  # 0004            xrl   a,r3
        "60F9"  # 0005          jz    poll
        "6B"  # 0007            xrl   a,r3
        "FB"  # 0008            mov   r3,a
        "80F5"  # 0009          sjmp  poll
    ),
    source="polling two port pins",
)
"""What firmware does between two edges of an encoder."""


def firmware(setting: Setting) -> Iterator[Figure]:
    """Measure the 8051 beside ucsim by turns, the same instructions of the same image in each."""
    steps = setting.of(20_000_000, 2_000_000)
    for image in (MIXED, POLLING):
        what = f"8051, {image.source}, beside ucsim"
        if ucsim.absent():
            yield skipped(
                what, "s51 is not on PATH; install the system's package sdcc-ucsim to compare", _COMMAND, _BAR
            )
            continue
        peer, _ = ucsim.timed(image, steps)
        check(_carry_out(image, peer.cycles)[0], peer, ucsim.xram_after(image, steps))
        ours, theirs = [], []
        for _ in range(setting.of(7, 3)):
            ours.append(_carry_out(image, peer.cycles)[1])
            theirs.append(ucsim.timed(image, steps)[1])
        yield _ratio(what.replace("ucsim", ucsim.version()), steps, Spread(tuple(ours)), Spread(tuple(theirs)))


def check(cpu: Mcs51, peer: ucsim.Snapshot, xram: bytes) -> None:
    """Compare where two simulators ended.

    Raises
    ------
    ArithmeticError
        They did not do the same.
    """
    parity = peer.sfr[ACC - 0x80].bit_count() & 1  # known_divergences.toml
    sfr = bytearray(peer.sfr)
    sfr[PSW - 0x80] = sfr[PSW - 0x80] & 0xFE | parity
    pairs = {
        "instructions": (cpu.instructions, peer.instructions),
        "cycles": (cpu.cycles, peer.cycles),
        "program counter": (cpu.pc, peer.pc),
        "internal RAM": (cpu.iram.tobytes(), peer.iram),
        "special function registers": (cpu.sfr.tobytes(), bytes(sfr)),
        "external RAM": (cpu.xram.tobytes(), xram),
    }
    wrong = [name for name, (ours, theirs) in pairs.items() if ours != theirs]
    if wrong:
        raise ArithmeticError(f"ours and ucsim end with different {', '.join(wrong)}")


def _carry_out(image: Image, cycles: int) -> tuple[Mcs51, float]:
    cpu = Mcs51(image, part="8052", timing="12-clock")
    begun = time.perf_counter()
    cpu.run(cycles=cycles)
    return cpu, time.perf_counter() - begun


def _ratio(what: str, steps: int, ours: Spread, theirs: Spread) -> Figure:
    return Figure(
        what=what,
        measured=(
            f"{theirs.best / ours.best:.1f} x (medians {theirs.median / ours.median:.1f} x): "
            f"{number(steps / ours.best)} against {number(steps / theirs.best)} instructions/s"
        ),
        value=theirs.best / ours.best,
        bar=_BAR,
        command=_COMMAND,
    )
