"""``rtec firmware``: machine code of an 8051, run and read."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer

from rtec.cli import _measured
from rtec.cli._arguments import choice
from rtec.cli._console import note, print_json, progress
from rtec.errors import RtecError

if TYPE_CHECKING:
    from firmware_model import Mcs51

_COMPILING = "compiling the processor for this machine, once (less than a minute) ..."
_SLICE_CYCLES = 20_000_000
"""Cycles between two looks at Ctrl-C and the progress bar: some tenths of a second."""

Hex = Annotated[Path, typer.Argument(metavar="IMAGE.hex", help="Machine code as Intel HEX.", show_default=False)]


def frame() -> None:
    """Run and read firmware: any MCS-51 machine code in Intel HEX, no box needed.

    Example: rtec firmware run blink.hex --cycles 1000000
    """


def run(
    image: Hex,
    cycles: Annotated[
        int, typer.Option(min=1, max=10**15, metavar="N", help="Machine cycles of twelve clocks, or single clocks.")
    ] = 1_000_000,
    part: Annotated[
        str, typer.Option(metavar="8051|8052", help="128 bytes of RAM, or 256 and a third timer.")
    ] = "8052",
    timing: Annotated[
        str,
        typer.Option(metavar="12-clock|one-clock", help="The original, or a derivative; decides what a cycle is."),
    ] = "12-clock",
    json: _measured.Json = False,
) -> None:
    """Run an image from reset for a number of cycles, with all pins high, and say where it is then.

    A fault of the firmware (reserved opcode, unmapped register, code outside the image, stack overflow) ends the run
    and is reported with its address and cycle.

    Example: rtec firmware run blink.hex --cycles 1000000
    """
    from firmware_model import Mcs51, read_hex
    from firmware_model.isa.parts import PARTS, TIMINGS

    kind = cast("Literal['8051', '8052']", choice(part, PARTS, name="--part"))
    pace = cast("Literal['12-clock', 'one-clock']", choice(timing, TIMINGS, name="--timing"))
    with _as_bad_input():
        memory = read_hex(image)
    cpu, other = (Mcs51(memory, part=kind, timing=pace) for _ in range(2))
    _compile(other)
    with progress("firmware") as show:
        begun = time.perf_counter()
        reason = "budget"
        while reason == "budget" and cpu.cycles < cycles:
            reason = cpu.run(cycles=min(_SLICE_CYCLES, cycles - cpu.cycles)).reason
            show(cpu.cycles / cycles)
        wall_s = time.perf_counter() - begun
    found = _document(cpu, reason, wall_s) | {"part": kind, "timing": pace}
    if json:
        print_json(found)
    else:
        _show(found)


def disassemble(image: Hex, json: _measured.Json = False) -> None:
    """List the instructions of an image, beginning with the first byte of each range that it uses.

    Data between instructions is listed as instructions, too: nothing in the file tells them apart.

    Example: rtec firmware disassemble blink.hex
    """
    from firmware_model import read_hex
    from firmware_model.isa import disassemble_image

    with _as_bad_input():
        memory = read_hex(image)
    lines = list(disassemble_image(memory.code, memory.used))
    if json:
        rows = [{"address": line.address, "code": line.code.hex(), "text": line.text} for line in lines]
        print_json({"image": str(image), "lines": rows})
        return
    for line in lines:
        typer.echo(str(line))


def application(group: type[typer.core.TyperGroup]) -> typer.Typer:
    """Return the verbs of firmware as one."""
    app = typer.Typer(cls=group, rich_markup_mode="rich", pretty_exceptions_enable=False)
    app.callback()(frame)
    for verb in (run, disassemble):
        app.command(verb.__name__)(verb)
    return app


@contextmanager
def _as_bad_input() -> Iterator[None]:
    """Say what the firmware model refuses as rtec says it."""
    from firmware_model import FirmwareError

    try:
        yield
    except FirmwareError as error:
        raise RtecError(str(error)) from error


def _compile(other: Mcs51) -> None:
    """Let another processor do one cycle, so that the first run's compilation is not taken for its time."""
    from firmware_model import _jit

    if _jit.FIRST_RUN and not _jit.config.DISABLE_JIT:
        note(_COMPILING)
    other.run(cycles=1)


def _document(cpu: Mcs51, reason: str, wall_s: float) -> dict[str, object]:
    fault = cpu.fault
    return {
        "instructions": cpu.instructions,
        "cycles": cpu.cycles,
        "pc": cpu.pc,
        "iram": cpu.iram.tobytes().hex(),
        "wall_s": wall_s,
        "instructions_per_s": cpu.instructions / wall_s if wall_s > 0.0 else None,
        "reason": reason,
        "fault": None
        if fault is None
        else {"kind": fault.kind.value, "pc": fault.pc, "opcode": fault.opcode, "cycle": fault.cycle},
    }


def _show(found: dict[str, object]) -> None:
    """Print the document as lines for people."""
    fault, memory = found["fault"], str(found["iram"])
    typer.echo(
        f"{found['instructions']} instructions in {found['cycles']} cycles ({found['timing']}); PC {found['pc']:04X}"
    )
    if isinstance(fault, dict):
        where = f"at {fault['pc']:04X} in cycle {fault['cycle']}"
        typer.echo(f"Ended by a fault: {fault['kind']}, opcode {fault['opcode']:02X} {where}")
    elif found["reason"] != "budget":
        typer.echo(f"Ended by: {found['reason']}")
    typer.echo("RAM")
    for begin in range(0, len(memory) // 2, 16):
        typer.echo(f"{begin:02X}  {bytes.fromhex(memory[2 * begin : 2 * begin + 32]).hex(' ').upper()}")
    typer.echo(f"{found['wall_s']:.3g} s, {found['instructions_per_s'] or 0:.3g} instructions/s")
