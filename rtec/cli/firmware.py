"""``rtec firmware``: machine code of an 8051, run and read, and built from a source of one's own."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import typer

from rtec.cli import _measured
from rtec.cli._console import print_json, progress
from rtec.cli._groups import verbs_under
from rtec.cli._image import HEX, as_bad_input
from rtec.cli._parameters import choice, force, option, quantity, whole, word, written
from rtec.cli._words import among
from rtec.errors import OutputError, RtecError
from rtec.io import check_file
from rtec.units import FREQUENCY, PS_PER_S

if TYPE_CHECKING:
    from firmware_model import Mcs51

_INCLUDES = {
    "8051-12mhz": "8051",
    "8051-24mhz": "8051",
    "one-clock-25mhz": "one_clock_25mhz",
    "one-clock-100mhz": "one_clock_100mhz",
}
"""What a source includes as processor.inc."""
_OUTPUTS = (".ihx", ".lst", ".sym")
_SLICE_CYCLES = 20_000_000
"""Cycles between two looks at Ctrl-C and the progress bar: some tenths of a second."""


def frame() -> None:
    """Run, read, build and check firmware: machine code of the MCS-51 in Intel HEX, alone or in the box.

    Example: rtec firmware check mine.ihx --design original
    Example: rtec firmware copy c mine.asm && rtec firmware build mine.asm
    Example: rtec firmware run mine.ihx --cycles 1e6
    """


def run(
    image: Path = HEX,
    cycles: int = whole(
        "--cycles", "Machine cycles of twelve clocks, or single clocks.", low=1, high=10**15, default=1_000_000
    ),
    part: str = word("--part", "8051|8052", "128 bytes of RAM, or 256 and a third timer.", default="8052"),
    timing: str = word(
        "--timing",
        "12-clock|one-clock",
        "The original, or a derivative; decides what a cycle is.",
        default="12-clock",
    ),
    json: bool = _measured.JSON,
) -> None:
    """Run an image from reset for a number of cycles, with all pins high, and say where it is then.

    A fault of the firmware (reserved opcode, unmapped register, code outside the image, stack overflow) ends the run
    and is reported with its address and cycle.

    Example: rtec firmware run blink.hex --cycles 1000000
    Example: rtec firmware run mine.ihx --part 8051 --timing one-clock
    Example: rtec firmware run blink.hex --cycles 100_000 --json
    """
    cpu = _processor(image, part, timing)
    with progress("firmware") as show:
        begun = time.perf_counter()
        reason = "budget"
        while reason == "budget" and cpu.cycles < cycles:
            reason = cpu.run(cycles=min(_SLICE_CYCLES, cycles - cpu.cycles)).reason
            show(cpu.cycles / cycles)
        wall_s = time.perf_counter() - begun
    found: dict[str, object] = {
        "instructions": cpu.instructions,
        "cycles": cpu.cycles,
        "pc": cpu.pc,
        "iram": cpu.iram.tobytes().hex(),
        "wall_s": wall_s,
        "instructions_per_s": cpu.instructions / wall_s if wall_s > 0.0 else None,
        "reason": reason,
        "fault": _fault(cpu),
        "part": part,
        "timing": timing,
    }
    if json:
        print_json(found)
    else:
        _show(found)


def trace(
    image: Path = HEX,
    instructions: int = whole("--instructions", "How many instructions are listed.", low=1, high=10**6, default=40),
    start: int = whole(
        "--from", "Run to this cycle first, unlisted.", low=0, high=10**12, metavar="CYCLE", default=0
    ),
    clock_hz: float = quantity(
        "--clock", FREQUENCY, "12MHz", "Of the processor: what a cycle is in the VCD.", default="12MHz"
    ),
    vcd: Path | None = written("--vcd", "FILE.vcd", "Write the ports' latches meanwhile as waveforms."),
    part: str = word("--part", "8051|8052", "As of run.", default="8052"),
    timing: str = word("--timing", "12-clock|one-clock", "As of run.", default="12-clock"),
    force: bool = force("Write over a VCD that exists."),
    json: bool = _measured.JSON,
) -> None:
    """List instructions as they are executed, each with the cycle in which it begins and the ports that it changes.

    Example: rtec firmware trace blink.hex --from 1000 --instructions 20
    Example: rtec firmware trace blink.hex --instructions 100 --vcd ports.vcd
    Example: rtec firmware trace mine.ihx --timing one-clock --clock 25MHz --json
    """
    from firmware_model.isa.disassembler import disassemble as disassembled

    cpu = _processor(image, part, timing)
    cpu.run(cycles=start)
    cpu.record()
    code, before, begun = cpu.code, _latches(cpu), cpu.cycles
    rows: list[dict[str, Any]] = []
    lines: list[str] = []
    while len(rows) < instructions and cpu.fault is None:
        cycle, line, latches = cpu.cycles, disassembled(code, cpu.pc), _latches(cpu)
        if not cpu.step().cycles:
            break  # power-down
        changed = {
            f"P{k}": now for k, (was, now) in enumerate(zip(latches, _latches(cpu), strict=True)) if was != now
        }
        rows.append({"cycle": cycle, "address": line.address, "text": line.text, "ports": changed})
        ports = " ".join(f"{port}={value:02X}" for port, value in changed.items())
        lines.append(f"{cycle:>12}  {line!s:<40}{ports}".rstrip())
    if vcd is not None:
        _write_vcd(vcd, cpu, before, begun, ps_a_cycle=(12 if timing == "12-clock" else 1) * PS_PER_S / clock_hz)
    if json:
        print_json({"image": str(image), "rows": rows, "fault": _fault(cpu), **({"vcd": str(vcd)} if vcd else {})})
        return
    for shown in lines:
        typer.echo(shown)
    if cpu.fault is not None:
        typer.echo(f"Ended by a fault: {cpu.fault}")
    if vcd is not None:
        typer.echo(f"Waveforms: {vcd}")


def _latches(cpu: Mcs51) -> list[int]:
    return [int(cpu.sfr[0x10 * port]) for port in range(4)]


def _write_vcd(file: Path, cpu: Mcs51, before: list[int], begun: int, *, ps_a_cycle: float) -> None:
    """Write the recorded changes of the ports, a signal for each pin, in time since reset."""
    from rtec.signal.vcd import VcdSignal, VcdWriter

    pins = [(port, bit) for port in range(4) for bit in range(8)]
    signals = [
        VcdSignal(scope=f"P{port}", name=f"P{port}_{bit}", initial=before[port] >> bit & 1) for port, bit in pins
    ]
    latches = list(before)
    changes = []
    for cycle, port, latch in cpu.port_rows().tolist():
        differing = latches[port] ^ latch
        latches[port] = latch
        changes += [
            (round(cycle * ps_a_cycle), 8 * port + bit, latch >> bit & 1) for bit in range(8) if differing >> bit & 1
        ]
    with VcdWriter(file, signals=signals, start_ps=round(begun * ps_a_cycle)) as writer:
        if changes:
            times, numbers, values = zip(*changes, strict=True)
            writer.write(times, numbers, values)
        writer.finish(round(cpu.cycles * ps_a_cycle))


def images(json: bool = _measured.JSON) -> None:
    """List the images of the four designs that come with this package, with processors and files.

    Example: rtec firmware list
    Example: rtec firmware list --json
    Example: rtec firmware list && rtec firmware copy c mine.asm
    """
    from importlib.resources import files

    from firmware_model import read_hex

    folder = Path(str(files("firmware_model") / "images"))
    found = []
    for file in [*sorted(folder.glob("*.ihx")), *sorted(folder.glob("*/*.ihx"))]:
        used = sum(end - begin for begin, end in read_hex(file).used)
        processor = "8051-12mhz" if file.parent == folder else file.parent.name.replace("_", "-")
        source = folder / f"{file.stem}.asm"
        found.append(
            {"design": file.stem, "processor": processor, "bytes": used, "image": str(file), "source": str(source)}
        )
    if json:
        print_json({"images": found})
        return
    for row in found:
        typer.echo(f"{row['design']:<10}{row['processor']:<18}{row['bytes']:>6} bytes  {row['image']}")


def disassemble(image: Path = HEX, json: bool = _measured.JSON) -> None:
    """List the instructions of an image, beginning with the first byte of each range that it uses.

    Data between instructions is listed as instructions, too: nothing in the file tells them apart.

    Example: rtec firmware disassemble blink.hex
    Example: rtec firmware disassemble mine.ihx
    Example: rtec firmware disassemble mine.ihx --json
    """
    from firmware_model import read_hex
    from firmware_model.isa.disassembler import disassemble_image

    with as_bad_input():
        memory = read_hex(image)
    lines = list(disassemble_image(memory.code, memory.used))
    if json:
        rows = [{"address": line.address, "code": line.code.hex(), "text": line.text} for line in lines]
        print_json({"image": str(image), "lines": rows})
        return
    for line in lines:
        typer.echo(str(line))


def copy(
    design: str = typer.Argument(
        ...,
        metavar="original|a|b|c",
        help="What to begin with.",
        show_default=False,
        autocompletion=among("original|a|b|c"),
    ),
    file: Path = typer.Argument(..., metavar="MINE.asm", help="Your source.", show_default=False),
    force: bool = force("Write over a file that exists."),
    json: bool = _measured.JSON,
) -> None:
    """Copy the source of a design that comes with this package, as a beginning of your own.

    Example: rtec firmware copy c mine.asm
    Example: rtec firmware copy original mine.asm --force
    Example: rtec firmware copy b mine.asm && rtec firmware build mine.asm
    """
    from importlib.resources import files

    from rtec.injector import Design
    from rtec.io import write_bytes

    name = Design.named(design).value
    check_file("MINE.asm", file, force=force, endings=(".asm",))
    source = (files("firmware_model") / "images" / f"{name}.asm").read_bytes()
    write_bytes(file, source)
    if json:
        print_json({"source": str(file), "design": name})
    else:
        typer.echo(f"{file}: design {name}")


def build(
    source: Path = typer.Argument(..., metavar="MINE.asm", help="Your source.", show_default=False),
    processor: str = option(
        "--processor",
        "NAME",
        f"What processor.inc stands for: {', '.join(_INCLUDES)}.",
        read=lambda said: choice(said, _INCLUDES, name="--processor"),
        default="8051-12mhz",
    ),
    json: bool = _measured.JSON,
) -> None:
    """Assemble a source with SDCC: MINE.ihx, the listing MINE.lst and the labels MINE.sym beside MINE.asm.

    The shared parts of this package (rtec.inc, common.asm, ...) are there under their bare names; files of the same
    name beside the source take their place.

    Example: rtec firmware build mine.asm
    Example: rtec firmware build mine.asm --processor one-clock-25mhz
    Example: rtec firmware build mine.asm --json
    """
    from firmware_model.images.build import BuildError, assemble
    from rtec.io import write_text

    include = _INCLUDES[processor]
    for suffix in _OUTPUTS if source.is_file() else ():
        check_file("MINE.asm", source.with_suffix(suffix), force=True)
    try:
        outputs = assemble(source, include)
    except (BuildError, subprocess.TimeoutExpired) as error:
        raise RtecError(str(error)) from error
    except UnicodeDecodeError as error:
        raise OutputError(f"{source}: the assembler's output is no text: {error}") from error
    written = []
    for suffix, text in outputs.items():
        file = source.with_suffix(suffix)
        write_text(file, text)
        written.append(str(file))
    if json:
        print_json({"source": str(source), "processor": processor, "written": written})
    else:
        typer.echo(f"written: {', '.join(written)}")


def application(group: type[typer.core.TyperGroup]) -> typer.Typer:
    """Return the verbs of firmware as one."""
    from rtec.cli.firmware_check import check

    verbs: dict[str, Callable[..., None]] = {
        "run": run,
        "trace": trace,
        "disassemble": disassemble,
        "list": images,
        "copy": copy,
        "build": build,
        "check": check,
    }
    return verbs_under(frame, verbs, group)


def _processor(image: Path, part: str, timing: str) -> Mcs51:
    from firmware_model import Mcs51, read_hex

    with as_bad_input():
        memory = read_hex(image)
    cpu = Mcs51(
        memory, part=cast("Literal['8051', '8052']", part), timing=cast("Literal['12-clock', 'one-clock']", timing)
    )
    cpu.run(cycles=0)  # loads or compiles the loop, executes nothing
    return cpu


def _fault(cpu: Mcs51) -> dict[str, object] | None:
    fault = cpu.fault
    if fault is None:
        return None
    return {"kind": fault.kind.value, "pc": fault.pc, "opcode": fault.opcode, "cycle": fault.cycle}


def _show(found: dict[str, object]) -> None:
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
