"""``rtec firmware check``: a user's own image held to the contract of a design."""

from __future__ import annotations

import bisect
import dataclasses
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _console, _measured
from rtec.cli._image import HEX, as_bad_input, with_part
from rtec.cli._parameters import design, flag, force, processor, quantity, whole, word, written
from rtec.cli._verb import said
from rtec.cli._words import PROCESSORS
from rtec.io import FIGURES, read_any_text
from rtec.units import FREQUENCY

if TYPE_CHECKING:
    from rtec.board import Microcontroller
    from rtec.injector import Design
    from rtec.verify.firmware.check import FirmwareCheckPlan
    from rtec.verify.firmware.results import Check, FirmwareVerdict

_LISTED = 12
"""Instructions shown before a failure; --json holds more."""


def check(
    context: typer.Context,
    image: Path = HEX,
    design: Design = design("Whose circuits stand around the processor.", default=...),
    processor: Microcontroller = processor(f"{', '.join(PROCESSORS)}, or as '12-clock 16MHz'.", default="8051-12mhz"),
    part: str | None = word(
        "--part",
        "8051|8052",
        "128 bytes of RAM, or 256 and timer 2; without it the smaller one on a 12-clock processor.",
    ),
    hold_latch: bool = flag(
        "--hold-latch/--no-hold-latch",
        "P1.7 holds real edges back; the report's circuits have no latch.",
        default=True,
    ),
    frequency_hz: list[float] | None = quantity(
        "--frequency",
        FREQUENCY,
        "5kHz",
        "Here a step has to be inserted during motion, as often as wanted; two that suit the processor if not "
        "given. Every count has to be right up to 500 kHz; of design b, whose lines pass through the processor, "
        "up to the highest of these.",
    ),
    phases: int = whole(
        "--phases", "Phases between edge and program, at each speed.", low=1, high=10_000, default=24
    ),
    tries: int = whole("--tries", "Streams of the hunt.", low=16, high=10_000_000, default=3000),
    seed: int = whole("--seed", "Of the hunt for the worst case.", low=0, default=0),
    figure: Path | None = written(
        "--figure", "FILE.png", "Draw the slowest insertion, or the shortest failing run.", endings=FIGURES
    ),
    vcd: Path | None = written("--vcd", "FILE.vcd", "The same as waveforms."),
    force: bool = force("Write over files that exist."),
    json: bool = _measured.JSON,
) -> None:
    """Hold an image to a design's contract by experiment: all that rtec check tries, and pins, messages, reset.

    Exits with 1 where a point fails, naming cycle, time and address. The contract stands in docs/firmware.md, a
    walk through in docs/how-to-firmware.md.

    Example: rtec firmware check mine.ihx --design c
    Example: rtec firmware check mine.ihx --design c --processor one-clock-25mhz --frequency 50kHz
    Example: rtec firmware check mine.ihx --design original --no-hold-latch --figure mine.png
    """
    from firmware_model import read_hex
    from rtec.verify.firmware.check import FirmwareCheckPlan, check_firmware

    with as_bad_input():
        plan = FirmwareCheckPlan(
            image=read_hex(image),
            design=design,
            microcontroller=with_part(processor, part),
            hold_latch=hold_latch,
            frequencies_hz=tuple(frequency_hz or ()),
            phases=phases,
            tries=tries,
            seed=seed,
        )
    with _console.progress("check") as show:
        verdict = check_firmware(plan, show)
    written = _write(verdict, figure, vcd)
    worst = _again(image, plan, said(context, "processor", "part"), verdict)
    if json:
        _console.print_json(verdict.to_dict() | {"worst_case": worst} | written)
    else:
        _show(verdict, _Labels.beside(image), worst)
        for name, file_name in written.items():
            typer.echo(f"{name}: {file_name}")
    if not verdict.passed:
        raise typer.Exit(1)


def _write(verdict: FirmwareVerdict, figure: Path | None, vcd: Path | None) -> dict[str, str]:
    written: dict[str, str] = {}
    for name, file in (("figure", figure), ("vcd", vcd)):
        if file is None:
            continue
        if verdict.trace is None:
            _console.note(f"{file} not written: the program has not come to an insertion")
            continue
        if name == "figure":
            from rtec.report.figures_firmware import insertion_figure
            from rtec.report.figures_style import write_figure

            write_figure(partial(insertion_figure, verdict), file)
        else:
            verdict.trace.write(file)
        written[name] = str(file)
    return written


def _again(image: Path, plan: FirmwareCheckPlan, words: list[str], verdict: FirmwareVerdict) -> str | None:
    """Return the command that plays the worst case again."""
    from rtec.cli.check import again
    from rtec.verify.contract.contract import Contract

    suite = verdict.suite
    if suite is None or suite.worst is None:
        return None
    hertz = suite.contract.frequency_hz
    usual = hertz == Contract.of(plan.design).frequency_hz
    words = ["--design", plan.design.value, *([] if usual else ["--frequency", f"{hertz:g}Hz"]), *words]
    return again(str(image), words + ([] if plan.hold_latch else ["--no-hold-latch"]), suite.worst.case.stream)


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
    if verdict.worst_insertion_us is not None:
        slowest = f"{verdict.worst_insertion_us:.4g} µs ({verdict.worst_insertion_cycles:.4g} cycles)"
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
    if point.time_ps is None:
        return ""
    label = "" if point.pc is None or not labels.names else f" ({labels.name(point.pc)})"
    pc = "" if point.pc is None else f" at {point.pc:04X}h{label}"
    return f"\ncycle {point.cycle}, {point.time_ps / 1e6:.2f} µs{pc}"
