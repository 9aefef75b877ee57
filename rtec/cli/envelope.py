"""``rtec envelope``: how fast the encoder may go, for each design and processor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rtec.cli import _console, _measured
from rtec.cli._arguments import option, whole_option
from rtec.cli._motion import DEFAULT_ACCELERATION, MOTION_NAMES, read_motion
from rtec.cli._words import PROCESSORS, files_ending
from rtec.errors import ArgumentError
from rtec.io import FIGURES, check_file
from rtec.units import parse_time_ps

if TYPE_CHECKING:
    from rtec.campaign.envelope import EnvelopePlan, EnvelopeRow
    from rtec.campaign.envelope_motion import InMotion


def envelope(
    design: Annotated[
        list[str] | None, option(metavar="original|a|b|c", help="Only this design; may be given again.")
    ] = None,
    processor: Annotated[
        list[str] | None,
        option(
            "--processor",
            metavar="NAME",
            help=f"Only this: {', '.join(PROCESSORS)}, or as 'one-clock 50MHz'; may be given again.",
        ),
    ] = None,
    image: Annotated[
        Path | None,
        option(
            metavar="MINE.hex",
            help="Your program for the one --design, as Intel HEX.",
            complete=files_ending(".hex", ".ihx"),
        ),
    ] = None,
    jitter: Annotated[
        str, option(metavar="5ns", help="Bound of the encoder's jitter; its worst within that is tried.")
    ] = "0ns",
    hold_latch: Annotated[
        bool,
        typer.Option("--hold-latch", help="Hold real transitions back during an insertion, unlike the report."),
    ] = False,
    nothing_owed: Annotated[
        bool, typer.Option("--nothing-owed", help="Ask for nothing: how fast --design b passes the lines on alone.")
    ] = False,
    exhaustive: Annotated[
        bool, typer.Option("--exhaustive", help="Sweep the limits found over a whole reading, clock by clock.")
    ] = False,
    motion: Annotated[
        str | None,
        option("--motion", metavar="MOTION", help=f"Search its top speed: {MOTION_NAMES}."),
    ] = None,
    acceleration: Annotated[
        str | None, option(metavar="'100 MHz/s'", help="Of the frequency, with --motion; 100 MHz/s.")
    ] = None,
    seed: Annotated[int | None, whole_option(low=0, help="Of --motion adversary; 0.")] = None,
    figure: Annotated[
        Path | None, option(metavar="FILE.png", help="Draw what each does at which frequency: .png, .svg, .pdf.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over a figure that exists.")] = False,
    json: _measured.Json = False,
) -> None:
    """Find the largest safe encoder frequency of each design on each processor, and what breaks first.

    The firmware runs on the box's circuits. The moment of each transition is moved past the program in steps of one
    clock of the processor, until at some frequency a count is wrong or a transition illegal.

    Example: rtec envelope --design c --processor 8051-12mhz --processor 'one-clock 50MHz'
    Example: rtec envelope --design b --nothing-owed --figure envelope.png
    Example: rtec envelope --design a --image mine.hex --jitter 5ns --json
    """
    if figure is not None:
        check_file("--figure", figure, force=force, endings=FIGURES)
    moved = _motion(motion, acceleration, seed, jitter, exhaustive, nothing_owed)
    plan = _plan(design, processor, image, jitter, hold_latch, nothing_owed, exhaustive, moved)
    from rtec.campaign.envelope import find_envelope

    _console.announce_compilation()
    with _console.progress("envelope") as progress:
        rows = find_envelope(plan, progress)
    if figure is not None:
        from rtec.report.figures_envelope import write_envelope_figure

        write_envelope_figure(rows, figure)
    if json:
        _console.print_json({"rows": [row_as_json(row) for row in rows], "figure": figure and str(figure)})
        return
    from rtec.report.terminal_envelope import show

    show(rows)
    if figure is not None:
        typer.echo(f"Figure: {figure}")


def _motion(
    motion: str | None, acceleration: str | None, seed: int | None, jitter: str, exhaustive: bool, nothing_owed: bool
) -> InMotion | None:
    """Return what the options say of the motion."""
    if motion is None:
        for option, value in (("--acceleration", acceleration), ("--seed", seed)):
            if value is not None:
                raise ArgumentError(option, value, "nothing without --motion")
        return None
    for option, given in (
        ("--jitter", jitter != "0ns"),
        ("--exhaustive", exhaustive),
        ("--nothing-owed", nothing_owed),
    ):
        if given:
            raise ArgumentError(option, "given", "nothing with --motion", "it belongs to the envelope's own trials")
    from rtec.axis.motion import MotionKind
    from rtec.campaign.envelope_motion import InMotion

    kind, program, gain = read_motion(motion, acceleration or DEFAULT_ACCELERATION)
    if seed is not None and kind is not MotionKind.ADVERSARY:
        raise ArgumentError("--seed", seed, "nothing with this motion", "nothing in it is random")
    try:
        return InMotion(kind=kind, program=program, acceleration_hz_s=gain, seed=seed or 0)
    except ArgumentError as error:
        raise ArgumentError(f"--{error.name}", error.value, error.allowed, error.hint) from error


def _plan(
    design: list[str] | None, processor: list[str] | None, image: Path | None, jitter: str, hold_latch: bool,
    nothing_owed: bool, exhaustive: bool, motion: InMotion | None,
) -> EnvelopePlan:  # fmt: skip
    """Return what the options say.

    Raises
    ------
    RtecError
        Options that are wrong, or an image that cannot be read.
    """
    jitter_ps = parse_time_ps(jitter, name="--jitter")
    from firmware_model import FirmwareError, read_hex
    from rtec.board import MICROCONTROLLERS, Microcontroller
    from rtec.campaign.envelope import EnvelopePlan
    from rtec.errors import RtecError
    from rtec.injector import Design
    from rtec.injector.design import IN_PATH

    designs = tuple(dict.fromkeys(Design.named(name) for name in design)) if design else tuple(Design)
    processors = tuple(dict.fromkeys(Microcontroller.named(name) for name in processor or MICROCONTROLLERS))
    if image is not None and (design is None or len(designs) != 1):
        raise ArgumentError("--image", str(image), "a program beside exactly one --design", "say which one it is for")
    if nothing_owed and designs != IN_PATH:
        raise ArgumentError("--nothing-owed", "given", "beside --design b alone", "the others' lines pass the gates")
    try:
        program = None if image is None else read_hex(image)
        return EnvelopePlan(
            designs=designs, processors=processors, image=program, hold_latch=hold_latch, jitter_ps=jitter_ps,
            exhaustive=exhaustive, nothing_owed=nothing_owed, motion=motion,
        )  # fmt: skip
    except FirmwareError as error:
        raise RtecError(str(error)) from error
    except ArgumentError as error:
        raise ArgumentError("--jitter", jitter, "a time from 0 to 1 ms") from error


def row_as_json(row: EnvelopeRow) -> dict[str, object]:
    """Return a row with the keys that scripts rely on, and more."""
    gate, failing, speeds = row.gate, row.failing, row.speeds
    acceleration = None if gate is None else gate.max_acceleration_counts_s2
    return {
        "design": row.design.value,
        "processor": row.processor,
        "clock_hz": row.clock_hz,
        "max_safe_hz": row.max_safe_hz,
        "limited_by": row.limited_by.value,
        "reaches_500khz": row.reaches_500khz,
        "gate_hz": None if gate is None else gate.gate_hz,
        "counts_right_above_gate": row.counts_right,
        "checked_to_hz": row.checked_to_hz,
        "max_inserting_hz": speeds.frequencies.max_inserting_hz,
        "max_passing_hz": speeds.frequencies.max_passing_hz,
        "at_500khz": speeds.at_top.value,
        "summary": speeds.summary,
        "frequencies": [{"frequency_hz": hertz, "does": does.value} for hertz, does in speeds.frequencies.rows],
        "max_jitter_ps": speeds.max_jitter_ps,
        "max_acceleration_hz_s": speeds.max_acceleration_hz_s,
        "data_sheet": dict(speeds.data_sheet()),
        "max_acceleration_counts_s2": acceleration,
        "max_acceleration_m_s2_at_1um": None if acceleration is None else acceleration * 1e-6,
        "failing": None
        if failing is None
        else {
            "frequency_hz": failing.frequency_hz,
            "phase_clocks": failing.phase_clocks,
            "direction": failing.direction,
            "sign": failing.sign,
            "behind_state": failing.behind_state,
            "what": failing.what,
            "stream": failing.stream,
        },
        "waiting_loop_cycles": row.loop_cycles,
        "trials": row.trials,
        "sweep": "exhaustive" if row.exhaustive else "short",
        "jitter_ps": row.jitter_ps,
        "hold_latch": row.hold_latch,
        "motion": None if row.motion is None else row.motion.value,
    }
