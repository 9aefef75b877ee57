"""The peer of the 8051: ``s51`` of ucsim (SDCC's simulator), driven by a file of commands.

What holds for ucsim 0.6.4 and was found by trying it:

- commands of a file given with ``-C`` run one after the other, each echoed before its answer; those of stdin are
  echoed in the midst of other answers. The file is read before a program named on the command line, so it loads its
  own;
- RAM is random after power-up (its contents here are set to 0 first), program memory without code is random, too;
- ``-t 52`` is the part with 256 bytes of RAM and timer 2, ``-t 51`` that with 128 bytes; both are HMOS, which has no
  idle mode and no power-down, ``-t C52`` is CHMOS;
- a step is an instruction, and where an interrupt is called behind it the call and the routine's first instruction;
- ``state`` counts instructions (``Inst=``) and clocks since reset (``clks``), twelve of which are a machine cycle;
- a stack that grows beyond 0xFF stops the simulation ("Erroneous instruction"); the reserved opcode does not.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hex_writer import write_hex

from firmware_model.hexfile import Image

PROGRAM = "s51"
CLOCKS_PER_CYCLE = 12
PARTS = {"8051": "51", "8052": "52", "80C52": "C52"}
_TIMEOUT_S = 120.0
_LOOK = ("state", "dump /h iram 0 0xff 32", "dump /h sfr 0x80 0xff 32")
_STATE = re.compile(r"CPU state= \w+ PC= 0x([0-9a-f]+).*?Inst= (\d+) .*?\((\d+) clks\)", re.DOTALL)
_DUMP = re.compile(r"^0x[0-9a-f]+ ((?:[0-9a-f]{2} ){32})", re.MULTILINE)
_USAGE = re.compile(r"Host usage: ([0-9.]+) sec")


class UcsimError(RuntimeError):
    """ucsim is absent, too slow, or said something else than expected."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """What the peer holds between two instructions.

    Parameters
    ----------
    pc, instructions, cycles
        Address of the next instruction, and what was done since reset; cycles of twelve clocks.
    iram
        256 bytes, 128 of the 8051.
    sfr
        128 bytes from 0x80 on; of a port the latch.
    """

    pc: int
    instructions: int
    cycles: int
    iram: bytes
    sfr: bytes


@dataclass(frozen=True, slots=True)
class Pins:
    """Levels that the outside drives on a port from the next instruction on."""

    port: int
    levels: int


def absent() -> bool:
    """Return whether the peer is missing here."""
    return shutil.which(PROGRAM) is None


def version() -> str:
    """Return what the peer calls itself."""
    number = re.search(r"\d+\.\d[\d.]*", _said([_program(), "-v"], 10.0))
    return f"ucsim {number[0]}" if number else "ucsim of an unknown version"


def follow(
    image: Image, steps: Iterable[int], *, part: str = "8052", timeout_s: float = _TIMEOUT_S
) -> list[Snapshot]:
    """Run an image from reset and look at it after each of several numbers of instructions.

    Parameters
    ----------
    image
        Program memory; what it does not use is random in the peer.
    steps
        Instructions to the first look, from there to the second, and so on; 0 looks at once.
    part
        A key of `PARTS`.
    timeout_s
        Seconds after which the peer is ended.

    Raises
    ------
    UcsimError
        The peer is absent, hangs, or stopped early (a stack beyond 0xFF).
    """
    wanted = list(steps)
    script = []
    for count in wanted:
        script += [f"step {count}"] if count else []
        script += _LOOK
    said = _simulate(image, script, part, timeout_s)
    snapshots = _snapshots(said, len(wanted))
    done = 0
    for count, snapshot in zip(wanted, snapshots, strict=True):
        done += count
        if snapshot.instructions != done:
            where = f"after {snapshot.instructions} of {done} instructions, at {snapshot.pc:#06x}"
            raise UcsimError(f"{PROGRAM} stopped {where}: {_complaint(said)}")
    return snapshots


def play(
    image: Image, actions: Iterable[int | Pins], *, part: str = "8052", timeout_s: float = _TIMEOUT_S
) -> list[Snapshot]:
    """Run an image from reset while pins change between instructions; look at it after every run of steps.

    Parameters
    ----------
    image
        Program memory.
    actions
        Steps to go, or pins to set; a step may be more than one instruction where an interrupt comes.
    part
        A key of `PARTS`.
    timeout_s
        Seconds after which the peer is ended.

    Raises
    ------
    UcsimError
        The peer is absent, hangs, or does not answer.
    """
    script: list[str] = []
    looks = 0
    for action in actions:
        if isinstance(action, Pins):
            script.append(f"set hardware port[{action.port}] {action.levels:#04x}")
        else:
            script += [f"step {action}", *_LOOK]
            looks += 1
    return _snapshots(_simulate(image, script, part, timeout_s), looks)


def xram_after(image: Image, steps: int, *, part: str = "8052", timeout_s: float = _TIMEOUT_S) -> bytes:
    """Return the external RAM, 65 536 bytes of 0 at first, after so many instructions."""
    said = _simulate(image, [f"step {steps}", "dump /h xram 0 0xffff 32"], part, timeout_s)
    return _bytes_of(_DUMP.findall(said))


def timed(image: Image, steps: int, *, part: str = "8052", timeout_s: float = _TIMEOUT_S) -> tuple[Snapshot, float]:
    """Run so many instructions at once; return the end and the seconds that the peer says it took."""
    said = _simulate(image, [f"step {steps}", *_LOOK], part, timeout_s)
    usage = _USAGE.search(said)
    (snapshot,) = _snapshots(said, 1)
    if usage is None or snapshot.instructions != steps:
        raise UcsimError(
            f"{PROGRAM} stopped after {snapshot.instructions} of {steps} instructions: {_complaint(said)}"
        )
    return snapshot, float(usage[1])


def _program() -> str:
    found = shutil.which(PROGRAM)
    if found is None:
        raise UcsimError(f"{PROGRAM} (ucsim; Debian and Ubuntu: apt-get install sdcc-ucsim) is not on PATH")
    return found


def _simulate(image: Image, script: Sequence[str], part: str, timeout_s: float) -> str:
    with tempfile.TemporaryDirectory(prefix="ucsim-") as folder:
        write_hex(image, Path(folder) / "image.hex")
        commands = ['file "image.hex"', "fill iram 0 0xff 0", "fill xram 0 0xffff 0", "reset", *script, "quit"]
        (Path(folder) / "commands").write_text("\n".join(commands) + "\n", encoding="ascii")
        return _said([_program(), "-t", PARTS[part], "-b", "-q", "-R", "1", "-C", "commands"], timeout_s, folder)


def _said(arguments: list[str], timeout_s: float, folder: str | None = None) -> str:
    try:
        done = subprocess.run(
            arguments,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
            cwd=folder,
        )
    except subprocess.TimeoutExpired as late:
        raise UcsimError(f"{PROGRAM} took longer than {timeout_s:g} s") from late
    return done.stdout


def _snapshots(said: str, count: int) -> list[Snapshot]:
    states = _STATE.findall(said)
    lines = _DUMP.findall(said)
    each, rest = divmod(len(lines), max(count, 1))  # 4 lines of registers behind 4 or 8 of RAM
    if len(states) != count or rest or each not in {0, 8, 12}:
        raise UcsimError(f"{PROGRAM} answered {len(states)} of {count} times: {said[-300:]!r}")
    snapshots = []
    for k, (pc, instructions, clocks) in enumerate(states):
        cycles, rest = divmod(int(clocks), CLOCKS_PER_CYCLE)
        if rest:
            raise UcsimError(f"{PROGRAM} is {rest} clocks into a machine cycle")
        memory = _bytes_of(lines[each * k : each * (k + 1)])
        snapshots.append(
            Snapshot(
                pc=int(pc, 16), instructions=int(instructions), cycles=cycles, iram=memory[:-128], sfr=memory[-128:]
            )
        )
    return snapshots


def _bytes_of(lines: Sequence[str]) -> bytes:
    return bytes.fromhex("".join(lines))


def _complaint(said: str) -> str:
    found = re.search(r"^.*(?:overflow|Erroneous|rror).*$", said, re.MULTILINE)
    return found[0].strip() if found else "for no reason that it gives"
