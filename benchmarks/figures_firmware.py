"""Figures of the firmware: our 8051 beside ucsim, the box with live pins, the first run and a later one."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from children import Child, measure, rtec
from figures import Bar, Figure, Setting, Spread, number, skipped

from firmware_model import Mcs51
from firmware_model.hexfile import Image
from rtec.board import Board, Microcontroller
from rtec.injector import Design
from rtec.signal import EdgeStream

# measure.py runs without pytest's paths
sys.path += [str(Path(__file__).parents[1] / "tests" / name) for name in ("differential", "oracles")]
import ucsim
from mcs51_programs import ACC, PSW

_BAR = Bar(value=10.0, unit="x ucsim")
_COMMAND = "python benchmarks/measure.py --only firmware"

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


_LIVE_BAR = Bar(value=50.0, unit="x real time")
_FORWARD = np.array([1, 3, 2, 0], dtype=np.uint8)
_PS_PER_S = 1e12


def firmware(setting: Setting) -> Iterator[Figure]:
    """Measure the processor beside ucsim, with live pins, and from an empty and a filled cache."""
    yield from beside_ucsim(setting)
    yield from live_pins(setting)
    yield from starts()


def live_pins(setting: Setting) -> Iterator[Figure]:
    """Measure the Original at 12 MHz between encoder and controller, the axis in steady motion or at rest.

    A loop of the program that only waits is counted in whole turns, which is how an 8051 can be so fast; the plain
    processor on a program that never waits stands beside it.
    """
    run_s = setting.of(10, 2)
    for frequency_hz, what in ((30_000, "the rapid of the report's machine"), (100_000, "beyond it"), (0, "at rest")):
        seconds = []
        for _ in range(setting.of(7, 3)):
            board, edges = _moving(frequency_hz, run_s)
            begun = time.perf_counter()
            out = board.process(edges, until_ps=board.now_ps + int(run_s * _PS_PER_S))
            seconds.append(time.perf_counter() - begun)
            if len(out) != len(edges) or out.counts().illegal or board.fault is not None:
                raise ArithmeticError(f"{len(out)} of {len(edges)} edges came through, {board.fault}")
            if abs(board.words.position - len(edges)) > 4 * frequency_hz * 0.0011 + 1:  # a reading is a tick old
                raise ArithmeticError(f"position {board.words.position} after {len(edges)} edges")
        spread = Spread(tuple(seconds))
        an_edge = f", {spread.best / len(edges) * 1e9:.0f} ns an edge" if len(edges) else ""
        yield Figure(
            what=f"Live pins, Original, 8051 at 12 MHz: {frequency_hz / 1000:g} kHz ({what})",
            measured=spread.text(lambda taken: f"{run_s / taken:.1f} x real time") + an_edge,
            value=run_s / spread.best,
            bar=_LIVE_BAR if frequency_hz == 30_000 else None,
            command=_COMMAND,
        )
    runs = [_carry_out(MIXED, setting.of(20_000_000, 4_000_000)) for _ in range(setting.of(7, 3))]
    cpu, taken = min(runs, key=lambda run: run[1])
    yield Figure(
        what=f"The processor alone, no turn of a loop counted as a whole: {MIXED.source}",
        measured=(
            f"{number(cpu.instructions / taken)} instructions/s, {cpu.cycles / 1e6 / taken:.0f} x real time at 12 MHz"
        ),
        value=cpu.cycles / 1e6 / taken,
        command=_COMMAND,
    )


def _moving(frequency_hz: int, run_s: float) -> tuple[Board, EdgeStream]:
    """Return a board that has been started up, and the edges of an axis that moves on from there."""
    board = Board(Design.ORIGINAL, Microcontroller.named("8051-12mhz"))
    board.start_up()
    count = int(4 * frequency_hz * run_s) - 4
    if count < 0:
        return board, EdgeStream([], [], initial=0)
    times_ps = board.now_ps + np.rint((np.arange(count) + 1) * (_PS_PER_S / 4 / frequency_hz)).astype(np.int64)
    return board, EdgeStream(times_ps, _FORWARD[np.arange(count) % 4], initial=0)


_USE_FROM_PYTHON = "from firmware_model import Mcs51; Mcs51(bytes([0x80, 0xFE])).run(1000)"


def starts() -> Iterator[Figure]:
    """Measure the first use of the processor ever, which compiles it, and the next one."""
    image = str(Microcontroller.named("8051-12mhz").image(Design.ORIGINAL))
    commands = {
        f'python -c "{_USE_FROM_PYTHON}"': [sys.executable, "-c", _USE_FROM_PYTHON],
        "rtec firmware run original.ihx": [rtec(), "firmware", "run", image],
    }
    for text, command in commands.items():
        with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as cache:
            first = measure(command, Path(folder), NUMBA_CACHE_DIR=cache)
            later = [measure(command, Path(folder), NUMBA_CACHE_DIR=cache) for _ in range(5)]
        name = text.split(" ", maxsplit=1)[0]
        yield _taken(
            f"First compile of the simulator, by `{name}`", [first], 60.0, f"NUMBA_CACHE_DIR=$(mktemp -d) {text}"
        )
        yield _taken(f"Cached start of the simulator, by `{name}`", later, 1.0, text)


def _taken(what: str, children: list[Child], bar_s: float, command: str) -> Figure:
    best = min(child.wall_s for child in children)
    return Figure(
        what=what,
        measured=f"{best:.2f} s (its processor time {min(child.cpu_s for child in children):.2f} s)",
        value=best,
        bar=Bar(value=bar_s, unit="s", at_most=True),
        command=command,
    )


def beside_ucsim(setting: Setting) -> Iterator[Figure]:
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
