"""``rtec firmware check``: a user's own image held to the contract of a design."""

from __future__ import annotations

import bisect
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer

from rtec.cli import _console, _measured
from rtec.cli._arguments import choice, option, whole_option
from rtec.cli._words import PROCESSORS, files_ending
from rtec.errors import ArgumentError
from rtec.io import FIGURES, check_file, read_any_text

if TYPE_CHECKING:
    from rtec.campaign import Check, FirmwareCheckPlan, FirmwareVerdict

_OPTIONS = {name: f"--{name}" for name in ("design", "processor", "frequency", "phases", "tries", "seed")}
_PROCESSOR = "8051-12mhz"
_LISTED = 12
"""Instructions shown before a failure; --json holds more."""


def check(
    image: Annotated[
        Path,
        typer.Argument(
            metavar="IMAGE.hex",
            help="Machine code as Intel HEX.",
            show_default=False,
            autocompletion=files_ending(".hex", ".ihx"),
        ),
    ],
    design: Annotated[
        str,
        option(metavar="original|a|b|c", help="Whose circuits stand around the processor.", show_default=False),
    ],
    processor: Annotated[
        str, option("--processor", metavar="NAME", help=f"{', '.join(PROCESSORS)}, or as '12-clock 16MHz'.")
    ] = _PROCESSOR,
    part: Annotated[
        str | None,
        option(
            metavar="8051|8052",
            help="128 bytes of RAM, or 256 and timer 2; without it the smaller one on a 12-clock processor.",
        ),
    ] = None,
    hold_latch: Annotated[
        bool,
        typer.Option(
            "--hold-latch/--no-hold-latch",
            help="P1.7 holds real edges back; the report's circuits have no latch.",
        ),
    ] = True,
    frequency: Annotated[
        list[str] | None,
        option(
            metavar="5kHz",
            help="Here a step has to be inserted during motion, as often as wanted; two that suit the processor if "
            "not given. Every count has to be right up to 500 kHz; of design b, whose lines pass through the "
            "processor, up to the highest of these.",
        ),
    ] = None,
    phases: Annotated[
        int, whole_option(low=1, high=10_000, help="Phases between edge and program, at each speed.")
    ] = 24,
    tries: Annotated[int, whole_option(low=16, high=10_000_000, help="Streams of the hunt.")] = 3000,
    seed: Annotated[int, whole_option(low=0, help="Of the hunt for the worst case.")] = 0,
    figure: Annotated[
        Path | None,
        option(metavar="FILE.png", help="Draw the slowest insertion, or the shortest failing run."),
    ] = None,
    vcd: Annotated[Path | None, option(metavar="FILE.vcd", help="The same as waveforms.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over files that exist.")] = False,
    json: _measured.Json = False,
) -> None:
    """Hold an image to a design's contract by experiment: all that rtec check tries, and pins, messages, reset.

    Exits with 1 where a point fails, naming cycle, time and address. The contract stands in docs/firmware.md, a
    walk through in docs/how-to-firmware.md.

    Example: rtec firmware check mine.ihx --design c
    Example: rtec firmware check mine.ihx --design c --processor one-clock-25mhz --frequency 50kHz
    Example: rtec firmware check mine.ihx --design original --no-hold-latch --figure mine.png
    """
    from rtec.cli.firmware import as_bad_input

    if figure is not None:
        check_file("--figure", figure, force=force, endings=FIGURES)
    if vcd is not None:
        check_file("--vcd", vcd, force=force)
    with as_bad_input():
        plan = _plan(image, design, processor, part, hold_latch, frequency or [], phases, tries, seed)
    _console.announce_compilation()
    from rtec.campaign import check_firmware

    with _console.progress("check") as show:
        verdict = check_firmware(plan, show)
    written = _write(verdict, figure, vcd)
    worst = _again(image, plan, processor, part, verdict)
    if json:
        _console.print_json(verdict.to_dict() | {"worst_case": worst} | written)
    else:
        _show(verdict, _Labels.beside(image), worst)
        for name, file_name in written.items():
            typer.echo(f"{name}: {file_name}")
    if not verdict.passed:
        raise typer.Exit(1)


def _plan(
    image: Path,
    design: str,
    processor: str,
    part: str | None,
    hold_latch: bool,
    frequencies: list[str],
    phases: int,
    tries: int,
    seed: int,
) -> FirmwareCheckPlan:
    """Read everything that the user said."""
    from firmware_model import read_hex
    from firmware_model.isa.parts import PARTS
    from rtec.board import Microcontroller
    from rtec.campaign import FirmwareCheckPlan
    from rtec.injector import Design
    from rtec.units import FREQUENCY, parse_quantity

    try:
        chip = Microcontroller.named(processor)
        known = "8051" if chip.timing == "12-clock" else "8052"
        kind = known if part is None else choice(part, PARTS, name="--part")
        return FirmwareCheckPlan(
            image=read_hex(image),
            design=Design.named(design),
            microcontroller=dataclasses.replace(chip, part=cast("Literal['8051', '8052']", kind)),
            hold_latch=hold_latch,
            frequencies_hz=tuple(parse_quantity(text, FREQUENCY, name="--frequency") for text in frequencies),
            phases=phases,
            tries=tries,
            seed=seed,
        )
    except ArgumentError as error:
        name = _OPTIONS.get(error.name, error.name)
        raise ArgumentError(name, error.value, error.allowed, error.hint) from error


def _write(verdict: FirmwareVerdict, figure: Path | None, vcd: Path | None) -> dict[str, str]:
    """Write the files that were asked for; return them by their names."""
    written: dict[str, str] = {}
    for name, file in (("figure", figure), ("vcd", vcd)):
        if file is None:
            continue
        if verdict.trace is None:
            _console.note(f"{file} not written: the program has not come to an insertion")
            continue
        if name == "figure":
            from rtec.report.figures_firmware import write_insertion_figure

            write_insertion_figure(verdict, file)
        else:
            from rtec.campaign.firmware_check_vcd import write_trace

            write_trace(verdict.trace, file)
        written[name] = str(file)
    return written


def _again(
    image: Path, plan: FirmwareCheckPlan, processor: str, part: str | None, verdict: FirmwareVerdict
) -> str | None:
    """Return the command that plays the worst case again."""
    from rtec.cli.check import Options
    from rtec.conformance.contract import Contract

    suite = verdict.suite
    if suite is None or suite.worst is None:
        return None
    hertz = suite.contract.frequency_hz
    said = {
        "algorithm": str(image),
        "design": plan.design.value,
        "processor": None if processor == _PROCESSOR else processor,
        "part": part,
        "frequency": None if hertz == Contract.of(plan.design).frequency_hz else f"{hertz:g}Hz",
        "hold_latch": None if plan.hold_latch else False,
    }
    nothing = dict.fromkeys(Options.__dataclass_fields__)
    return Options(**(nothing | said)).command(str(suite.worst.case.stream))  # type: ignore[arg-type]  # by name


@dataclasses.dataclass(frozen=True)
class _Labels:
    """Addresses with names, as build.py writes them beside an image."""

    addresses: list[int]
    names: list[str]

    @classmethod
    def beside(cls, image: Path) -> _Labels:
        """Read NAME.sym where there is one; what it does not hold goes without a name."""
        rows = []
        file = image.with_suffix(".sym")
        if file.is_file():
            try:
                for line in read_any_text(file)[0].splitlines():
                    address, _, name = line.strip().partition(" ")
                    rows.append((int(address, 16), name.strip()))
            except ValueError:
                return cls([], [])  # of another tool
        rows.sort()
        return cls([address for address, _ in rows], [name for _, name in rows])

    def name(self, address: int) -> str:
        """Return the label at or before an address, with the distance."""
        index = bisect.bisect_right(self.addresses, address) - 1
        if index < 0:
            return ""
        beyond = address - self.addresses[index]
        return f"{self.names[index]}{f' + {beyond}' if beyond else ''}"


def _show(verdict: FirmwareVerdict, labels: _Labels, worst: str | None) -> None:
    """Print the verdict for people."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from rtec.report.terminal_check import RESULTS, show_sheet, show_worst

    latch = "with" if verdict.hold_latch else "without"
    title = (
        f"{verdict.image}: design {verdict.design.value}, {verdict.processor} ({verdict.part}), {latch} hold latch"
    )
    table = Table(show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for point in verdict.checks:
        table.add_row(point.name, RESULTS[point.passed], Text(point.detail + _where(point, labels)))
    console = Console(highlight=False)
    console.print(Text(title), soft_wrap=True)
    console.print(table)
    failed = next((point for point in verdict.checks if point.passed is False), None)
    if failed is not None and failed.executed:
        console.print(f"Executed before it ({failed.name}):")
        for row in failed.executed[-_LISTED:]:
            at = f"{row.cycle:>10}  {row.address:04X}  {row.text:<28}P1={row.port_1:02X}  {labels.name(row.address)}"
            console.print(Text(at.rstrip()), soft_wrap=True)
    if verdict.suite is not None:
        show_sheet(console, verdict.suite)
    if verdict.seen.worst_insertion_us is not None:
        slowest = f"{verdict.seen.worst_insertion_us:.4g} µs ({verdict.seen.worst_insertion_cycles:.4g} cycles)"
        console.print(Text(f"slowest insertion: {slowest} from the transition to the last change"), soft_wrap=True)
    if verdict.suite is not None and worst is not None:
        show_worst(console, verdict.suite, worst)
    count = sum(point.passed is False for point in verdict.checks)
    style = "green" if verdict.passed else "bold red"
    tried = (
        f"{len(verdict.checks)} points hold" if verdict.passed else f"{count} of {len(verdict.checks)} points fail"
    )
    console.print(f"{'passed' if verdict.passed else 'FAILED'}: {tried}", style=style)


def _where(point: Check, labels: _Labels) -> str:
    if point.moment is None:
        return ""
    moment = point.moment
    label = "" if moment.pc is None or not labels.names else f" ({labels.name(moment.pc)})"
    pc = "" if moment.pc is None else f" at {moment.pc:04X}h{label}"
    return f"\ncycle {moment.cycle}, {moment.time_ps / 1e6:.2f} µs{pc}"
